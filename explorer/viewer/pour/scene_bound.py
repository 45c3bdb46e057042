"""Panels that are made from a scene's parameters, and made anew for a scene that has others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

import viser

from solver.scene import Scene, parameters

Panel = TypeVar("Panel")


class SceneBound(Generic[Panel]):
    """Holds the place of a panel on the page; ``build`` makes it for a scene."""

    def __init__(self, server: viser.ViserServer, build: Callable[[Scene], Panel], scene: Scene) -> None:
        self._server, self._build = server, build
        # Without a title a folder is no more than a place that keeps its order among its neighbours.
        self._place = server.gui.add_folder(None)
        self._layout: Any = None
        self._contents: viser.GuiFolderHandle | None = None
        self._panel = self.panel(scene)

    def panel(self, scene: Scene) -> Panel:
        """The panel for ``scene``: the present one where it fits, otherwise a new one in its place."""
        wanted = layout(scene)
        if wanted == self._layout:
            return self._panel
        if self._contents is not None:
            self._contents.remove()
        with self._place:
            self._contents = self._server.gui.add_folder(None)
            with self._contents:
                self._panel = self._build(scene)
        self._layout = wanted
        return self._panel


def layout(scene: Scene) -> tuple[object, ...]:
    """What panels are made from: declarations of the parameters, rig, and which bodies are of which material."""
    bodies = tuple((body.name, body.material) for body in scene.bodies)
    return scene.rig.name, bodies, tuple(parameters(scene).items())
