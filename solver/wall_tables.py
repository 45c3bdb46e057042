"""Surfaces of a rig as flat tables: the form in which the arrays of a batch take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from solver.insertion import rotation_matrix
from solver.mesh_wall import MeshWall, mesh_wall
from solver.rigs.surface import Revolved, Surface, TriangleMesh

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]

PLANE, REVOLVED, PATCH = 0, 1, 2
"""``state.SURFACE`` shapes."""


@dataclass(frozen=True)
class WallTables:
    """k walls, p surfaces (primitives first, then the patches of the meshes), n triangles."""

    poses: Array
    """origin, quaternion; shape (k, 7)."""
    grids: Array
    """lower corner and cell edge, 0 for a primitive; shape (k, 4)."""
    cells: Ints
    """cells along each axis and where they begin; shape (k, 4)."""
    geometry: Array
    """r0, z0, r1, z1 of a revolved segment; shape (p, 4)."""
    surfaces: Ints
    """shape and wall; shape (p, 2)."""
    primitives: int
    corners: Array
    """shape (n, 9)."""
    guards: Array
    """shape (n, 9)."""
    triangles: Ints
    """surface, duties of edges (3) and of corners (3); shape (n, 7)."""
    first: Ints
    """Where the triangles of a cell begin, shape (cells + 1,)."""
    items: Ints


@lru_cache(maxsize=32)
def wall_tables(surfaces: tuple[Surface, ...]) -> WallTables:
    """Arrange ``surfaces``; wall k of the arrays is ``surfaces[k]``."""
    primitives = [k for k, surface in enumerate(surfaces) if not isinstance(surface, TriangleMesh)]
    geometry = [_segment(surfaces[k]) for k in primitives]
    rows = [(REVOLVED if isinstance(surfaces[k], Revolved) else PLANE, k) for k in primitives]
    grids, cells = np.zeros((len(surfaces), 4)), np.zeros((len(surfaces), 4), dtype=np.int32)
    meshes: list[MeshWall] = []
    offsets: list[int] = []
    cell_count = triangle_count = item_count = 0
    first, items = [np.zeros(0, dtype=np.int32)], [np.zeros(0, dtype=np.int32)]
    for k, surface in enumerate(surfaces):
        if not isinstance(surface, TriangleMesh):
            continue
        mesh = mesh_wall(surface)
        grids[k], cells[k] = (*mesh.low, mesh.cell), (*mesh.cells, cell_count)
        # Where one mesh's cells end and the next one's begin, the ends meet.
        first.append(mesh.first[:-1] + item_count)
        items.append(mesh.items + triangle_count)
        cell_count += len(mesh.first) - 1
        triangle_count += len(mesh.patch)
        item_count += len(mesh.items)
        offsets.append(len(rows))
        patches = int(mesh.patch.max()) + 1
        rows += [(PATCH, k)] * patches
        geometry += [(0.0, 0.0, 0.0, 0.0)] * patches
        meshes.append(mesh)
    marks = [_marks(mesh, start) for mesh, start in zip(meshes, offsets, strict=True)]
    return WallTables(
        poses=np.array([[*surface.pose.origin, *surface.pose.quaternion] for surface in surfaces], dtype=float),
        grids=grids,
        cells=cells,
        geometry=np.array(geometry, dtype=float).reshape(-1, 4),
        surfaces=np.array(rows, dtype=np.int32).reshape(-1, 2),
        primitives=len(primitives),
        corners=_joined([mesh.corners for mesh in meshes], 9),
        guards=_joined([mesh.guards for mesh in meshes], 9),
        triangles=_joined(marks, 7).astype(np.int32),
        first=np.concatenate([*first, [item_count]]).astype(np.int32),
        items=np.concatenate(items).astype(np.int32),
    )


def extent(surface: Surface, angular_velocity: Sequence[float], domain: float) -> float:
    """Distance [m] from its origin of the furthest point that ``angular_velocity`` displaces; ``domain``: of a plane.

    A surface that turns about its own axis of symmetry stays where it is.
    """
    omega = np.array(angular_velocity, dtype=float)
    axis = rotation_matrix(np.array(surface.pose.quaternion)) @ np.array([0.0, 0.0, 1.0])
    if not isinstance(surface, TriangleMesh) and np.linalg.norm(np.cross(omega, axis)) <= 1e-12 * np.linalg.norm(omega):
        return 0.0
    if isinstance(surface, TriangleMesh):
        return float(np.linalg.norm(np.array(surface.vertices), axis=1).max())
    if isinstance(surface, Revolved):
        return max(float(np.hypot(surface.r0, surface.z0)), float(np.hypot(surface.r1, surface.z1)))
    return 4.0 * domain


def _segment(surface: Surface) -> tuple[float, float, float, float]:
    if isinstance(surface, Revolved):
        return surface.r0, surface.z0, surface.r1, surface.z1
    return 0.0, 0.0, 0.0, 0.0


def _marks(mesh: MeshWall, start: int) -> Ints:
    return np.column_stack([mesh.patch + start, mesh.edges, mesh.vertex_duty]).astype(np.int32)


def _joined(tables: Sequence[npt.NDArray[Any]], width: int) -> Array:
    return np.concatenate([np.zeros((0, width)), *tables]).astype(float)
