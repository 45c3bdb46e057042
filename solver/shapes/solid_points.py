"""Points on and in a solid, without random numbers: clumps are fitted to them and measured with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.shapes.mesh_winding import PITCH, lattice_axes, winding_numbers
from solver.shapes.solid import Array, Solid, cylinder_axis, mass_properties, principal_extents, surface_mesh

if TYPE_CHECKING:
    import trimesh

FINE = 5


def surface_points(solid: Solid, count: int) -> tuple[Array, Array]:
    """`count` points on the surface, each standing for the same area, and outward normals there.

    Stratified by cumulative area over the facets, at low-discrepancy places within them. Facets of an
    ellipsoid or cylinder are so fine that a point lies within 3e-4 of the extent below the true surface.

    Returns:
        Points (count, 3) [m] and unit normals (count, 3).
    """
    mesh = surface_mesh(solid, FINE)
    points, facets = points_on(mesh, count)
    return points, mesh.face_normals[facets]


def points_on(mesh: trimesh.Trimesh, count: int) -> tuple[Array, npt.NDArray[np.int64]]:
    """`count` points (count, 3) on a mesh, each standing for the same area, and the facet of each."""
    area = np.cumsum(mesh.area_faces)
    face = np.searchsorted(area, (np.arange(count) + 0.5) / count * area[-1])
    u, v = ((np.arange(1, count + 1)[:, None] * PITCH) % 1.0).T
    # folding the square's far half back keeps the density uniform on the triangle
    far = u + v > 1.0
    u, v = np.where(far, 1.0 - u, u), np.where(far, 1.0 - v, v)
    a, b, c = np.moveaxis(mesh.triangles[face], 1, 0)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), face


def interior_points(solid: Solid, count: int) -> Array:
    """About `count` centres (n, 3) of equal cells inside the solid [m].

    The lattice fills the bounding box. Cells are as nearly cubic as whole numbers of them allow.
    """
    mesh = surface_mesh(solid)
    axes = lattice_axes(mesh, count, mass_properties(solid, 1.0).volume)
    if solid.kind == "mesh":
        inside = winding_numbers(mesh, axes)[:-1] > 0.5
    else:
        inside = _inside_closed_form(solid, axes)
    # Not by a grid of points: of a curled fibre a hundredth of the box is inside.
    return np.stack([axis[k] for axis, k in zip(axes, np.nonzero(inside), strict=True)], axis=1)


def _inside_closed_form(solid: Solid, axes: list[Array]) -> npt.NDArray[np.bool_]:
    reduced = [2.0 * axis / extent for axis, extent in zip(axes, principal_extents(solid), strict=True)]
    x, y, z = np.meshgrid(*reduced, indexing="ij", sparse=True)
    if solid.kind == "box":
        return (np.abs(x) <= 1.0) & (np.abs(y) <= 1.0) & (np.abs(z) <= 1.0)
    if solid.kind == "cylinder":
        along, across, other = (x, y, z) if cylinder_axis(solid) == 0 else (z, x, y)
        return (np.abs(along) <= 1.0) & (across**2 + other**2 <= 1.0)
    return x**2 + y**2 + z**2 <= 1.0
