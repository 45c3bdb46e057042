"""The controls that are always visible: six sliders, *Pour again* (also by key), and *Pour a second* beside it.

Five act on the running pour; the feed rate acts on the next one. Each stands for one physical quantity, wherever in the
scene it occurs; what one slider moves together is set apart under Set-up.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from explorer.live.messages import Status
from explorer.viewer.actions import add_keys, button_group
from explorer.viewer.number_box import with_decimals
from explorer.viewer.panel import CONTROLS, PageContext
from explorer.viewer.pour.live_sliders import LiveControl, control_for, screen_range, titled
from explorer.viewer.pour.rebuilt_panel import RebuiltPanel
from explorer.viewer.pour.restart_panel import LARGEST_SEED, entered, on_screen, same_value
from explorer.viewer.pour.second_pile import POUR_SECOND, SECOND_HINT
from solver.scenes.material import Pair
from solver.scenes.scene import Scene, parameters, value, with_values

AGAIN, SAME_SEED, RESTART = "Pour again", "Same seed", "Pour again (R)"
KEYS: dict[str, Any] = {RESTART: "R"}
FEED_RATE = "insertion.rate"


class ControlsPanel(RebuiltPanel["Controls"]):
    """The controls that are always visible."""

    name, tab = "controls", CONTROLS

    def __init__(self, page: PageContext) -> None:
        super().__init__(page)
        page.channel.offer("restart", lambda _: page.post(self._again))
        add_keys(page.server.gui, {RESTART: self._again}, KEYS, page.post)

    def _again(self) -> None:
        """Carry out the timeline's button and key: the same as *Same seed*, with the feed rate that was entered."""
        self._controls.pour(0)

    def build(self, scene: Scene) -> Controls:
        """Make the sliders for ``scene``."""
        return Controls(self._page, scene)


class Controls:
    """Sliders for the quantities that ``scene`` has."""

    def __init__(self, page: PageContext, scene: Scene) -> None:
        gui, session, post = page.server.gui, page.session, page.post
        self._page, self._session = page, session
        self._generation = session.status().generation
        known = parameters(scene)
        self._place = gui.add_folder(None)
        self._live: list[LiveControl] = []
        self._build(scene)
        self._feed = None
        if FEED_RATE in known:
            low, high = screen_range(known[FEED_RATE])
            self._feed = with_decimals(
                gui.add_number(
                    titled(known[FEED_RATE], "Feed rate"),
                    on_screen(known[FEED_RATE], scene),
                    min=low,
                    max=high,
                    hint=f"Acts on the next pour. {known[FEED_RATE].doc}",
                )
            )
        button_group(
            gui,
            "Second pile",
            {POUR_SECOND: page.beside.pour_present, "Take away": page.beside.close},
            post,
            hint=SECOND_HINT,
        )
        button_group(
            gui,
            AGAIN,
            {"New seed": lambda: self.pour(1), SAME_SEED: lambda: self.pour(0)},
            post,
            hint="Pours anew with the parameters as they are now. The same seed gives the same pile, to the last bit; "
            "a new one shows how piles of the same parameters scatter.",
        )

    def show(self, status: Status) -> None:
        """Follow the solver's values, and the feed of a pour that was begun elsewhere."""
        if self._feed is not None and status.generation != self._generation:
            self._feed.value = on_screen(parameters(status.scene)[FEED_RATE], status.scene)
        self._generation = status.generation
        if not all(control.fits(status.scene) for control in self._live):
            self._build(status.scene)
        for control in self._live:
            control.follow(status.scene)

    def _build(self, scene: Scene) -> None:
        """Make sliders for ``scene``, in place of the former ones."""
        for control in self._live:
            control.remove()
        known, page = parameters(scene), self._page
        with self._place:
            self._live = [
                control_for(scene, paths)(
                    page.server.gui, known[paths[0]], paths, scene, page.post, page.session.set_parameters, label
                )
                for label, paths in quantities(scene).items()
            ]

    def pour(self, step: int) -> None:
        """Pour again with the entered feed rate and the ``step``-th seed after the present one."""
        status = self._session.status()
        scene = status.scene
        if self._feed is not None:
            wanted = entered(parameters(scene)[FEED_RATE], self._feed.value)
            if not same_value(value(scene, FEED_RATE), wanted):
                scene = with_values(scene, {FEED_RATE: wanted})
        self._session.restart(scene, (status.seed + step) % (LARGEST_SEED + 1))


def quantities(scene: Scene) -> Mapping[str, tuple[str, ...]]:
    """Label of a slider → the paths that it moves together, of live parameters that ``scene`` has."""
    bodies = tuple(dict.fromkeys(body.material for body in scene.bodies))
    among = [pair for pair in scene.pairs if pair.a != scene.rig.wall and pair.b != scene.rig.wall]
    at_wall = [pair for pair in scene.pairs if scene.rig.wall in (pair.a, pair.b) and pair.a != pair.b]

    def of(pairs: list[Pair], name: str) -> tuple[str, ...]:
        return tuple(f"pair.{pair.a}.{pair.b}.{name}" for pair in pairs)

    found = {
        "Friction": of(among, "static_friction"),
        "Wall friction": of(at_wall, "static_friction"),
        "Restitution": of([*among, *at_wall], "restitution"),
        "Shear modulus": tuple(f"material.{name}.shear_modulus" for name in bodies),
        "Rolling friction": ("effect.rolling_resistance.rolling_friction",),
    }
    known = parameters(scene)
    live = {
        label: tuple(path for path in paths if path in known and known[path].live) for label, paths in found.items()
    }
    return {label: paths for label, paths in live.items() if paths}
