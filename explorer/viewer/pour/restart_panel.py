"""Settings of the set-up, which act on the next pour, and the seed."""

from __future__ import annotations

from typing import Any

import viser

from explorer.live.messages import Status
from explorer.live.session import Session
from explorer.units import checked, screen_unit, title
from explorer.viewer.actions import Post
from explorer.viewer.number_box import with_decimals
from explorer.viewer.panel import SET_UP
from explorer.viewer.pour.rebuilt_panel import RebuiltPanel
from solver.effects import set_up_effects
from solver.params import Parameter, declared
from solver.scenes.scene import Scene, parameters, value, with_values

PATHS = (
    "rig.mass",
    "rig.outlet_height",
    "rig.lift_speed",
    "rig.slot_width",
    "rig.filled_volume",
    "rig.speed_rpm",
    "insertion.rate",
    "insertion.drop_speed",
    "insertion.protocol",
    "body.spheres",
)
"""Parameters in this panel, in order; those that the rig has."""
LARGEST_SEED = 2**31 - 1
SIGNIFICANT_STEP = {"mm": 1.0, "g": 1.0, "g/s": 1.0, "m/s": 0.1, "": 0.01}


def size_paths(scene: Scene) -> tuple[str, ...]:
    """Parameters of the folder of sizes: how the bodies of each component scatter."""
    return tuple(f"body.{body.name}.{key}" for body in scene.bodies for key in ("size_distribution", "size_spread"))


def rest_paths(scene: Scene) -> tuple[str, ...]:
    """Parameters of the folder of rig and feed: all that are not in the panel itself. Files are for `scene_panel`."""
    known = parameters(scene).items()
    ours = [path for path, parameter in known if path.split(".")[0] in ("rig", "insertion") and not parameter.files]
    return tuple(path for path in ours if path not in PATHS)


def effect_paths() -> tuple[str, ...]:
    """Parameters of the folder of effects of material and set-up."""
    return tuple(path for kind in set_up_effects() for path in declared(kind, f"effect.{kind.name}"))


class RestartPanel(RebuiltPanel["SetUpInputs"]):
    """The settings that act on the next pour."""

    name, tab = "set_up", SET_UP

    def build(self, scene: Scene) -> SetUpInputs:
        """Make the inputs for ``scene``."""
        session = self._page.session
        return SetUpInputs(self._page.server, session, scene, session.status().seed, self._page.post)


class SetUpInputs:
    """Number boxes and choices made from the declarations; a button pours again with all of them."""

    def __init__(self, server: viser.ViserServer, session: Session, scene: Scene, seed: int, post: Post) -> None:
        self._session, self._generation = session, session.status().generation
        known = parameters(scene)
        set_up = [path for path in PATHS if path in known]
        self._shown = {path: known[path] for path in (*set_up, *rest_paths(scene), *size_paths(scene), *effect_paths())}
        with server.gui.add_folder("Set-up (on restart)"):
            self._inputs = {path: parameter_input(server.gui, known[path], scene) for path in set_up}
            with server.gui.add_folder("More of rig and feed", expand_by_default=False):
                self._inputs |= {path: parameter_input(server.gui, known[path], scene) for path in rest_paths(scene)}
            with server.gui.add_folder("Sizes of the bodies", expand_by_default=False):
                self._inputs |= {path: parameter_input(server.gui, known[path], scene) for path in size_paths(scene)}
            with server.gui.add_folder("Effects of material and set-up", expand_by_default=False):
                self._inputs |= {path: parameter_input(server.gui, known[path], scene) for path in effect_paths()}
            self._seed = server.gui.add_number(
                "Seed", seed, min=0, max=LARGEST_SEED, step=1, hint="Same seed, same pour."
            )
            button = server.gui.add_button("Restart with this set-up")
        button.on_click(lambda _: post(self._restart))

    def show(self, status: Status) -> None:
        """Show what a new pour was started with, whoever started it: another browser, or a key."""
        if status.generation == self._generation:
            return
        self._generation = status.generation
        self._seed.value = status.seed  # type: ignore[misc]
        for path, parameter in self._shown.items():
            present = on_screen(parameter, status.scene)
            if parameter.choices:
                self._inputs[path].options = options(parameter, present)
            self._inputs[path].value = present

    def _restart(self) -> None:
        """Read all inputs, check them as a whole, and pour; parameters changed live keep their values."""
        values = {path: entered(p, self._inputs[path].value) for path, p in self._shown.items()}
        seed = int(checked(self._seed.value, 0, LARGEST_SEED, "seed"))
        present = self._session.status().scene
        # Untouched values stay exact to the last digit: a number box shows six.
        changed = {path: new for path, new in values.items() if not same_value(value(present, path), new)}
        self._session.restart(with_values(present, changed), seed)


def entered(parameter: Parameter, number: object) -> float | str:
    """What a browser sent for ``parameter``, in SI or as the name of a choice; raises InputError."""
    if parameter.choices:
        return str(number)
    unit = screen_unit(parameter)
    low, high = unit.to_screen(parameter.low), unit.to_screen(parameter.high)
    return min(max(unit.to_si(checked(number, low, high, title(parameter))), parameter.low), parameter.high)


def on_screen(parameter: Parameter, scene: Scene) -> Any:
    """What the input of ``parameter`` shows: a number in the displayed unit, or the name of a choice."""
    present = value(scene, parameter.path)
    return present if isinstance(present, str) else screen_unit(parameter).to_screen(present)


def options(parameter: Parameter, present: str) -> tuple[str, ...]:
    """What a choice offers: the declared names, and what is there now (a number of spheres)."""
    return parameter.choices if present in parameter.choices else (*parameter.choices, present)


def label(parameter: Parameter) -> str:
    """Title of an input; for the parameter of a component or an effect with its name."""
    kind, *names = parameter.path.split(".")
    if kind in ("body", "effect") and names[1:]:
        return f"{names[0].replace('_', ' ').capitalize()}: {title(parameter).lower()}"
    return title(parameter)


def parameter_input(gui: viser.GuiApi, parameter: Parameter, scene: Scene) -> Any:
    """A box or a list for ``parameter``, at its value in ``scene``."""
    present = on_screen(parameter, scene)
    if parameter.choices:
        offered = options(parameter, present)
        return gui.add_dropdown(label(parameter), offered, initial_value=present, hint=parameter.doc)
    unit = screen_unit(parameter)
    return with_decimals(
        gui.add_number(
            label(parameter),
            present,
            min=unit.to_screen(parameter.low),
            max=unit.to_screen(parameter.high),
            step=SIGNIFICANT_STEP.get(unit.symbol),
            hint=parameter.doc,
        )
    )


def same_value(old: float | str, new: float | str) -> bool:
    """Whether a box that shows six digits was left unchanged."""
    if isinstance(old, str) or isinstance(new, str):
        return old == new
    return abs(old - new) <= 1e-6 * abs(old)
