"""How well member spheres stand for a solid: the statement that goes with every clump."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.shape import Solid, mass_properties, surface_mesh
from solver.solid_points import interior_points, surface_points
from solver.sphere_union import distance_to_union, outer_dimensions, union_volume

Array = npt.NDArray[np.float64]

CHECK_POINTS, CHECK_INTERIOR_POINTS = 4000, 200_000


@dataclass(frozen=True)
class ClumpFit:
    """How well the member spheres stand for the solid.

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


def extent_errors(bounds: Array, centres: Array, radii: Array) -> Array:
    """Outer dimensions (3,) of the union relative to those between ``bounds`` (2, 3), less one."""
    return outer_dimensions(centres, radii) / (bounds[1] - bounds[0]) - 1.0


def measured_fit(solid: Solid, centres: Array, radii: Array) -> ClumpFit:
    """The fit's errors, on other and more points than it was made with."""
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
