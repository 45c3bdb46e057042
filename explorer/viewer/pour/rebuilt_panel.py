"""Panels that are built from a scene's parameters, and rebuilt for a scene with different ones."""

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
    """Reserves the place of controls on the page; :meth:`build` makes the controls for a scene."""

    def __init__(self, page: PageContext) -> None:
        self._page, scene = page, page.session.status().scene
        # A folder without a title is only a placeholder that keeps its position among its neighbours.
        self._place = page.server.gui.add_folder(None)
        self._layout: object = None
        self._contents: viser.GuiFolderHandle | None = None
        self._controls = self.controls(scene)

    def build(self, scene: Scene) -> Controls:
        """Make the controls for ``scene``."""
        raise NotImplementedError

    def controls(self, scene: Scene) -> Controls:
        """Controls for ``scene``: the present ones if they fit, otherwise new ones in their place."""
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
        """Follow the solver, with new controls if the scene requires them."""
        self.controls(now.status.scene).show(now.status)


def layout(scene: Scene) -> tuple[object, ...]:
    """What the controls depend on: declarations of the parameters, the rig, and which body is of which material."""
    bodies = tuple((body.name, body.material) for body in scene.bodies)
    return scene.rig.name, bodies, tuple(parameters(scene).items())
