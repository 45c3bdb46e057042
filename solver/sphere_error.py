"""What a clump gets wrong about its solid: distance of the surfaces, volume, and the mass of the spheres themselves.

The spheres' mass and inertia are shown only: a body moves with those of the true solid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.clump_fit import measured_fit
from solver.shape import Solid, surface_mesh
from solver.solid_points import FINE, points_on
from solver.sphere_union import distance_to_union, open_points

Array = npt.NDArray[np.float64]

POINTS = 20_000
"""Points on the union's surface, before those inside other spheres are left out."""
LOOKED_AT = 16
"""Surface points whose facets are tried for the nearest place on a mesh."""


@dataclass(frozen=True, eq=False)
class SphereError:
    """How far a union of spheres is from the solid that it stands for.

    Args:
        number: of spheres.
        rms: larger of the two RMS distances [m], over the mesh to the union's surface and over the union's to the mesh.
        largest: largest distance either way [m] (Hausdorff).
        covered: share of the solid's volume that lies in the spheres.
        volume: of the union, overlaps counted once [m3].
        second: integrals of y² + z², z² + x², x² + y² over the union about the solid's centre of mass [m5]: times a
            density, the moments of inertia of the union.
        smallest_radius: [m].
    """

    number: int
    rms: float
    largest: float
    covered: float
    volume: float
    second: Array
    smallest_radius: float


def sphere_error(solid: Solid, centres: Array, radii: Array) -> SphereError:
    """The errors of spheres (n, 3), (n,) in the solid's principal frame [m]."""
    fit = measured_fit(solid, centres, radii)
    points, owner = open_points(centres, radii, max(200, POINTS // len(radii)))
    area = radii[owner] ** 2
    back = distance_to_mesh(solid, points)
    # what is furthest from the spheres is often a corner, where no sampled point lies
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
