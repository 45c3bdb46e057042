"""Points on and in a solid, without random numbers: what clumps are fitted to and measured by."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import trimesh

from solver.shape import Array, Solid, cylinder_axis, mass_properties, principal_extents, surface_mesh

# fractional parts of powers of 1/g with g³ = g + 1: the plane's low-discrepancy pair (Roberts 2018)
PLASTIC = 1.32471795724474602596
PITCH = np.array([1.0 / PLASTIC, 1.0 / PLASTIC**2])
FINE = 5


def surface_points(solid: Solid, count: int) -> tuple[Array, Array]:
    """`count` points on the surface, each standing for the same area, and outward normals there.

    Stratified by cumulative area over the facets, at low-discrepancy places within them. Facets of an
    ellipsoid or cylinder are so fine that a point lies within 3e-4 of the extent below the true surface.

    Returns:
        Points (count, 3) [m] and unit normals (count, 3).
    """
    mesh = surface_mesh(solid, FINE)
    area = np.cumsum(mesh.area_faces)
    face = np.searchsorted(area, (np.arange(count) + 0.5) / count * area[-1])
    u, v = ((np.arange(1, count + 1)[:, None] * PITCH) % 1.0).T
    # folding the square's far half back keeps the density uniform on the triangle
    far = u + v > 1.0
    u, v = np.where(far, 1.0 - u, u), np.where(far, 1.0 - v, v)
    a, b, c = np.moveaxis(mesh.triangles[face], 1, 0)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), mesh.face_normals[face]


def interior_points(solid: Solid, count: int) -> Array:
    """About `count` centres (n, 3) of equal cells inside the solid [m].

    The lattice fills the bounding box. Cells are as nearly cubic as whole numbers of them allow.
    """
    mesh = surface_mesh(solid)
    low, high = mesh.bounds
    cells = np.ceil((high - low) * (count / mass_properties(solid, 1.0).volume) ** (1.0 / 3.0)).astype(int)
    axes = [a + (b - a) * (np.arange(n) + 0.5) / n for a, b, n in zip(low, high, cells, strict=True)]
    if solid.kind == "mesh":
        inside = _inside_mesh(mesh, axes)
    else:
        inside = _inside_closed_form(solid, axes)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)[inside]


def _inside_closed_form(solid: Solid, axes: list[Array]) -> npt.NDArray[np.bool_]:
    reduced = [2.0 * axis / extent for axis, extent in zip(axes, principal_extents(solid), strict=True)]
    x, y, z = np.meshgrid(*reduced, indexing="ij", sparse=True)
    if solid.kind == "box":
        return (np.abs(x) <= 1.0) & (np.abs(y) <= 1.0) & (np.abs(z) <= 1.0)
    if solid.kind == "cylinder":
        along, across, other = (x, y, z) if cylinder_axis(solid) == 0 else (z, x, y)
        return (np.abs(along) <= 1.0) & (across**2 + other**2 <= 1.0)
    return x**2 + y**2 + z**2 <= 1.0


def _inside_mesh(mesh: trimesh.Trimesh, axes: list[Array]) -> npt.NDArray[np.bool_]:
    """Which lattice points (nx, ny, nz) lie inside a closed mesh, by signed crossings of rays along x.

    Each facet meets only the rays under its own bounding box. Rays are moved off the lattice by an irrational
    fraction of 1e-6 cells, since a ray through an edge would count two facets or none.
    """
    x, y, z = axes
    cell = mesh.extents[1:] / [len(y), len(z)]
    corners = mesh.triangles[:, :, 1:] - cell * 1e-6 * PITCH
    first = np.array([y[0], z[0]])
    low = np.maximum(np.ceil((corners.min(axis=1) - first) / cell).astype(int), 0)
    high = np.minimum(np.floor((corners.max(axis=1) - first) / cell).astype(int), [len(y) - 1, len(z) - 1])
    spans = np.maximum(high - low + 1, 0)
    rays = spans.prod(axis=1)
    facet = np.repeat(np.arange(len(corners)), rays)
    place = np.arange(len(facet)) - np.repeat(np.cumsum(rays) - rays, rays)
    iy = low[facet, 0] + place // np.maximum(spans[facet, 1], 1)
    iz = low[facet, 1] + place % np.maximum(spans[facet, 1], 1)
    a, b, c = np.moveaxis(corners[facet], 1, 0)
    point = np.stack([y[iy], z[iz]], axis=1)
    doubled = _cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        v, w = _cross(point - a, c - a) / doubled, _cross(b - a, point - a) / doubled
        hit = (v >= 0.0) & (w >= 0.0) & (v + w <= 1.0)
    depth = mesh.triangles[facet[hit], :, 0]
    v, w = v[hit], w[hit]
    crossing = depth[:, 0] + v * (depth[:, 1] - depth[:, 0]) + w * (depth[:, 2] - depth[:, 0])
    winding = np.zeros((len(x) + 1, len(y), len(z)))
    # a facet whose normal points to -x lets the ray in
    np.add.at(winding, (np.searchsorted(x, crossing), iy[hit], iz[hit]), -np.sign(doubled[hit]))
    return np.cumsum(winding, axis=0)[:-1] > 0.5


def _cross(a: Array, b: Array) -> Array:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
