"""The former pile, grey and half transparent, when a standing pile is poured again with other parameters."""

from __future__ import annotations

from dataclasses import dataclass

import viser

from explorer.live.frames import Frame
from explorer.scene.meshes import body_triangles
from explorer.viewer.palette import Colour
from explorer.viewer.scene_nodes import BodyNodes, DrawnComponent
from solver import Scene, body_counts
from solver.scenes.scene import actual

COLOUR: Colour = (170, 178, 186)
OPACITY = 0.28
ROOT = "/ghost"


@dataclass(frozen=True)
class Rest:
    """A pile as it came to rest."""

    scene: Scene
    generation: int
    time: float
    frame: Frame
    angle: float
    """[°]; NaN if there is none."""


class Ghost:
    """The pile that stood before this pour; ``former`` is None if none is drawn."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._nodes: BodyNodes | None = None
        self.former: Rest | None = None

    def leave(self, rest: Rest, frame: Frame) -> None:
        """Draw ``rest`` as last seen, in ``frame``, in place of an earlier ghost."""
        self.take_away()
        poured = actual(rest.scene)
        kinds = zip(poured.bodies, body_counts(poured), strict=True)
        self._nodes = BodyNodes(
            self._server, [DrawnComponent(body_triangles(body), COLOUR, most) for body, most in kinds], ROOT
        )
        self._nodes.fade(OPACITY)
        self._nodes.show(frame)
        self.former = rest

    def take_away(self) -> None:
        """Remove the ghost from the page."""
        if self._nodes is not None:
            self._nodes.remove()
        self._nodes = self.former = None
