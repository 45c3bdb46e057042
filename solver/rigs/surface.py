"""Surfaces that rigs are made of: planes, straight lines turned about an axis, and triangle meshes, in any pose.

A pose turns a surface's local z axis into a direction of the world; ``FACING_…`` are the quaternions (wxyz) of planes
that face along an axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from solver.params import ParameterError

Point = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

HALF = math.sqrt(0.5)
FACING_PLUS_Y: Quaternion = (HALF, -HALF, 0.0, 0.0)
"""A quarter turn about −x: local z becomes +y."""
FACING_MINUS_Y: Quaternion = (HALF, HALF, 0.0, 0.0)
"""A quarter turn about +x: local z becomes −y."""
FACING_DOWN: Quaternion = (0.0, 1.0, 0.0, 0.0)
"""Half a turn about x: local z becomes −z."""


@dataclass(frozen=True)
class SurfacePose:
    """Where a surface is: its local frame's origin [m] and orientation (unit quaternion wxyz) in the world."""

    origin: Point = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Plane:
    """The local plane z = 0; bodies are on the side of +z."""

    material: str
    pose: SurfacePose = SurfacePose()


@dataclass(frozen=True)
class Revolved:
    """The segment (r0, z0)–(r1, z1) [m] turned about local z: a cone, a cylinder (r0 = r1) or a disc (z0 = z1).

    A thin shell that pushes from either side; its two edge circles (an outlet's rim) act as edges.
    """

    r0: float
    z0: float
    r1: float
    z1: float
    material: str
    pose: SurfacePose = SurfacePose()


@dataclass(frozen=True)
class TriangleMesh:
    """A thin shell of triangles that pushes from either side; vertices [m] (n, 3), faces as indices (m, 3).

    Faces that share an edge and meet at less than ``mesh_wall.SMOOTH_ANGLE`` act as one smooth surface.
    """

    vertices: tuple[Point, ...]
    faces: tuple[tuple[int, int, int], ...]
    material: str
    pose: SurfacePose = SurfacePose()


Surface = Plane | Revolved | TriangleMesh


def horizontal(height: float, material: str) -> Plane:
    """The plane z = ``height`` [m]."""
    return Plane(material, SurfacePose((0.0, 0.0, height)))


def turned_plane(origin: Point, quaternion: Quaternion, material: str) -> Plane:
    """A plane through ``origin`` [m] with the bodies on the side of its turned local +z."""
    return Plane(material, SurfacePose(origin, quaternion))


def rectangle(corner: Point, edge_a: Point, edge_b: Point, material: str) -> TriangleMesh:
    """The parallelogram at ``corner`` that ``edge_a`` and ``edge_b`` [m] span, as two triangles."""
    start, a, b = (np.array(x, dtype=float) for x in (corner, edge_a, edge_b))
    corners = (start, start + a, start + a + b, start + b)
    vertices = tuple((float(x), float(y), float(z)) for x, y, z in corners)
    return TriangleMesh(vertices, ((0, 1, 2), (0, 2, 3)), material)


def load_mesh(path: Path, material: str, metres_per_unit: float, pose: SurfacePose = SurfacePose()) -> TriangleMesh:
    """A wall from a file that trimesh reads (STL, OBJ, PLY, GLB); parts of a scene are joined, equal vertices merged.

    Raises ParameterError for a file that cannot be read, and for one without a triangle of positive area.
    """
    import trimesh

    try:
        mesh = cast(trimesh.Trimesh, trimesh.load(path, force="mesh"))
    except Exception as error:  # trimesh passes on whatever its readers raise
        raise ParameterError(f"{path}: cannot be read as a triangle mesh: {error}") from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise ParameterError(f"{path}: holds no triangles")
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces(height=1e-12) & mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
        raise ParameterError(f"{path}: holds no triangle of positive area and finite size")
    vertices = tuple((float(x), float(y), float(z)) for x, y, z in mesh.vertices * metres_per_unit)
    faces = tuple((int(a), int(b), int(c)) for a, b, c in mesh.faces)
    return TriangleMesh(vertices, faces, material, pose)
