"""Parameters that act on the running pour: choose materials or pairs, move sliders, read the solver's values.

Controls are made from the declarations of live parameters: one control moves one parameter of one or many things
(``live_sliders.py``). One parameter of all pairs is a matrix (``pair_matrix.py``).
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Any

import viser

from explorer.live.messages import Status
from explorer.live.session import Session
from explorer.units import quantity, title
from explorer.viewer.actions import Post
from explorer.viewer.panel import SET_UP
from explorer.viewer.pour.live_sliders import (
    LiveControl,
    control_for,
)
from explorer.viewer.pour.pair_matrix import PairMatrix, pair_parameters
from explorer.viewer.pour.rebuilt_panel import RebuiltPanel
from solver.effects import EFFECTS, SetUpEffect
from solver.params import Parameter
from solver.scenes.scene import Scene, parameters, value

Targets = dict[str, tuple[str, ...]]
"""Text of a choice → prefixes of its parameter paths."""


class LivePanel(RebuiltPanel["LiveSections"]):
    """What acts on the running pour."""

    name, tab = "live", SET_UP

    def build(self, scene: Scene) -> LiveSections:
        """Make the sections for ``scene``."""
        return LiveSections(self._page.server, self._page.session, scene, self._page.post)


class LiveSections:
    """One section per kind of thing that has live parameters (materials, pairs of materials)."""

    def __init__(self, server: viser.ViserServer, session: Session, scene: Scene, post: Post) -> None:
        self._sections = [
            _Section(server, session, scene, post, "Pair", pair_targets(scene)),
            _Section(server, session, scene, post, "Material", material_targets(scene)),
            _Section(server, session, scene, post, "Effect", effect_targets()),
        ]
        self._matrices = [
            PairMatrix(server.gui, scene, name, post, session.set_parameters) for name in pair_parameters()
        ]

    def show(self, status: Status) -> None:
        """Follow the solver's values; call it inside ``server.atomic()``."""
        for section in self._sections:
            section.show(status.scene)
        for matrix in self._matrices:
            matrix.follow(status.scene)


class _Section:
    def __init__(
        self,
        server: viser.ViserServer,
        session: Session,
        scene: Scene,
        post: Post,
        name: str,
        targets: Targets,
    ):
        self._server, self._session, self._post, self._targets = server, session, post, targets
        self._folder = server.gui.add_folder(f"{name} (acts now)")
        with self._folder:
            self._chooser = server.gui.add_dropdown(name, tuple(targets))
            self._echo = server.gui.add_html("")
        self._live: list[LiveControl] = []
        self._build(scene, next(iter(targets)))

        @self._chooser.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            chosen = event.target.value
            if event.client_id is not None and chosen in targets:
                post(lambda: self._build(session.status().scene, chosen))

    def _build(self, scene: Scene, chosen: str) -> None:
        """Make controls for the live parameters of the choice, in place of the former ones."""
        for control in self._live:
            control.remove()
        self._chosen = chosen
        with self._folder:
            self._live = [
                control_for(scene, paths)(
                    self._server.gui, parameter, paths, scene, self._post, self._session.set_parameters
                )
                for parameter, paths in live_parameters(scene, self._targets[chosen])
            ]

    def show(self, scene: Scene) -> None:
        if not all(control.fits(scene) for control in self._live):
            self._build(scene, self._chosen)
        for control in self._live:
            control.follow(scene)
        echo = echo_html(scene, self._targets[self._chosen])
        if self._echo.content != echo:
            self._echo.content = echo


def live_parameters(scene: Scene, prefixes: tuple[str, ...]) -> Iterator[tuple[Parameter, tuple[str, ...]]]:
    """Declarations of the live parameters under the first prefix, each with its paths under all ``prefixes``."""
    for path, parameter in parameters(scene).items():
        prefix, _, name = path.rpartition(".")
        if parameter.live and prefix == prefixes[0]:
            yield parameter, tuple(f"{one}.{name}" for one in prefixes)


def material_targets(scene: Scene) -> Targets:
    """Choices of materials: those of all bodies together (not the wall), then each one."""
    bodies = tuple(dict.fromkeys(f"material.{body.material}" for body in scene.bodies))
    return {"all bodies": bodies} | {m.name: (f"material.{m.name}",) for m in scene.materials}


def pair_targets(scene: Scene) -> Targets:
    """Choices of pairs: all together, then each one."""
    prefixes = {f"{pair.a} – {pair.b}": (f"pair.{pair.a}.{pair.b}",) for pair in scene.pairs}
    return {"all pairs": tuple(one for (one,) in prefixes.values())} | prefixes


def effect_targets() -> Targets:
    """Choices of effects that act on a running pile; all are off until an amplitude is moved from zero."""
    acting = (kind for kind in EFFECTS.values() if not issubclass(kind, SetUpEffect))
    return {kind.name: (f"effect.{kind.name}",) for kind in acting}


def echo_html(scene: Scene, prefixes: tuple[str, ...]) -> str:
    """What the solver has in force for a choice: one line per live parameter, a range where values differ."""
    lines = []
    for parameter, paths in live_parameters(scene, prefixes):
        values = sorted({float(value(scene, path)) for path in paths})
        texts = dict.fromkeys(quantity(number, parameter.unit) for number in (values[0], values[-1]))
        name = escape(title(parameter).split(" [")[0])
        lines.append(f"<span style='opacity:0.65'>{name}</span> {' … '.join(texts)}")
    text = " &nbsp; ".join(lines)
    return f"<div style='padding:0 0.75em; font-size:0.8em'>In the solver: {text}</div>"
