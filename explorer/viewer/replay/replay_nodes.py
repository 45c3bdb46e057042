"""A recording in 3-D: the bodies and surfaces that are in the file, in its own meshes and colours."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import viser

from explorer.live.frames import Frame
from explorer.logs.recording import Recording
from explorer.viewer.body_nodes import BodyNodes, Kind
from explorer.viewer.scene_nodes import drawn, seen_through


class ReplayNodes:
    """Nodes of one recording."""

    def __init__(self, server: viser.ViserServer, recording: Recording) -> None:
        self.bodies = BodyNodes(server, [Kind(c.shape, c.shape.colour, c.most) for c in recording.components])
        self._surfaces = [
            (
                surface,
                server.scene.add_mesh_simple(
                    f"/rig/{surface.shape.name}",
                    surface.shape.vertices,
                    surface.shape.faces,
                    color=surface.shape.colour,
                    opacity=surface.shape.opacity if surface.shape.opacity < 1.0 else None,
                    **drawn(surface.shape.name),
                ),
            )
            for surface in recording.surfaces
        ]

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_] | None = None) -> None:
        """Draw the state of ``frame``; ``seen`` says which bodies are drawn. Call it inside ``server.atomic()``."""
        self.bodies.show(frame, seen)
        for surface, node in self._surfaces:
            node.visible = surface.seen_at(frame.time)
            pose = surface.pose_at(frame.time)
            if pose is not None:
                node.position, node.wxyz = pose[:3], pose[3:]

    def fade(self, opacity: float) -> None:
        """Opacity of the surfaces that one has to look through."""
        for surface, node in self._surfaces:
            if seen_through(surface.shape.name):
                node.opacity = opacity


def highest(recording: Recording) -> float:
    """Height of the rig [m], or of the bodies where there is none but a plate."""
    tops = [float(s.shape.vertices[:, 2].max()) for s in recording.surfaces]
    tops += [float(f.position[:, 2].max()) for c in recording.components for f in c.frames if len(f.scale)]
    return max(float(np.max(tops)), 1e-3)
