"""Least-squares placement of spheres whose union follows a surface.

Residuals are the signed gaps between surface points p and the union, min over spheres of |p - c| - r,
together with a stiff penalty on outer dimensions beyond a tolerance. Each residual depends on one sphere, so
that the Jacobian is analytic and sparse; the steps are those of Levenberg (1944) and Marquardt (1963).

Where the solid is mirror-symmetric in the three coordinate planes, the unknowns are one sphere per orbit, and
surface points are folded into one octant: the clump is symmetric to the last bit and rests as the solid does.

A fit starts from rows of spheres (:func:`start_layouts`), tried by ascending number.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import numpy.typing as npt

from solver.shapes.sphere_union import Array, squared_distances

# outer dimensions may differ by this fraction before the penalty sets in; the accepted limit is 2 %
EXTENT_TOLERANCE = 0.01
# weight of one unit of excess extent against the RMS gap
EXTENT_WEIGHT = 3.0
# spheres more or fewer in every other row: staggered rows on plates, short outer rows on seeds
STAGGERS = (0, 1, -1, -2, -3, 2, 3)
# one in this many interior points is enough to place a start
THINNING = 7
# layouts for one number of spheres: a plate has 13, a crooked body would have many more
MOST_PER_COUNT = 14


@dataclass(frozen=True, eq=False)
class FitTarget:
    """What the spheres should follow. Lengths in m.

    Args:
        surface: (m, 3) points of equal area on the surface.
        normals: (m, 3) outward unit normals there.
        interior: (k, 3) points inside, on a lattice.
        bounds: (2, 3) least and largest coordinates.
        symmetric: mirror-symmetric in the planes x = 0, y = 0 and z = 0.
    """

    surface: Array
    normals: Array
    interior: Array
    bounds: Array
    symmetric: bool

    @cached_property
    def inscribed_radius(self) -> float:
        """Radius of the largest sphere inside [m], to the spacing of the points: the unit of length here.

        Half the thickness of a plate or a seed; for a bent strip that of the strip, not of its bounding box.
        """
        from scipy.spatial import cKDTree

        inside = np.abs(self.interior) if self.symmetric else self.interior
        depth = float(cKDTree(self.surface).query(inside)[0].max())
        return min(depth, float(np.diff(self.bounds, axis=0).min() / 2.0))


@dataclass(frozen=True, eq=False)
class Orbits:
    """Which spheres mirror which: sphere k sits at signs[k] * points[owner[k]] with radius radii[owner[k]].

    Args:
        points: (o, 3) representatives [m].
        radii: (o,) [m].
        free: (o, 3) coordinates that may move; the others stay on their mirror plane.
        owner: (n,) orbit of each sphere.
        signs: (n, 3) of +1 and -1.
    """

    points: Array
    radii: Array
    free: npt.NDArray[np.bool_]
    owner: npt.NDArray[np.int64]
    signs: Array

    def spheres(self) -> tuple[Array, Array]:
        """Centres (n, 3) and radii (n,) of all spheres [m]."""
        return self.signs * self.points[self.owner], self.radii[self.owner]


def orbits_of(centres: Array, radii: Array, symmetric: bool) -> Orbits:
    """Orbits of spheres; in a symmetric solid those with x, y, z >= 0 stand for their mirror images."""
    if not symmetric:
        n = len(centres)
        return Orbits(centres, radii, np.ones((n, 3), bool), np.arange(n), np.ones((n, 3)))
    snap = 1e-9 * radii.max()
    kept = (centres > -snap).all(axis=1)
    points, radii = np.where(centres[kept] > snap, centres[kept], 0.0), radii[kept]
    free = points > 0.0
    images = [
        (orbit, signs)
        for orbit, moves in enumerate(free)
        for signs in product(*([1.0, -1.0] if move else [1.0] for move in moves))
    ]
    return Orbits(points, radii, free, np.array([o for o, _ in images]), np.array([s for _, s in images]))


def start_layouts(target: FitTarget, most: int, least_radius: float) -> dict[int, list[Orbits]]:
    """Starting layouts by number of spheres, up to `most`.

    Rows run along x, side by side along y, in layers along z.

    A layout is given by the number of layers, the number of rows, the spacing along the rows and the
    difference between neighbouring rows; a row is as long as the solid is there. In an asymmetric solid each
    centre moves to the mean of the interior points nearest to it, so that the rows of a bent or hollowed body
    lie inside. Radii start near the largest inscribed one, and at no less than `least_radius` [m]: small spheres
    have to prove useful.
    """
    from scipy.spatial import cKDTree

    radius = target.inscribed_radius
    extents = target.bounds[1] - target.bounds[0]
    compact = int(extents[2] > 0.5 * extents[0]) + int(extents[2] > 0.8 * extents[0])
    layers = range(1, 2 + max(compact, min(int(extents[2] / radius - 2.0), 3)))
    rows = range(1, 2 + min(int(np.ceil((extents[1] / radius - 2.0) / 0.8)), 8))
    surface = cKDTree(target.surface)
    layouts: dict[int, list[Orbits]] = {}
    seen: set[tuple[int, int, tuple[int, ...]]] = set()
    for n_layers, n_rows in product(layers, rows):
        found = _rows(target, n_layers, n_rows)
        for stagger, spacing in product(STAGGERS, radius * np.geomspace(12.0, 0.3, 80)):
            counts = tuple(row.count(stagger, spacing, 1.5 * radius) for row in found)
            tried = layouts.setdefault(sum(counts), [])
            if not 1 <= sum(counts) <= most or (n_layers, n_rows, counts) in seen or len(tried) == MOST_PER_COUNT:
                continue
            seen.add((n_layers, n_rows, counts))
            centres = np.concatenate(
                [row.places(count, 0.75 * radius) for row, count in zip(found, counts, strict=True)]
            )
            if not target.symmetric:
                centres = _cell_means(target.interior[::THINNING], centres)
            inscribed = surface.query(np.abs(centres) if target.symmetric else centres)[0]
            radii = np.clip(inscribed, max(least_radius, 0.9 * radius), radius)
            tried.append(orbits_of(centres, radii, target.symmetric))
    return {count: tried for count, tried in layouts.items() if tried}


def refine(orbits: Orbits, target: FitTarget, least_radius: float, steps: int) -> Orbits:
    """Orbits after at most `steps` damped Gauss–Newton steps; radii stay >= least_radius [m]."""
    model = _Residuals(orbits, target)
    x = model.pack(orbits)
    floor = np.where(model.is_radius, least_radius / model.unit, -np.inf)
    cost, gradient, normal = model(x)
    damping, stalled = 1e-2, 0
    for _ in range(steps):
        # a radius on its floor that wants to shrink takes no part in the step
        moving = ~((x <= floor) & (gradient > 0.0))
        damped = normal[np.ix_(moving, moving)]
        damped[np.diag_indices_from(damped)] += damping * (np.diag(damped) + 1e-6)
        trial = x.copy()
        trial[moving] -= np.linalg.solve(damped, gradient[moving])
        trial = np.maximum(trial, floor)
        trial_cost, trial_gradient, trial_normal = model(trial)
        if trial_cost < cost:
            stalled = stalled + 1 if trial_cost > 0.9995 * cost else 0
            x, cost, gradient, normal = trial, trial_cost, trial_gradient, trial_normal
            damping = max(damping / 5.0, 1e-6)
        else:
            damping *= 6.0
        if damping > 1e4 or stalled > 2:
            break
    return model.unpack(x)


def without_idle(orbits: Orbits, target: FitTarget) -> Orbits:
    """`orbits` without those whose spheres are all nearest to no surface point."""
    centres, radii = orbits.spheres()
    distance = np.sqrt(squared_distances(target.surface, centres))
    nearest = (distance - radii + not_facing(target.surface, target.normals, centres)).argmin(axis=1)
    busy = np.zeros(len(orbits.radii), dtype=bool)
    busy[orbits.owner[nearest]] = True
    kept = busy[orbits.owner]
    renumbered = np.cumsum(busy) - 1
    return Orbits(
        orbits.points[busy],
        orbits.radii[busy],
        orbits.free[busy],
        renumbered[orbits.owner[kept]],
        orbits.signs[kept],
    )


def not_facing(surface: Array, normals: Array, centres: Array) -> Array:
    """1e6 where a centre lies in front of a surface point, else 0; (m, n).

    A sphere in a re-entrant corner touches the surface from outside: it must not count as following it.
    """
    in_front = (normals @ centres.T) > (normals * surface).sum(axis=1)[:, None]
    return np.where(in_front, 1e6, 0.0)


class _Residuals:
    """Gaps and extent errors in units of the inscribed radius, as a function of the packed unknowns x.

    A residual depends on one sphere, hence on four unknowns at most: its row of the Jacobian is kept as four
    columns and four values, and the normal matrix is summed from them. Without large matrix products the bits
    do not depend on the number of cores.
    """

    def __init__(self, orbits: Orbits, target: FitTarget) -> None:
        self.orbits, self.unit = orbits, target.inscribed_radius
        self.surface = target.surface / self.unit
        self.bounds = target.bounds / self.unit
        self.normals = target.normals
        count, moves = len(orbits.radii), int(orbits.free.sum())
        # column of every coordinate and radius; fixed coordinates share one last column that is dropped
        column = np.full((count, 4), moves + count)
        column[:, :3][orbits.free] = np.arange(moves)
        column[:, 3] = moves + np.arange(count)
        self.column, self.unknowns = column[orbits.owner], moves + count
        self.is_radius = np.arange(self.unknowns) >= moves

    def pack(self, orbits: Orbits) -> Array:
        return np.concatenate([orbits.points[orbits.free], orbits.radii]) / self.unit

    def unpack(self, x: Array) -> Orbits:
        old = self.orbits
        points = np.zeros_like(old.points)
        points[old.free] = x[~self.is_radius] * self.unit
        return Orbits(points, x[self.is_radius] * self.unit, old.free, old.owner, old.signs)

    def __call__(self, x: Array) -> tuple[float, Array, Array]:
        """Sum of squared residuals r, gradient J^T r (u,) and normal matrix J^T J (u, u), u unknowns."""
        residual, sphere, slopes = self.rows(x)
        columns = self.column[sphere]
        slopes = np.concatenate([slopes[:, :3] * self.orbits.signs[sphere], slopes[:, 3:]], axis=1)
        size = self.unknowns + 1
        gradient = _sums(columns, slopes * residual[:, None], size)
        pairs = columns[:, :, None] * size + columns[:, None, :]
        products = slopes[:, :, None] * slopes[:, None, :]
        normal = _sums(pairs, products, size * size).reshape(size, size)
        return float((residual**2).sum()), gradient[:-1], normal[:-1, :-1]

    def rows(self, x: Array) -> tuple[Array, npt.NDArray[np.int64], Array]:
        """Residuals (r,), the sphere that each depends on (r,), slopes (r, 4) by its centre and radius."""
        centres, radii = self.unpack(x).spheres()
        parts = [
            self._gaps(centres / self.unit, radii / self.unit),
            *self._outer(centres / self.unit, radii / self.unit),
        ]
        residual, sphere, slopes = (np.concatenate(column) for column in zip(*parts, strict=True))
        return residual, sphere, slopes

    def _gaps(self, centres: Array, radii: Array) -> tuple[Array, npt.NDArray[np.int64], Array]:
        distance = np.sqrt(squared_distances(self.surface, centres))
        nearest = (distance - radii + not_facing(self.surface, self.normals, centres)).argmin(axis=1)
        length = np.maximum(distance[np.arange(len(nearest)), nearest], 1e-12)
        weight = 1.0 / np.sqrt(len(nearest))
        slopes = np.full((len(nearest), 4), -weight)
        slopes[:, :3] *= (self.surface - centres[nearest]) / length[:, None]
        return weight * (length - radii[nearest]), nearest, slopes

    def _outer(self, centres: Array, radii: Array) -> list[tuple[Array, npt.NDArray[np.int64], Array]]:
        """Every sphere must stay within the bounds, and one must reach each of them, within the tolerance."""
        slack = EXTENT_TOLERANCE / 2.0 * (self.bounds[1] - self.bounds[0])
        parts = []
        for side, sign in ((1, 1.0), (0, -1.0)):
            # (n, 3) signed distance of each sphere's outermost point beyond the bound
            beyond = sign * (centres - self.bounds[side]) + radii[:, None]
            residual = np.maximum(beyond - slack, 0.0)
            outermost = beyond.argmax(axis=0), np.arange(3)
            residual[outermost] += np.minimum(beyond[outermost] + slack, 0.0)
            sphere, axis = np.nonzero(residual)
            slopes = np.zeros((len(sphere), 4))
            slopes[np.arange(len(sphere)), axis] = sign * EXTENT_WEIGHT
            slopes[:, 3] = EXTENT_WEIGHT
            parts.append((EXTENT_WEIGHT * residual[sphere, axis], sphere, slopes))
        return parts


def _sums(place: npt.NDArray[np.int64], values: Array, size: int) -> Array:
    """Array (size,) with each value added at its place."""
    return np.asarray(np.bincount(place.ravel(), values.ravel(), size), dtype=np.float64)


@dataclass(frozen=True)
class _Row:
    """A row along x at (y, z), from x = low to high [m]; parity alternates from the outermost row inwards."""

    y: float
    z: float
    low: float
    high: float
    parity: int

    def count(self, stagger: int, spacing: float, inset: float) -> int:
        spheres = 1 + round(max(self.high - self.low - inset, 0.0) / spacing)
        return max(spheres + stagger * self.parity, 1)

    def places(self, count: int, inset: float) -> Array:
        x = _spread(self.low, self.high, count, inset)
        return np.stack([x, np.full(count, self.y), np.full(count, self.z)], axis=1)


def _rows(target: FitTarget, n_layers: int, n_rows: int) -> list[_Row]:
    inset = target.inscribed_radius
    low, high = target.bounds
    heights = _spread(low[2], high[2], n_layers, inset)
    breadths = _spread(low[1], high[1], n_rows, inset)
    width = (high[1] - low[1]) / (n_rows + 1)
    rows = []
    for z, (k, y) in product(heights, enumerate(breadths)):
        near = np.abs(target.interior[:, 1] - y) < max(width / 4.0, 0.1 * inset)
        x = target.interior[near, 0]
        if len(x):
            rows.append(_Row(y, z, x.min(), x.max(), min(k, n_rows - 1 - k) % 2))
    return rows


def _spread(low: float, high: float, count: int, inset: float) -> Array:
    """`count` equidistant places between the bounds less the inset, symmetric about the middle."""
    half = (high - low) / 2.0
    # a compact solid leaves no room beside its inscribed sphere: there the places stay apart nonetheless
    half = max(half - inset, half * 0.5 * (1.0 - 1.0 / count))
    fractions = np.zeros(1) if count == 1 else (2.0 * np.arange(count) - (count - 1)) / (count - 1)
    return (low + high) / 2.0 + half * fractions


def _cell_means(interior: Array, centres: Array) -> Array:
    """Centres moved to the mean of the interior points nearest to each, three times over (Lloyd 1982)."""
    from scipy.spatial import cKDTree

    for _ in range(3):
        nearest = cKDTree(centres).query(interior)[1]
        count = np.bincount(nearest, minlength=len(centres))
        sums = np.stack([np.bincount(nearest, interior[:, a], len(centres)) for a in range(3)], axis=1)
        centres = np.where(count[:, None] > 0, sums / np.maximum(count, 1)[:, None], centres)
    return centres
