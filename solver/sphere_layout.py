"""Where a sphere fit may start: rows of spheres, tried by ascending number."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from solver.sphere_fit import Orbits, Target, orbits_of
from solver.sphere_union import Array

# spheres more or fewer in every other row: staggered rows on plates, short outer rows on seeds
STAGGERS = (0, 1, -1, -2, -3, 2, 3)
# every so many of the interior points are enough to place a start
THINNING = 7
# layouts for one number of spheres: a plate has 13, a crooked body would have many more
MOST_PER_COUNT = 14


def start_layouts(target: Target, most: int, least_radius: float) -> dict[int, list[Orbits]]:
    """Starting layouts by number of spheres, up to `most`.

    Rows run along x, side by side along y, in layers along z.

    A layout is given by the number of layers, the number of rows, the spacing along the rows and the
    difference between neighbouring rows; a row is as long as the solid is there. In an asymmetric solid each
    centre moves to the mean of the interior points nearest to it, so that the rows of a bent or hollowed body
    lie inside. Radii start near the largest inscribed one, and at least at `least_radius` [m]: small spheres
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


def _rows(target: Target, n_layers: int, n_rows: int) -> list[_Row]:
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
