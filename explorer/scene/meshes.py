"""Triangles to draw: the true shapes of bodies in their own frame, and the rig. Needs NumPy and trimesh only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import trimesh

from solver.rigs import Plane, Revolved, Rig, Surface, TriangleMesh
from solver.scenes.body import Body, Members
from solver.scenes.insertion import rotation_matrix
from solver.scenes.scene import Scene, pour_rig
from solver.shapes.solid import surface_mesh

SIDES = 96
"""Corners of the polygon that represents a circle."""
PLATE_NAME = "plate"
"""The surface that bodies pile up on."""
GATE_NAME = "gate"
"""The surface that exists only until the rig acts."""
PLATE_OVERHANG = 2.0
"""Radius at which the infinite plate is drawn, as a multiple of the largest radius of the rest of the rig."""
BARE_SQUARE = np.array([(-0.05, -0.05, -0.05), (0.05, 0.05, 0.05)])
"""Extent to which planes are drawn if there is nothing else [m]."""

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Triangles:
    """A surface: corners [m], shape (n, 3), unit normals at them, and faces as indices, shape (m, 3)."""

    vertices: npt.NDArray[np.float32]
    normals: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]


def body_triangles(body: Body) -> Triangles:
    """The true shape in the principal frame of the body; its member spheres if nothing else declares the shape."""
    if isinstance(body.shape, Members):
        if body.shape.drawn is not None:
            return _faceted(surface_mesh(body.shape.drawn))
        clump = body.clump
        spheres = [trimesh.creation.icosphere(subdivisions=2, radius=radius) for radius in clump.radii]
        for sphere, centre in zip(spheres, clump.centres, strict=True):
            sphere.apply_translation(centre)
        return _smooth(cast(trimesh.Trimesh, trimesh.util.concatenate(spheres)))
    mesh = surface_mesh(body.shape)
    return _smooth(mesh) if body.shape.kind in ("ellipsoid", "sphere") else _faceted(mesh)


def rig_triangles(rig: Rig) -> dict[str, Triangles]:
    """The surfaces of ``rig`` by name, each in its own frame; :func:`rig_poses` gives these frames in the world."""
    surfaces = rig.surfaces()
    corners = [_in_world(surface, _finite(surface).vertices) for surface in surfaces if not isinstance(surface, Plane)]
    reach = np.concatenate(corners) if corners else BARE_SQUARE
    return {
        name: _plane(surface, name, reach) if isinstance(surface, Plane) else _finite(surface)
        for name, surface in zip(rig.surface_names, surfaces, strict=True)
    }


def rig_poses(rig: Rig) -> Array:
    """Poses of the surfaces of ``rig`` before it acts, in order: origin [m] and orientation wxyz, shape (k, 7)."""
    return np.array([(*surface.pose.origin, *surface.pose.quaternion) for surface in rig.surfaces()])


def rim_circles(rig: Rig) -> dict[str, list[tuple[float, float]]]:
    """Open ends of the shells of revolution by name: (radius, height) [m] of their circles, each in its own frame."""
    return {
        name: [(surface.r0, surface.z0), (surface.r1, surface.z1)]
        for name, surface in zip(rig.surface_names, rig.surfaces(), strict=True)
        if isinstance(surface, Revolved) and surface.z0 != surface.z1
    }


def scene_height(scene: Scene) -> float:
    """Top of the rig and of the feed above it [m]."""
    poses, meshes = rig_poses(scene.rig), rig_triangles(scene.rig)
    tops = [
        float(_in_world(surface, meshes[name].vertices)[:, 2].max())
        for name, surface in zip(scene.rig.surface_names, scene.rig.surfaces(), strict=True)
        if not isinstance(surface, Plane)
    ]
    feed = pour_rig(scene).feed()
    return max(*tops, min(feed.floor + scene.insertion.region_height, feed.ceiling), float(poses[:, 2].max()))


def outlet_height(rig: Rig) -> float:
    """Height of the lowest rim of a shell before ``rig`` acts [m]; 0 if there is none. What it feeds lies below."""
    rims = rim_circles(rig)
    rings = [
        _in_world(surface, np.array([(r, 0.0, z), (-r, 0.0, z), (0.0, r, z), (0.0, -r, z)]))[:, 2].min()
        for name, surface in zip(rig.surface_names, rig.surfaces(), strict=True)
        for r, z in rims.get(name, ())
    ]
    return float(min(rings, default=0.0))


def _in_world(surface: Surface, points: npt.NDArray[Any]) -> Array:
    turn = rotation_matrix(np.array(surface.pose.quaternion))
    placed: Array = points @ turn.T + np.array(surface.pose.origin)
    return placed


def _plane(plane: Plane, name: str, reach: Array) -> Triangles:
    """The infinite ``plane``: a disc about the z axis if it is the plate, else a rectangle beside ``reach`` (n, 3)."""
    if name == PLATE_NAME:
        radius = PLATE_OVERHANG * float(np.hypot(reach[:, 0], reach[:, 1]).max())
        return _revolved(Revolved(0.0, 0.0, radius, 0.0, plane.material))
    turn = rotation_matrix(np.array(plane.pose.quaternion))
    seen = (reach - np.array(plane.pose.origin)) @ turn
    (x0, y0), (x1, y1) = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    corners = np.array([(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)])
    return _triangles(corners, np.tile([0.0, 0.0, 1.0], (4, 1)), np.array([(0, 1, 2), (0, 2, 3)]))


def _finite(surface: Revolved | TriangleMesh) -> Triangles:
    if isinstance(surface, Revolved):
        return _revolved(surface)
    return _faceted(trimesh.Trimesh(np.array(surface.vertices), np.array(surface.faces), process=False))


def _revolved(surface: Revolved) -> Triangles:
    """Two circles and the strip between them; normals perpendicular to the profile line, towards the axis or upward."""
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(SIDES)], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    low, high = surface.r0 * circle + surface.z0 * up, surface.r1 * circle + surface.z1 * up
    along = np.array([surface.r1 - surface.r0, surface.z1 - surface.z0])
    radial, axial = np.array([-along[1], along[0]]) / np.hypot(*along)
    normals = radial * circle + axial * up
    k = np.arange(SIDES)
    following = (k + 1) % SIDES
    faces = np.concatenate(
        [
            np.stack([k, k + SIDES, following], axis=1),
            np.stack([following, k + SIDES, following + SIDES], axis=1),
        ]
    )
    return _triangles(np.concatenate([low, high]), np.concatenate([normals, normals]), faces)


def _smooth(mesh: trimesh.Trimesh) -> Triangles:
    return _triangles(mesh.vertices, mesh.vertex_normals, mesh.faces)


def _faceted(mesh: trimesh.Trimesh) -> Triangles:
    """Every face with corners of its own, so that edges stay sharp."""
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    return _triangles(corners, np.repeat(mesh.face_normals, 3, axis=0), np.arange(len(corners)).reshape(-1, 3))


def _triangles(
    vertices: npt.NDArray[np.float64], normals: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]
) -> Triangles:
    return Triangles(
        np.asarray(vertices, dtype=np.float32),
        np.asarray(normals, dtype=np.float32),
        np.asarray(faces, dtype=np.uint32),
    )
