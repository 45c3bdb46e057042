"""The pour in 3-D: bodies as batched meshes (one node per component), funnel, gate and plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from explorer.live.frames import Frame
from explorer.scene_meshes import GATE_NAME, body_triangles, rig_triangles
from explorer.viewer.palette import BODY_COLOURS, GLASS, PLATE, RIM, RING, Colour, linear
from solver.body import counts
from solver.scene import Scene

Array = npt.NDArray[np.float64]

RING_SPACING = 0.05
"""Circles on the plate, a scale for the eye [m]."""
PLATE_RADIUS = 0.2
"""Radius of the disc that stands for the infinite plate [m]."""
CORNERS = 72
"""Corners of such a circle."""
LINE = 8e-4
"""Thickness of lines [m]."""
CLEAR = {"cone": 0.16, "gate": 0.5}
"""Opacity of what one has to look through."""


@dataclass(frozen=True)
class Poses:
    """Instances of one component as viser wants them; bodies that are not in the scene have scale 0."""

    position: npt.NDArray[np.float32]
    """[m], shape (n, 3)."""
    quaternion: npt.NDArray[np.float32]
    """wxyz, shape (n, 4)."""
    scale: npt.NDArray[np.float32]
    """1 or 0, shape (n,)."""


class SceneNodes:
    """Nodes of one scene; :meth:`show` moves the bodies."""

    def __init__(self, server: viser.ViserServer, scene: Scene) -> None:
        self._numbers = counts(scene.bodies, scene.rig.mass)
        self._bodies: list[Any] = []
        for k, (body, n) in enumerate(zip(scene.bodies, self._numbers, strict=True)):
            mesh, none = body_triangles(body), nowhere(n)
            self._bodies.append(
                server.scene.add_batched_meshes_simple(
                    f"/bodies/{k}",
                    mesh.vertices,
                    mesh.faces,
                    batched_wxyzs=none.quaternion,
                    batched_positions=none.position,
                    batched_scales=none.scale,
                    batched_colors=linear(component_colour(k)),
                    lod="off",
                )
                if n > 0
                else None
            )
        self._rig = rig_nodes(server, scene)

    def show(self, frame: Frame) -> None:
        """Move the bodies to where ``frame`` has them; call it inside ``server.atomic()``."""
        for k, (node, n) in enumerate(zip(self._bodies, self._numbers, strict=True)):
            if node is not None:
                _place(node, component_poses(frame, k, n))

    def clear(self) -> None:
        """Hide all bodies: a new pour has not begun to fall yet."""
        for node, n in zip(self._bodies, self._numbers, strict=True):
            if node is not None:
                _place(node, nowhere(n))

    def show_gate(self, shut: bool) -> None:
        """Draw the gate or not."""
        self._rig[GATE_NAME].visible = shut

    def remove(self) -> None:
        """Take all nodes off the page."""
        for node in (*self._bodies, *self._rig.values()):
            if node is not None:
                node.remove()


def _place(node: Any, poses: Poses) -> None:
    node.batched_positions = poses.position
    node.batched_wxyzs = poses.quaternion
    node.batched_scales = poses.scale


def component_poses(frame: Frame, component: int, n: int) -> Poses:
    """Poses of the bodies of one component, ``n`` of which will enter in all, in order of entry."""
    poses = nowhere(n)
    chosen = np.flatnonzero(frame.component == component)[:n]
    poses.position[: len(chosen)] = frame.position[chosen]
    poses.quaternion[: len(chosen)] = frame.quaternion[chosen]
    poses.scale[: len(chosen)] = frame.inside[chosen]
    return poses


def nowhere(n: int) -> Poses:
    """``n`` hidden instances."""
    quaternion = np.zeros((n, 4), dtype=np.float32)
    quaternion[:, 0] = 1.0
    return Poses(np.zeros((n, 3), dtype=np.float32), quaternion, np.zeros(n, dtype=np.float32))


def component_colour(k: int) -> Colour:
    """Colour of component ``k``."""
    return BODY_COLOURS[k % len(BODY_COLOURS)]


def rig_nodes(server: viser.ViserServer, scene: Scene) -> dict[str, Any]:
    """Nodes of the rig by name: its surfaces, the rims of the funnel, circles on the plate as a scale."""
    nodes: dict[str, Any] = {}
    for name, mesh in rig_triangles(scene.rig).items():
        clear = name in CLEAR
        widened = PLATE_RADIUS / float(np.hypot(*mesh.vertices[:, :2].T).max()) if name == "plate" else 1.0
        nodes[name] = server.scene.add_mesh_simple(
            f"/rig/{name}",
            mesh.vertices,
            mesh.faces,
            scale=(widened, widened, 1.0),
            color=GLASS if clear else PLATE,
            opacity=CLEAR.get(name),
            side="double",
            cast_shadow=False,
            receive_shadow=not clear,
            visible=name != GATE_NAME,
        )
    return nodes | _circles(server, scene)


def _circles(server: viser.ViserServer, scene: Scene) -> dict[str, Any]:
    rig = scene.rig
    ends = ((rig.outlet_diameter, rig.outlet_height), (rig.inlet_diameter, rig.inlet_height))
    rims = np.concatenate([circle(diameter / 2.0, height) for diameter, height in ends])
    radii = np.arange(RING_SPACING, PLATE_RADIUS + 1e-9, RING_SPACING)
    # Above the plate by the lines' thickness, so that they are not lost in it.
    rings = np.concatenate([circle(radius, LINE) for radius in radii])
    return {
        "rims": server.scene.add_line_segments("/rig/rims", rims, RIM, thickness=LINE),
        "scale": server.scene.add_line_segments("/rig/scale", rings, RING, thickness=LINE),
    }


def circle(radius: float, height: float) -> Array:
    """A horizontal circle about the z axis as line segments [m], shape (CORNERS, 2, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(CORNERS + 1, height)])
    return np.stack([points[:-1], points[1:]], axis=1)
