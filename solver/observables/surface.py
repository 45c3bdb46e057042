"""Top surface of a pile, its height map and the azimuthal mean h(r), and where its mass lies on the plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from solver.pours.record import Pile, Spheres

Array = npt.NDArray[np.float64]

EQUAL = 1e-6
"""Difference of two principal moments, as a share of the largest, up to which they count as equal."""


@dataclass(frozen=True)
class HeightMap:
    """Height of the top surface above the plate on a square grid about a centre; bare plate counts as 0."""

    height: Array
    """[m], shape (n, n)."""
    radius: Array
    """Distance of the pixels from the centre [m], shape (n, n)."""
    pixel: float
    """[m]"""

    @staticmethod
    def of(height: Array, pixel: float) -> HeightMap:
        """The map of ``height`` (n, n) [m] in pixels of ``pixel`` [m], about the middle of the grid."""
        axis = (np.arange(len(height)) + 0.5 - len(height) / 2) * pixel
        return HeightMap(height, np.hypot(axis[:, None], axis[None, :]), pixel)

    def volume(self, within: float) -> float:
        """Volume between plate and surface where r < ``within`` [m]; [m³]."""
        return float(self.height[self.radius < within].sum()) * self.pixel**2


def height_map(spheres: Spheres, centre: Array, half_width: float, pixel: float) -> HeightMap:
    """Top surface of ``spheres`` within ``half_width`` [m] of ``centre`` (x, y) [m] in x and in y.

    The height of a pixel is that of the highest sphere over its centre. Holes under an overhang count as
    filled.
    """
    n = 2 * int(np.ceil(half_width / pixel))
    position = (spheres.centre[:, :2] - centre) / pixel + n / 2
    radius = spheres.radius / pixel
    height = np.zeros(n * n)
    if radius.size:
        offsets = np.arange(int(np.ceil(2.0 * radius.max())) + 1)
        first = np.ceil(position - radius[:, None] - 0.5).astype(np.int64)
        column, row = first[:, 0, None] + offsets, first[:, 1, None] + offsets
        dx2 = (column + 0.5 - position[:, 0, None]) ** 2
        dy2 = (row + 0.5 - position[:, 1, None]) ** 2
        cap2 = (radius**2)[:, None, None] - dx2[:, :, None] - dy2[:, None, :]
        on_grid = ((column >= 0) & (column < n))[:, :, None] & ((row >= 0) & (row < n))[:, None, :]
        sphere, i, j = hit = np.nonzero((cap2 >= 0.0) & on_grid)
        top = spheres.centre[sphere, 2] + pixel * np.sqrt(cap2[hit])
        np.maximum.at(height, column[sphere, i] * n + row[sphere, j], top)
    return HeightMap.of(height.reshape(n, n), pixel)


def coarsened(surface: HeightMap, times: int) -> HeightMap:
    """``surface`` in pixels ``times`` as wide: each is the mean of its known heights, NaN where none is known.

    The number of pixels along an edge must be a multiple of twice ``times``, so that the centre stays a corner.
    """
    n = surface.height.shape[0] // times
    blocks = surface.height.reshape(n, times, n, times)
    known = np.isfinite(blocks)
    number = known.sum(axis=(1, 3))
    total = np.where(known, blocks, 0.0).sum(axis=(1, 3))
    return HeightMap.of(np.where(number > 0, total / np.maximum(number, 1), np.nan), times * surface.pixel)


def radial_profile(surface: HeightMap, ring_width: float, rings: int) -> tuple[Array, Array]:
    """Azimuthal mean of a height map: middle radii of rings [m], mean heights in them [m]; shape (rings,)
    each.

    The map must reach out to ``ring_width`` · ``rings``. A ring in which no pixel has its centre is NaN.
    """
    ring = (surface.radius / ring_width).astype(np.int64).ravel()
    inside = ring < rings
    area = np.bincount(ring[inside], minlength=rings)
    total = np.bincount(ring[inside], weights=surface.height.ravel()[inside], minlength=rings)
    middle: Array = (np.arange(rings, dtype=np.float64) + 0.5) * ring_width
    return middle, np.where(area > 0, total / np.maximum(area, 1), np.nan)


def centre_of_mass(pile: Pile) -> Array:
    """Centre of mass of the pile [m], shape (3,); NaN for an empty pile."""
    if pile.mass.size == 0:
        return np.full(3, np.nan)
    centre: Array = pile.mass @ pile.position / pile.mass.sum()
    return centre


def mass_radii(pile: Pile) -> Array:
    """Distances of the bodies from the pile's centre of mass in the plane of the plate [m], shape (n,)."""
    offset = pile.position[:, :2] - centre_of_mass(pile)[:2]
    return np.hypot(offset[:, 0], offset[:, 1])


def radius_holding(share: float, radius: Array, mass: Array) -> float:
    """Radius [m] that holds ``share`` of ``mass`` [kg], bodies at ``radius`` [m]; shape (n,) each.

    Half of a body's mass counts as inside its own radius; linear between bodies. For equal masses this is
    Hazen's quantile (Hyndman & Fan 1996, definition 5). NaN without bodies.
    """
    if mass.size == 0:
        return float("nan")
    order = np.argsort(radius, kind="stable")
    held = np.cumsum(mass[order]) - 0.5 * mass[order]
    return float(np.interp(share * mass.sum(), held, radius[order]))


def body_thicknesses(pile: Pile) -> Array:
    """Smallest extent of each body along its principal axes [m], shape (n,), at the body's own size.

    Principal axes of the member spheres' centres; a flat body that lies on the plate is this high. Where the two or
    three shortest axes are equal, as those of a square bar or a cube, it is the least extent in any direction among
    them, exact for equal spheres.
    """
    spheres = pile.spheres
    _, body = np.unique(spheres.body, return_inverse=True)
    members = np.bincount(body).astype(np.float64)
    mean = np.stack([np.bincount(body, spheres.centre[:, k]) for k in range(3)], axis=1) / members[:, None]
    offset = spheres.centre - mean[body]
    scatter = np.zeros((members.size, 3, 3))
    np.add.at(scatter, body, offset[:, :, None] * offset[:, None, :])
    moments, axes = np.linalg.eigh(scatter)
    thin_axis = axes[:, :, 0]
    equal = moments - moments[:, :1] <= EQUAL * moments[:, 2:]
    # Balls and rows of spheres are as thick in one direction as in the other.
    for b in np.flatnonzero(equal[:, 1] & (moments[:, 1] > EQUAL * moments[:, 2])):
        free, mine = axes[b][:, equal[b]], body == b
        thin_axis[b] = free @ _narrowest(offset[mine] @ free, spheres.radius[mine])
    along = np.einsum("mk,mk->m", offset, thin_axis[body])
    top, bottom = np.full(members.size, -np.inf), np.full(members.size, np.inf)
    np.maximum.at(top, body, along + spheres.radius)
    np.minimum.at(bottom, body, along - spheres.radius)
    return top - bottom


def _narrowest(centre: Array, radius: Array) -> Array:
    """Unit vector (k,), k = 2 or 3, along which spheres at ``centre`` (n, k) of ``radius`` (n,) have the least extent.

    The width of a convex polytope is least across a face, or between two edges (Houle and Toussaint 1988,
    doi 10.1109/34.6790).
    """
    from scipy.spatial import ConvexHull  # here: few shapes have equal axes, and scipy takes 0.3 s to load

    k, hull = centre.shape[1], ConvexHull(centre)
    ways = hull.equations[:, :k]
    if k == 3:
        edges = np.concatenate([centre[hull.simplices[:, [i, j]]] for i, j in ((0, 1), (1, 2), (2, 0))])
        edges = edges[:, 1] - edges[:, 0]
        across = np.cross(edges[:, None], edges[None]).reshape(-1, 3)
        length = np.linalg.norm(across, axis=1)
        skew = length > EQUAL * length.max()
        ways = np.concatenate([ways, across[skew] / length[skew, None]])
    extent = (centre @ ways.T + radius[:, None]).max(axis=0) - (centre @ ways.T - radius[:, None]).min(axis=0)
    return np.asarray(ways[extent.argmin()])


def body_thickness(pile: Pile) -> float:
    """Median of :func:`body_thicknesses` [m]; NaN for an empty pile."""
    return float(np.median(body_thicknesses(pile))) if pile.mass.size else float("nan")


def grain_thickness(pile: Pile) -> float:
    """Mean of :func:`body_thicknesses` [m], weighted by mass; NaN for an empty pile.

    By mass, because mass fills the pile: by number, the many fines of a mixture would set the scale for a heap of few
    coarse bodies. Bodies of equal mass count equally.
    """
    return float(np.average(body_thicknesses(pile), weights=pile.mass)) if pile.mass.size else float("nan")
