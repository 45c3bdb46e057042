"""Bodies of a world and surfaces of its rig as flat tables, in the layout of a batch's arrays.

A triangle mesh becomes smooth patches, duties (which patch responds at an edge), and a grid to find triangles. Faces
that share an edge at less than ``SMOOTH_ANGLE`` form a patch, and a sphere has one contact with a patch, at the patch's
nearest point, so it rolls on a finely meshed plane as on the plane itself. Two patches that meet in an edge would both
push there; only one of them has the duty to respond, and not where the neighbour's face is nearer.
Idea: faces before edges before corners (Hu, Hu & Song 2013, Powder Technology 246:516).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from solver.rigs.surface import Revolved, Surface, TriangleMesh
from solver.scenes.body import Body
from solver.scenes.insertion import rotation_matrix
from solver.scenes.scene import Scene

if TYPE_CHECKING:
    import trimesh

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]

SMOOTH_ANGLE = math.radians(5.0)
"""Largest angle between the normals of neighbouring faces that act as one surface."""
TRIANGLES_PER_CELL = 2.0
"""Triangles per cell that the surface crosses, about: the grid has √(triangles / this) cells along its longest axis."""
MAX_CELLS = 64
"""Largest length of the grid [cells]; a point at its very end is in one cell more."""
KEEP, LEAVE, SEE_GUARD = 0, 1, 2
"""Duties at an edge, as in ``state.TRIANGLE``."""
PLANE, REVOLVED, PATCH = 0, 1, 2
"""``state.SURFACE`` shapes."""


@dataclass(frozen=True)
class BodyTables:
    """Bodies of one world in order of entry, in the layout of the arrays (n bodies, m member spheres)."""

    numbers: Array
    """mass, inertia (3), reach, and the result of :func:`outline` (5); shape (n, 10)."""
    places: Ints
    """first member, number of members, contact class; shape (n, 3)."""
    spheres: Array
    """local centre (3) and radius; shape (m, 4)."""
    owner: Ints
    """Body of each member; shape (m, 1)."""
    scale: Array
    """Linear size of each body relative to the declared one; shape (n,)."""


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


def body_tables(scene: Scene, order: Ints, scale: Array | None = None) -> BodyTables:
    """Tables of the bodies of a world; ``order`` contains the component of each (index into ``scene.bodies``).

    Bodies are in order of entry. ``scale`` (n,) is the linear size s of each body, by default 1: spheres and reach
    scale with s, mass with s³, inertia with s⁵.
    """
    scale = np.ones(len(order)) if scale is None else scale
    clumps = [body.clump for body in scene.bodies]
    sizes = np.array([len(clumps[k].radii) for k in order], dtype=np.int32)
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int32)
    each = [
        [clump.mass, *clump.inertia, clump.bounding_radius, *outline(body)]
        for clump, body in zip(clumps, scene.bodies, strict=True)
    ]
    numbers = np.array([each[k] for k in order])
    numbers *= scale[:, None] ** np.array([3, 5, 5, 5, 1, 1, 1, 1, 1, 0])
    spheres = np.concatenate([np.column_stack([clumps[k].centres, clumps[k].radii]) for k in order])
    spheres *= np.repeat(scale, sizes)[:, None]
    owner = np.repeat(np.arange(len(order), dtype=np.int32), sizes)[:, None]
    places = np.column_stack([first, sizes, order]).astype(np.int32)
    return BodyTables(numbers, places, np.ascontiguousarray(spheres), np.ascontiguousarray(owner), scale)


def outline(body: Body) -> tuple[float, ...]:
    """Data for air drag: semi-axes (3) [m], diameter of the sphere of the same volume [m], sphericity φ.

    The surface is that of the ellipsoid with the body's outer dimensions, within 1.1 % (K. Thomsen 2004):
    4π (((ab)ᵖ + (ac)ᵖ + (bc)ᵖ)/3)^(1/p), p = 1.6075. The projected area of a convex body is a quarter of its surface
    on average (Cauchy), 1/φ times that of the sphere of its volume; the semi-axes are √φ times the body's own, so that
    the mean projected area is the sphere's.
    """
    a, b, c = (extent / 2.0 for extent in body.extents)
    diameter = (6.0 * body.mass / (math.pi * body.density)) ** (1.0 / 3.0)
    p = 1.6075
    surface = 4.0 * math.pi * (((a * b) ** p + (a * c) ** p + (b * c) ** p) / 3.0) ** (1.0 / p)
    sphericity = math.pi * diameter**2 / surface
    shown = math.sqrt(sphericity)
    # By this formula, a body fuller than the ellipsoid may have less surface than a sphere of its volume.
    return shown * a, shown * b, shown * c, diameter, min(1.0, sphericity)


@lru_cache(maxsize=32)
def wall_tables(surfaces: tuple[Surface, ...]) -> WallTables:
    """Tables of ``surfaces``; wall k of the arrays is ``surfaces[k]``."""
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
        # The end of a mesh's last cell is the beginning of the next mesh's first cell, so it is stored once.
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


def extent(surface: Surface, angular_velocity: Sequence[float], domain: float) -> float:
    """Distance [m] from the origin to the furthest point that ``angular_velocity`` displaces; ``domain`` for a plane.

    A surface that rotates about its own axis of symmetry is not displaced: the distance is zero.
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


def _patches(mesh: trimesh.Trimesh) -> Ints:
    """Number of the smooth patch of each face; it does not depend on how the faces are wound."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n, pairs = len(mesh.faces), mesh.face_adjacency
    ends = mesh.vertices[mesh.face_adjacency_edges]
    centres = mesh.triangles.mean(axis=1)
    one, two = _away(ends, centres[pairs[:, 0]]), _away(ends, centres[pairs[:, 1]])
    # In a flat sheet, the directions from the shared edge into the two faces are opposite.
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
    """Index of the edge (ab, bc, ca) of ``face`` that joins the vertices ``ends``."""
    return next(k for k in range(3) if {int(face[k]), int(face[(k + 1) % 3])} == {int(ends[0]), int(ends[1])})


def _away(ends: Array, centre: Array) -> Array:
    """Unit vectors (…, 3) perpendicular to the lines through ``ends`` (…, 2, 3), towards ``centre`` (…, 3)."""
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
    """Grid over the bounding boxes of the triangles (n, 3, 3): lower corner, cell edge, counts, starts and contents."""
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
