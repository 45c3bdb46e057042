"""The pour in 3-D: bodies as batched meshes (one node per component), funnel, gate and plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from explorer.live.frames import Frame
from explorer.scene.meshes import GATE_NAME, PLATE_NAME, body_triangles, rig_poses, rig_triangles, rim_circles
from explorer.viewer.palette import BODY_COLOURS, GLASS, PLATE, RIM, RING, Colour, linear
from solver.scene import Scene, body_counts

Array = npt.NDArray[np.float64]

RING_SPACING = 0.05
"""Circles on the plate, a scale for the eye [m]."""
PLATE_RADIUS = 0.2
"""Radius of the disc that stands for the infinite plate [m]."""
CORNERS = 72
"""Corners of such a circle."""
LINE = 8e-4
"""Thickness of lines [m]."""
CLEAR, OPACITY = 0.16, {GATE_NAME: 0.5}
"""Opacity of what one has to look through: all surfaces but the plate."""


FINE = 2000
"""Bodies up to which each is drawn with all its faces, however far it is."""


@dataclass(frozen=True)
class Poses:
    """Instances of one component as viser wants them; bodies that are not in the scene have scale 0."""

    position: npt.NDArray[np.float32]
    """[m], shape (n, 3)."""
    quaternion: npt.NDArray[np.float32]
    """wxyz, shape (n, 4)."""
    scale: npt.NDArray[np.float32]
    """Size of a body relative to its mesh, or 0, shape (n,)."""


class SceneNodes:
    """Nodes of one scene, below the node ``root``; :meth:`show` moves the bodies and the surfaces of the rig."""

    def __init__(self, server: viser.ViserServer, scene: Scene, root: str = "") -> None:
        self._numbers = body_counts(scene)
        self._bodies: list[Any] = []
        self.meshes = [body_triangles(body) for body in scene.bodies]
        """Surface of a body of each component, in its own frame."""
        for k, (mesh, n) in enumerate(zip(self.meshes, self._numbers, strict=True)):
            none = nowhere(n)
            self._bodies.append(
                server.scene.add_batched_meshes_simple(
                    f"{root}/bodies/{k}",
                    mesh.vertices,
                    mesh.faces,
                    batched_wxyzs=none.quaternion,
                    batched_positions=none.position,
                    batched_scales=none.scale,
                    batched_colors=plain_colours(k, n),
                    lod="off" if n <= FINE else "auto",
                )
                if n > 0
                else None
            )
        self._rig = rig_nodes(server, scene, root)
        self._surface_names, self._at_first = scene.rig.surface_names, rig_poses(scene.rig)
        self._surfaces = self._at_first

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_] | None = None) -> None:
        """Move bodies and surfaces to where ``frame`` has them; call it inside ``server.atomic()``.

        ``seen`` says which bodies are drawn, shape (n,); by default all that are in the domain.
        """
        self._show_surfaces(frame.surfaces)
        for k, (node, n) in enumerate(zip(self._bodies, self._numbers, strict=True)):
            if node is not None:
                _place(node, component_poses(frame, k, n, seen))

    def paint(self, frame: Frame, colours: npt.NDArray[np.uint8]) -> None:
        """Give the bodies of ``frame`` their ``colours`` (n, 3), those of batched meshes (``palette.linear``)."""
        for k, (node, n) in enumerate(zip(self._bodies, self._numbers, strict=True)):
            if node is not None:
                chosen = np.flatnonzero(frame.component == k)[:n]
                painted = plain_colours(k, n)
                painted[: len(chosen)] = colours[chosen]
                node.batched_colors = painted

    def fade(self, bodies: float | None, rig: float) -> None:
        """Opacity of the bodies (None: opaque), and of the surfaces of the rig that one has to look through."""
        for node in self._bodies:
            if node is not None:
                node.opacity = bodies
        for name in self._surface_names:
            if name != PLATE_NAME and name not in OPACITY:
                self._rig[name].opacity = rig

    def clear(self) -> None:
        """Hide all bodies, surfaces where they were: a new pour has not begun to fall yet."""
        self._show_surfaces(self._at_first)
        for node, n in zip(self._bodies, self._numbers, strict=True):
            if node is not None:
                _place(node, nowhere(n))

    def _show_surfaces(self, poses: Array) -> None:
        """Move those surfaces whose pose has changed; ``poses`` as in ``rig_poses``, or empty where none is known."""
        if poses.shape != self._surfaces.shape:
            return
        for name, pose, before in zip(self._surface_names, poses, self._surfaces, strict=True):
            if not np.array_equal(pose, before):
                self._rig[name].position, self._rig[name].wxyz = pose[:3], pose[3:]
        self._surfaces = poses

    def show_gate(self, shut: bool) -> None:
        """Draw the gate or not, if the rig has one."""
        if GATE_NAME in self._rig:
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


def component_poses(frame: Frame, component: int, n: int, seen: npt.NDArray[np.bool_] | None = None) -> Poses:
    """Poses of the bodies of one component, ``n`` of which will enter in all, in order of entry.

    Those that are not ``seen``, shape (bodies of the frame,), are hidden; by default those that have left the domain.
    """
    seen = frame.inside if seen is None else seen
    poses = nowhere(n)
    chosen = np.flatnonzero(frame.component == component)[:n]
    poses.position[: len(chosen)] = frame.position[chosen]
    poses.quaternion[: len(chosen)] = frame.quaternion[chosen]
    poses.scale[: len(chosen)] = np.where(seen[chosen], frame.scale[chosen], 0.0)
    return poses


def nowhere(n: int) -> Poses:
    """``n`` hidden instances."""
    quaternion = np.zeros((n, 4), dtype=np.float32)
    quaternion[:, 0] = 1.0
    return Poses(np.zeros((n, 3), dtype=np.float32), quaternion, np.zeros(n, dtype=np.float32))


def plain_colours(k: int, n: int) -> npt.NDArray[np.uint8]:
    """Colours of ``n`` bodies of component ``k`` as batched meshes want them, shape (n, 3)."""
    return np.tile(np.array(linear(component_colour(k)), dtype=np.uint8), (n, 1))


def component_colour(k: int) -> Colour:
    """Colour of component ``k``."""
    return BODY_COLOURS[k % len(BODY_COLOURS)]


def drawn(name: str) -> dict[str, Any]:
    """How a surface of the rig is drawn.

    The plate fills much of the picture; without a graphics card it would take more time than all the rest. So only its
    upper side is drawn, evenly lit.
    """
    if name == PLATE_NAME:
        return {"side": "front", "material": "toon3", "cast_shadow": False, "receive_shadow": True}
    return {"side": "double", "cast_shadow": False, "receive_shadow": False}


def rig_nodes(server: viser.ViserServer, scene: Scene, root: str = "") -> dict[str, Any]:
    """Nodes of the rig by name: its surfaces with the rims of shells, and circles on the plate as a scale."""
    nodes: dict[str, Any] = {}
    poses, rims = rig_poses(scene.rig), rim_circles(scene.rig)
    for (name, mesh), pose in zip(rig_triangles(scene.rig).items(), poses, strict=True):
        clear = name != PLATE_NAME
        widened = 1.0 if clear else PLATE_RADIUS / float(np.hypot(*mesh.vertices[:, :2].T).max())
        nodes[name] = server.scene.add_mesh_simple(
            f"{root}/rig/{name}",
            mesh.vertices,
            mesh.faces,
            scale=(widened, widened, 1.0),
            color=GLASS if clear else PLATE,
            opacity=OPACITY.get(name, CLEAR) if clear else None,
            **drawn(name),
            visible=name != GATE_NAME,
            position=pose[:3],
            wxyz=pose[3:],
        )
        if name in rims:
            ends = np.concatenate([circle(radius, height) for radius, height in rims[name]])
            # Below the surface's node: it moves, and goes, with that.
            server.scene.add_line_segments(f"{root}/rig/{name}/rims", ends, RIM, thickness=LINE)
    return nodes | (_scale(server, root) if PLATE_NAME in nodes else {})


def _scale(server: viser.ViserServer, root: str) -> dict[str, Any]:
    radii = np.arange(RING_SPACING, PLATE_RADIUS + 1e-9, RING_SPACING)
    # Above the plate by the lines' thickness, so that they are not lost in it.
    rings = np.concatenate([circle(radius, LINE) for radius in radii])
    return {"scale": server.scene.add_line_segments(f"{root}/rig/scale", rings, RING, thickness=LINE)}


def circle(radius: float, height: float) -> Array:
    """A horizontal circle about the z axis as line segments [m], shape (CORNERS, 2, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(CORNERS + 1, height)])
    return np.stack([points[:-1], points[1:]], axis=1)
