"""A recording in 3-D: the bodies and surfaces that are in the file, in its own meshes and colours."""

from __future__ import annotations

from typing import Any

import numpy as np
import viser

from explorer.logs.recording import Component, Recording
from explorer.viewer.palette import linear
from explorer.viewer.scene_nodes import Poses, drawn, nowhere


class ReplayNodes:
    """Nodes of one recording; :meth:`show` moves them to a time."""

    def __init__(self, server: viser.ViserServer, recording: Recording) -> None:
        self._components = [(c, self._batch(server, k, c)) for k, c in enumerate(recording.components)]
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

    @staticmethod
    def _batch(server: viser.ViserServer, k: int, component: Component) -> Any:
        none = nowhere(component.most)
        return server.scene.add_batched_meshes_simple(
            f"/bodies/{k}",
            component.shape.vertices,
            component.shape.faces,
            batched_wxyzs=none.quaternion,
            batched_positions=none.position,
            batched_scales=none.scale,
            batched_colors=linear(component.shape.colour),
            lod="off",
        )

    def show(self, time: float) -> None:
        """Draw the state at ``time`` [s]; call it inside ``server.atomic()``."""
        for component, node in self._components:
            poses = poses_at(component, time)
            node.batched_positions = poses.position
            node.batched_wxyzs = poses.quaternion
            node.batched_scales = poses.scale
        for surface, node in self._surfaces:
            node.visible = surface.seen_at(time)
            pose = surface.pose_at(time)
            if pose is not None:
                node.position, node.wxyz = pose[:3], pose[3:]


def poses_at(component: Component, time: float) -> Poses:
    """The bodies of a component at ``time`` [s], the places of absent ones hidden by scale 0."""
    poses, there = nowhere(component.most), component.at(time)
    if there is not None:
        n = len(there.scale)
        poses.position[:n], poses.quaternion[:n], poses.scale[:n] = there.position, there.quaternion, there.scale
    return poses


def highest(recording: Recording) -> float:
    """Height of the rig [m], or of the bodies where there is none but a plate."""
    tops = [float(s.shape.vertices[:, 2].max()) for s in recording.surfaces]
    tops += [float(f.position[:, 2].max()) for c in recording.components for f in c.frames if len(f.scale)]
    return max(float(np.max(tops)), 1e-3)
