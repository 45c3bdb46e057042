"""How well member spheres represent a solid: distance of the surfaces, volume, and mass of the spheres themselves.

:class:`ClumpFit` is the statement that goes with every clump, :class:`SphereError` the errors of the spheres in detail.
Mass and inertia of the spheres are only shown: a body moves with those of the true solid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.shapes.solid import Solid, mass_properties, surface_mesh
from solver.shapes.solid_points import FINE, interior_points, points_on, surface_points
from solver.shapes.sphere_union import distance_to_union, open_points, outer_dimensions, union_volume

Array = npt.NDArray[np.float64]

CHECK_POINTS, CHECK_INTERIOR_POINTS = 4000, 200_000
POINTS = 20_000
"""Points on the union's surface, before those inside other spheres are left out."""
LOOKED_AT = 16
"""Number of nearest surface points whose facets are tried for the nearest place on a mesh."""


@dataclass(frozen=True)
class ClumpFit:
    """How well the member spheres represent the solid.

    Args:
        n_spheres: number of member spheres.
        volume_ratio: volume of the union of spheres / volume of the solid.
        covered_ratio: volume of the union within the solid / volume of the solid.
        surface_rms: RMS over the solid's surface (by area) of the distance to the union's surface [m].
        surface_max: largest such distance [m].
        extent_errors: (x, y, z) outer dimension of the union / that of the solid - 1.
        smallest_radius: radius of the smallest member sphere [m].
    """

    n_spheres: int
    volume_ratio: float
    covered_ratio: float
    surface_rms: float
    surface_max: float
    extent_errors: tuple[float, float, float]
    smallest_radius: float


@dataclass(frozen=True, eq=False)
class SphereError:
    """How far a union of spheres is from the solid that it represents.

    Args:
        number: number of spheres.
        rms: larger of the two RMS distances [m], from the mesh to the union's surface and from the union's to the mesh.
        largest: largest distance either way [m] (Hausdorff).
        covered: share of the solid's volume that lies in the spheres.
        volume: volume of the union, overlaps counted once [m3].
        second: integrals of y² + z², z² + x², x² + y² over the union about the solid's centre of mass [m5]: times a
            density, the moments of inertia of the union.
        smallest_radius: radius of the smallest member sphere [m].
    """

    number: int
    rms: float
    largest: float
    covered: float
    volume: float
    second: Array
    smallest_radius: float


def extent_errors(bounds: Array, centres: Array, radii: Array) -> Array:
    """Outer dimensions (3,) of the union relative to those between ``bounds`` (2, 3), less one."""
    return outer_dimensions(centres, radii) / (bounds[1] - bounds[0]) - 1.0


def measured_fit(solid: Solid, centres: Array, radii: Array) -> ClumpFit:
    """The errors of a fit, on other and more points than those it was made with."""
    deviation = distance_to_union(surface_points(solid, CHECK_POINTS)[0], centres, radii)
    inside = interior_points(solid, CHECK_INTERIOR_POINTS)
    covered = np.any([((inside - c) ** 2).sum(axis=1) <= r**2 for c, r in zip(centres, radii, strict=True)], axis=0)
    errors = extent_errors(np.array(surface_mesh(solid).bounds), centres, radii)
    return ClumpFit(
        n_spheres=len(radii),
        volume_ratio=float(union_volume(centres, radii) / mass_properties(solid, 1.0).volume),
        covered_ratio=float(covered.mean()),
        surface_rms=float(np.sqrt((deviation**2).mean())),
        surface_max=float(deviation.max()),
        extent_errors=(float(errors[0]), float(errors[1]), float(errors[2])),
        smallest_radius=float(radii.min()),
    )


def sphere_error(solid: Solid, centres: Array, radii: Array) -> SphereError:
    """The errors of spheres (n, 3), (n,) in the solid's principal frame [m]."""
    fit = measured_fit(solid, centres, radii)
    points, owner = open_points(centres, radii, max(200, POINTS // len(radii)))
    area = radii[owner] ** 2
    back = distance_to_mesh(solid, points)
    # the place furthest from the spheres is often a corner, where no sampled point lies
    vertices = surface_mesh(solid).vertices
    corners = np.asarray(vertices[:: 1 + len(vertices) // POINTS])
    volume, second = union_moments(centres, radii)
    return SphereError(
        number=len(radii),
        rms=max(fit.surface_rms, float(np.sqrt((area * back**2).sum() / area.sum()))),
        largest=max(fit.surface_max, float(back.max()), float(distance_to_union(corners, centres, radii).max())),
        covered=fit.covered_ratio,
        volume=volume,
        second=second,
        smallest_radius=fit.smallest_radius,
    )


def distance_to_mesh(solid: Solid, points: Array) -> Array:
    """Distance (m,) of points (m, 3) from the solid's surface [m].

    Exact to the nearest of the facets that carry the nearest of 30 000 surface points.
    """
    import trimesh
    from scipy.spatial import cKDTree

    mesh = surface_mesh(solid, FINE)
    places, facets = points_on(mesh, 30_000)
    nearest = cKDTree(places).query(points, k=LOOKED_AT)[1]
    # trimesh compares products of four lengths with an absolute tolerance: facets must be about 1 in size
    unit = np.sqrt(mesh.area / len(mesh.faces))
    corners, seen = mesh.triangles / unit, points / unit
    distance = np.full(len(points), np.inf)
    for column in nearest.T:
        foot = trimesh.triangles.closest_point(corners[facets[column]], seen)  # type: ignore[no-untyped-call]
        distance = np.minimum(distance, unit * np.linalg.norm(foot - seen, axis=1))
    return distance


def union_moments(centres: Array, radii: Array) -> tuple[float, Array]:
    """Volume [m3] and second moments ∫ (y² + z²), … dV (3,) [m5] of a union of spheres about the origin.

    By the divergence theorem over its surface, V = 1/3 ∮ x·n dA and ∫ x² dV = 1/3 ∮ x³ n_x dA.
    """
    count = max(200, 20 * POINTS // len(radii))
    points, owner = open_points(centres, radii, count)
    area = 4.0 * np.pi * radii[owner, None] ** 2 / count
    normal = (points - centres[owner]) / radii[owner, None]
    squares = (area * points**3 * normal).sum(axis=0) / 3.0
    return float((area * points * normal).sum() / 3.0), squares.sum() - squares
