"""Panels that are made from a scene's parameters, and made anew for a scene that has others."""

from __future__ import annotations

from typing import Generic, Protocol, TypeVar

import viser

from explorer.live.messages import Status
from explorer.viewer.panel import Now, PageContext, Panel
from solver.scenes.scene import Scene, parameters


class SceneControls(Protocol):
    """Controls for the parameters of one scene."""

    def show(self, status: Status) -> None:
        """Follow the solver; called inside ``server.atomic()``."""


Controls = TypeVar("Controls", bound=SceneControls)


class RebuiltPanel(Panel, Generic[Controls]):
    """Holds the place of controls on the page; :meth:`build` makes them for a scene."""

    def __init__(self, page: PageContext) -> None:
        self._page, scene = page, page.session.status().scene
        # Without a title a folder is no more than a place that keeps its order among its neighbours.
        self._place = page.server.gui.add_folder(None)
        self._layout: object = None
        self._contents: viser.GuiFolderHandle | None = None
        self._controls = self.controls(scene)

    def build(self, scene: Scene) -> Controls:
        """Make the controls for ``scene``."""
        raise NotImplementedError

    def controls(self, scene: Scene) -> Controls:
        """Those for ``scene``: the present ones where they fit, otherwise new ones in their place."""
        wanted = layout(scene)
        if wanted == self._layout:
            return self._controls
        if self._contents is not None:
            self._contents.remove()
        with self._place:
            self._contents = self._page.server.gui.add_folder(None)
            with self._contents:
                self._controls = self.build(scene)
        self._layout = wanted
        return self._controls

    def show(self, now: Now) -> None:
        """Follow the solver, with other controls where the scene asks for them."""
        self.controls(now.status.scene).show(now.status)


def layout(scene: Scene) -> tuple[object, ...]:
    """What panels are made from: declarations of the parameters, rig, and which bodies are of which material."""
    bodies = tuple((body.name, body.material) for body in scene.bodies)
    return scene.rig.name, bodies, tuple(parameters(scene).items())
