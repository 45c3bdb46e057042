"""Geometry of a union of spheres: distance to its surface, volume, outer dimensions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def squared_distances(points: Array, centres: Array) -> Array:
    """Squared distance (m, n) of every point (m, 3) from every centre (n, 3)."""
    dx, dy, dz = (points[:, None, axis] - centres[None, :, axis] for axis in range(3))
    return dx**2 + dy**2 + dz**2


def outer_dimensions(centres: Array, radii: Array) -> Array:
    """Extent (3,) of the union along x, y, z [m]."""
    return (centres + radii[:, None]).max(axis=0) - (centres - radii[:, None]).min(axis=0)


def union_volume(centres: Array, radii: Array) -> float:
    """Volume of a union of spheres [m3], by the divergence theorem over its surface.

    V = 1/3 sum over open surface points p of area * (p . n), on 4000 points per sphere.
    """
    points, owner = open_points(centres, radii, 4000)
    area = 4.0 * np.pi * radii[owner] ** 2 / 4000
    normal = (points - centres[owner]) / radii[owner, None]
    return float((area * (points * normal).sum(axis=1)).sum() / 3.0)


def distance_to_union(points: Array, centres: Array, radii: Array) -> Array:
    """Distance (m,) of points (m, 3) to the surface of a union of spheres [m].

    Exact outside, and inside where the nearest place is radially outward from a centre; elsewhere inside (the
    nearest place is a groove between spheres) to the spacing, r / 18, of points spread over the surface.
    """
    from scipy.spatial import cKDTree

    distance = np.sqrt(squared_distances(points, centres))
    gap = (distance - radii).min(axis=1)
    inside = np.flatnonzero(gap < 0.0)
    result = np.abs(gap)
    nearest_open = cKDTree(open_points(centres, radii, 4000)[0]).query(points[inside])[0]
    for k, (centre, radius) in enumerate(zip(centres, radii, strict=True)):
        length = np.maximum(distance[inside, k], 1e-12)
        radial = centre + (points[inside] - centre) * (radius / length)[:, None]
        is_open = (squared_distances(radial, np.delete(centres, k, 0)) >= np.delete(radii, k) ** 2).all(axis=1)
        own = is_open & (length < radius)
        nearest_open[own] = np.minimum(nearest_open[own], (radius - length)[own])
    result[inside] = nearest_open
    return result


def open_points(centres: Array, radii: Array, count: int) -> tuple[Array, npt.NDArray[np.int64]]:
    """Those of `count` points on each sphere that lie in no other sphere, and their sphere's index.

    Points (n, 3) [m] follow a golden spiral (Swinbank and Purser 2006), each standing for 4 pi r² / count.
    """
    k = np.arange(count) + 0.5
    height, angle = 1.0 - 2.0 * k / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - height**2)
    directions = np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)
    points = (centres[:, None] + radii[:, None, None] * directions).reshape(-1, 3)
    owner = np.repeat(np.arange(len(radii)), count)
    covered = squared_distances(points, centres) < radii**2
    covered[np.arange(len(points)), owner] = False
    is_open = ~covered.any(axis=1)
    return points[is_open], owner[is_open]
