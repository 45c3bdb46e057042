"""A triangle mesh as the solver wants it: smooth patches, who answers at an edge, and a grid to find triangles.

Faces that share an edge at less than ``SMOOTH_ANGLE`` form a patch, and a sphere has one contact with a patch, at the
patch's nearest point: rolling over a finely meshed plane is rolling on a plane. Two patches that meet in an edge would
both push there; the duty at the edge is given to one of them, and to neither where the neighbour's face is nearer.
Idea: faces before edges before corners (Hu, Hu & Song 2013, Powder Technology 246:516).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.rigs.surface import TriangleMesh

if TYPE_CHECKING:
    import trimesh

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]

SMOOTH_ANGLE = math.radians(5.0)
"""Largest angle between the normals of neighbouring faces that act as one surface."""
TRIANGLES_PER_CELL = 2.0
"""The grid has about one cell for this many triangles along each of its two directions of the surface."""
MAX_CELLS = 64
"""Most cells of the grid along an axis."""
KEEP, LEAVE, SEE_GUARD = 0, 1, 2
"""Duties at an edge, as in ``state.TRIANGLE``."""


@dataclass(frozen=True)
class MeshWall:
    """Tables of one mesh, n triangles ordered by patch."""

    corners: Array
    """a, b, c in the local frame [m], shape (n, 9)."""
    patch: Ints
    """Patch of each triangle, ascending from 0, shape (n,)."""
    edges: Ints
    """Duty at ab, bc, ca, shape (n, 3)."""
    guards: Array
    """Per edge: unit vector in the neighbour's plane, away from the edge, shape (n, 9)."""
    vertex_duty: Ints
    """Duty at a, b, c, shape (n, 3)."""
    low: Array
    """Lower corner of the grid [m], shape (3,)."""
    cell: float
    """Edge of its cells [m]."""
    cells: tuple[int, int, int]
    first: Ints
    """Where the triangles of each cell begin in ``items``, and the end; shape (cells + 1,)."""
    items: Ints
    """Triangles of the cells."""


def mesh_wall(surface: TriangleMesh) -> MeshWall:
    """Tables of ``surface``."""
    import trimesh

    mesh = trimesh.Trimesh(np.array(surface.vertices), np.array(surface.faces), process=False)
    patch = _patches(mesh)
    order = np.argsort(patch, kind="stable")
    mesh = trimesh.Trimesh(mesh.vertices, mesh.faces[order], process=False)
    patch = patch[order].astype(np.int32)
    edges, guards = _edge_duties(mesh, patch)
    corners = np.ascontiguousarray(mesh.triangles.reshape(-1, 9))
    low, cell, cells, first, items = _grid(mesh.triangles)
    return MeshWall(corners, patch, edges, guards, _vertex_duties(mesh, patch), low, cell, cells, first, items)


def _patches(mesh: trimesh.Trimesh) -> Ints:
    """Number of the smooth patch of each face, whichever way the faces are wound."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n, pairs = len(mesh.faces), mesh.face_adjacency
    ends = mesh.vertices[mesh.face_adjacency_edges]
    centres = mesh.triangles.mean(axis=1)
    one, two = _away(ends, centres[pairs[:, 0]]), _away(ends, centres[pairs[:, 1]])
    # Two halves of a flat sheet lead away from their edge in opposite directions.
    smooth = pairs[-(one * two).sum(axis=1) > math.cos(SMOOTH_ANGLE)]
    links = coo_matrix((np.ones(len(smooth)), (smooth[:, 0], smooth[:, 1])), shape=(n, n))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.int32)


def _edge_duties(mesh: trimesh.Trimesh, patch: Ints) -> tuple[Ints, Array]:
    duties = np.zeros((len(mesh.faces), 3), dtype=np.int32)
    guards = np.zeros((len(mesh.faces), 9))
    for (one, two), ends in zip(mesh.face_adjacency, mesh.face_adjacency_edges, strict=True):
        if patch[one] == patch[two]:
            continue
        owner, other = (one, two) if patch[one] < patch[two] else (two, one)
        duties[other, _edge_of(mesh.faces[other], ends)] = LEAVE
        edge = _edge_of(mesh.faces[owner], ends)
        duties[owner, edge] = SEE_GUARD
        guards[owner, 3 * edge : 3 * edge + 3] = _away(mesh.vertices[ends], mesh.triangles[other].mean(axis=0))
    return duties, guards


def _edge_of(face: npt.NDArray[np.int64], ends: npt.NDArray[np.int64]) -> int:
    """Which of ab, bc, ca of ``face`` joins the vertices ``ends``."""
    return next(k for k in range(3) if {int(face[k]), int(face[(k + 1) % 3])} == {int(ends[0]), int(ends[1])})


def _away(ends: Array, centre: Array) -> Array:
    """Unit vectors (…, 3) at right angles from the lines through ``ends`` (…, 2, 3) towards ``centre`` (…, 3)."""
    along = ends[..., 1, :] - ends[..., 0, :]
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    gap = centre - ends[..., 0, :]
    across = gap - (gap * along).sum(axis=-1, keepdims=True) * along
    return np.asarray(across / np.linalg.norm(across, axis=-1, keepdims=True))


def _vertex_duties(mesh: trimesh.Trimesh, patch: Ints) -> Ints:
    """A corner that several patches share belongs to the first of them."""
    first = np.full(len(mesh.vertices), np.iinfo(np.int32).max, dtype=np.int32)
    np.minimum.at(first, mesh.faces.ravel(), np.repeat(patch, 3))
    return np.where(first[mesh.faces] == patch[:, None], KEEP, LEAVE).astype(np.int32)


def _grid(triangles: Array) -> tuple[Array, float, tuple[int, int, int], Ints, Ints]:
    """Cells over the bounding boxes of the triangles (n, 3, 3): lower corner, edge, counts, starts and contents."""
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    span = float((high - low).max())
    cell = span / max(1.0, min(float(MAX_CELLS), math.sqrt(len(triangles) / TRIANGLES_PER_CELL)))
    counts = np.floor((high - low) / cell).astype(int) + 1
    begin = np.floor((triangles.min(axis=1) - low) / cell).astype(int)
    end = np.minimum(np.floor((triangles.max(axis=1) - low) / cell).astype(int), counts - 1)
    contents: list[list[int]] = [[] for _ in range(int(np.prod(counts)))]
    for t, (a, b) in enumerate(zip(begin, end, strict=True)):
        for x in range(a[0], b[0] + 1):
            for y in range(a[1], b[1] + 1):
                for z in range(a[2], b[2] + 1):
                    contents[(x * counts[1] + y) * counts[2] + z].append(t)
    first = np.concatenate([[0], np.cumsum([len(items) for items in contents])]).astype(np.int32)
    items = np.array([t for items in contents for t in items], dtype=np.int32)
    return low, cell, (int(counts[0]), int(counts[1]), int(counts[2])), first, items
