"""Winding numbers of a closed triangle mesh on a lattice: how often the surface encloses a point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import trimesh

Array = npt.NDArray[np.float64]

# fractional parts of powers of 1/g with g³ = g + 1: the plane's low-discrepancy pair (Roberts 2018)
PLASTIC = 1.32471795724474602596
PITCH = np.array([1.0 / PLASTIC, 1.0 / PLASTIC**2])


def lattice_axes(mesh: trimesh.Trimesh, cells: float, volume: float) -> list[Array]:
    """Three axes of cell centres that fill the bounding box, about ``cells`` of them in ``volume`` [m3].

    Cells are as nearly cubic as whole numbers of them allow.
    """
    low, high = mesh.bounds
    numbers = np.ceil((high - low) * (cells / volume) ** (1.0 / 3.0)).astype(int)
    return [a + (b - a) * (np.arange(n) + 0.5) / n for a, b, n in zip(low, high, numbers, strict=True)]


def winding_numbers(mesh: trimesh.Trimesh, axes: list[Array]) -> npt.NDArray[np.int16]:
    """Winding number at the lattice points (nx, ny, nz) and, as the last of nx + 1 planes, behind the mesh.

    By signed crossings of rays along x: 1 inside a sound mesh, 0 outside, and 0 in the last plane unless rounding let
    a ray slip through an edge. Each facet meets only the rays under its own bounding box. Rays are moved off the
    lattice by an irrational fraction of 1e-6 cells, since a ray through an edge would count two facets or none.
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
    # two bytes a cell: a box around a curled fibre has a hundred million of them
    steps = np.zeros((len(x) + 1, len(y), len(z)), dtype=np.int16)
    # a facet whose normal points to -x lets the ray in
    np.add.at(steps, (np.searchsorted(x, crossing), iy[hit], iz[hit]), -np.sign(doubled[hit]).astype(np.int16))
    return np.cumsum(steps, axis=0, dtype=np.int16, out=steps)


def _cross(a: Array, b: Array) -> Array:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
