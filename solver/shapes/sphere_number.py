"""The best clump of a given number of spheres, whatever the solid: convex or not, symmetric or not.

The numbers 1, 2, 4, … up to the wanted one are fitted in turn, since each also starts from the one before. Starts are

    rows      of `solver.shapes.sphere_fit`, up to its limit
    cells     means of equal cells of the interior (Lloyd 1982), evenly along a rod, a ring or a bend
    cover     the largest inscribed spheres one after the other, each where it covers most that is not yet covered
    growth    the best of the number before, with spheres added under the surface points that lie furthest off

All are refined by least squares (`solver.shapes.sphere_fit`), and the one of smallest deviation wins, measured both
ways: from the solid's surface to that of the union and back, so that closing the hole of a ring with a sphere does not
pay.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solver.shapes.solid import Solid, surface_mesh
from solver.shapes.solid_points import interior_points, surface_points
from solver.shapes.sphere_fit import FitTarget, Orbits, orbits_of, refine, start_layouts, without_idle
from solver.shapes.sphere_union import Array, distance_to_union, open_points, squared_distances

SURFACE_POINTS, INTERIOR_POINTS = 2000, 30_000
START_POINTS = 6000
MOST_IN_ROWS, LAYOUTS = 32, 4
STEPS = 60
SCORE_POINTS = 200
LEAST_RADIUS = 0.5
"""Smallest member sphere relative to the largest inside the solid; it sets the time step."""


def doubling(number: int) -> list[int]:
    """1, 2, 4, … below ``number``, and ``number``."""
    return [2**k for k in range(number.bit_length()) if 2**k < number] + [number]


def fitted(solid: Solid, numbers: list[int], least_radius: float = LEAST_RADIUS) -> Iterator[tuple[Array, Array]]:
    """Centres (n, 3) and radii (n,) [m] for each of ascending ``numbers`` of spheres; the same bits every time.

    A number may come out smaller if spheres would represent no part of the surface (a second sphere in a ball).
    """
    target = general_target(solid)
    floor = least_radius * target.inscribed_radius
    rows = start_layouts(target, min(max(numbers), MOST_IN_ROWS), floor)
    inside = target.interior[:: max(1, len(target.interior) // START_POINTS)]
    cover = _cover(target, inside, max(numbers), floor)
    before: Orbits | None = None
    for number in numbers:
        starts = list(rows.get(number, [])[:LAYOUTS])
        starts += [_cells(target, inside, number, floor), orbits_of(cover[0][:number], cover[1][:number], False)]
        if before is not None and len(before.radii) < number:
            starts.append(_grown(target, before, number, floor))
        trials = [without_idle(refine(start, target, floor, STEPS), target) for start in starts]
        before = min(trials, key=lambda trial: deviation(target, *trial.spheres()))
        yield before.spheres()


def general_target(solid: Solid) -> FitTarget:
    """What the spheres should follow, without use of mirror planes."""
    surface, normals = surface_points(solid, SURFACE_POINTS)
    bounds = np.array(surface_mesh(solid).bounds)
    return FitTarget(surface, normals, interior_points(solid, INTERIOR_POINTS), bounds, symmetric=False)


def deviation(target: FitTarget, centres: Array, radii: Array) -> float:
    """The larger RMS distance [m], of both ways, between the solid's surface and the union's, to the points' spacing.

    From the union, the distance is that to the tangent plane of the nearest surface point if the point is so close that
    the spacing of points does not resolve it.
    """
    from scipy.spatial import cKDTree

    outward = distance_to_union(target.surface, centres, radii)
    points, owner = open_points(centres, radii, SCORE_POINTS)
    distance, nearest = cKDTree(target.surface).query(points)
    plane = np.abs(((points - target.surface[nearest]) * target.normals[nearest]).sum(axis=1))
    spacing = cKDTree(target.surface).query(target.surface, k=2)[0][:, 1].max()
    back = np.where(distance < 2.0 * spacing, plane, distance)
    area = radii[owner] ** 2
    return float(max(np.sqrt((outward**2).mean()), np.sqrt((area * back**2).sum() / area.sum())))


def _inscribed(target: FitTarget, centres: Array, floor: float) -> Array:
    """Radii of the largest inscribed spheres at ``centres``, within ``floor`` and the largest of all [m]."""
    from scipy.spatial import cKDTree

    return np.clip(cKDTree(target.surface).query(centres)[0], floor, max(floor, target.inscribed_radius))


def _cells(target: FitTarget, inside: Array, number: int, floor: float) -> Orbits:
    """Means of ``number`` cells of the interior; the first ones are the points that lie furthest from each other."""
    from scipy.spatial import cKDTree

    chosen = [int(squared_distances(inside, inside.mean(axis=0)[None])[:, 0].argmax())]
    distance = squared_distances(inside, inside[chosen])[:, 0]
    while len(chosen) < number:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, squared_distances(inside, inside[chosen[-1:]])[:, 0])
    centres = inside[chosen]
    for _ in range(30):
        nearest = cKDTree(centres).query(inside)[1]
        count = np.maximum(np.bincount(nearest, minlength=number), 1)
        centres = np.stack([np.bincount(nearest, inside[:, a], number) / count for a in range(3)], axis=1)
    return orbits_of(centres, _inscribed(target, centres, floor), symmetric=False)


def _cover(target: FitTarget, inside: Array, number: int, floor: float) -> tuple[Array, Array]:
    """Centres and radii of inscribed spheres, ordered by the volume that each adds; none is smaller than the floor."""
    from scipy.spatial import cKDTree

    depth = cKDTree(target.surface).query(inside)[0]
    deep = np.flatnonzero(depth >= min(floor, depth.max()))
    deep = deep[:: max(1, len(deep) // 2000)]
    covers = squared_distances(inside[deep], inside) <= depth[deep, None] ** 2
    uncovered = np.ones(len(inside), dtype=bool)
    chosen: list[int] = []
    for _ in range(number):
        best = int((covers & uncovered).sum(axis=1).argmax())
        uncovered &= ~covers[best]
        chosen.append(int(deep[best]))
    return inside[chosen], np.maximum(depth[chosen], floor)


def _grown(target: FitTarget, before: Orbits, number: int, floor: float) -> Orbits:
    """The spheres of ``before``, and smallest spheres just below the surface points that are furthest from them."""
    centres, radii = before.spheres()
    gap = (np.sqrt(squared_distances(target.surface, centres)) - radii).min(axis=1)
    for _ in range(number - len(radii)):
        worst = int(gap.argmax())
        added = target.surface[worst] - floor * target.normals[worst]
        centres, radii = np.vstack([centres, added]), np.append(radii, floor)
        gap = np.minimum(gap, np.sqrt(squared_distances(target.surface, added[None]))[:, 0] - floor)
    return orbits_of(centres, radii, symmetric=False)
