"""How a scanner sees a surface: an oblique camera, from which parts are hidden, and the noise of a height.

A scanner that looks at the plate from one side misses whatever stands behind something higher. The direction of its
camera is inferred from the holes in its scans: it is the direction whose shadows, cast by the scanned surface, overlap
the holes best (intersection over union). If no direction has an overlap above ``COVERED``, no camera is assumed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver import HeightMap, without_holes

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

AZIMUTHS = tuple(math.radians(15.0 * k) for k in range(24))
ELEVATIONS = tuple(math.radians(5.0 * k) for k in range(17, 5, -1))
"""Elevations that are tried [rad], from 85° down to 30° above the plate."""
COVERED = 0.25
"""Least overlap (intersection over union) that identifies a camera; for random holes it is a few per cent."""
FEW = 0.003
"""Share of holes up to which nothing counts as hidden."""


@dataclass(frozen=True)
class Sight:
    """Direction of the camera [rad] and ``noise``, the standard deviation of a height [m].

    ``elevation`` is π/2 where nothing is hidden.
    """

    azimuth: float = 0.0
    elevation: float = 0.5 * math.pi
    noise: float = 0.0

    @property
    def label(self) -> str:
        """Azimuth [°], elevation [°] and noise [mm] as text."""
        return f"{math.degrees(self.azimuth):.0f} {math.degrees(self.elevation):.0f} {1e3 * self.noise:.4g}"


PERFECT = Sight()


def seen_through(surface: HeightMap, sight: Sight) -> HeightMap:
    """Return ``surface`` as ``sight`` shows it: with noise, and NaN where it is hidden.

    The noise is the same for all maps of one shape, so that a map always gives the same numbers.
    """
    if sight == PERFECT:
        return surface
    height = surface.height
    if sight.noise > 0.0:
        height = height + sight.noise * np.random.default_rng(0).standard_normal(height.shape)
    return HeightMap(np.where(hidden(surface, sight), np.nan, height), surface.radius, surface.pixel)


def hidden(surface: HeightMap, sight: Sight) -> Bools:
    """Return the pixels whose line of sight to the camera is blocked by something higher."""
    if not 0.0 < sight.elevation < 0.5 * math.pi:
        return np.zeros(surface.height.shape, dtype=bool)
    return _shadows(surface, sight.azimuth, (sight.elevation,))[0]


def _shadows(surface: HeightMap, azimuth: float, elevations: Sequence[float]) -> list[Bools]:
    """Hidden pixels for each of ``elevations``, highest first: the lower the camera, the longer the shadows."""
    height, found, step = surface.height, [], 0
    rises = [math.tan(elevation) * surface.pixel for elevation in elevations]
    reach = [int(float(height.max(initial=0.0)) / rise) + 1 for rise in rises]
    padded, (n, m) = np.pad(height, reach[-1]), height.shape
    steepest = np.full(height.shape, -np.inf)
    for rise, farthest in zip(rises, reach, strict=True):
        while step < farthest:
            step += 1
            i = reach[-1] + round(step * math.cos(azimuth))
            j = reach[-1] + round(step * math.sin(azimuth))
            np.maximum(steepest, (padded[i : i + n, j : j + m] - height) / step, out=steepest)
        found.append(steepest > rise)
    return found


def found_sight(scans: Sequence[HeightMap], noise: float) -> Sight:
    """Return the sight of a scanner from its ``scans``, NaN where it saw nothing, and the ``noise`` of a height [m]."""
    pairs = []
    for scan in scans:
        missing = np.isnan(scan.height)
        rows, columns = (np.flatnonzero(~missing.all(axis=axis)) for axis in (1, 0))
        if rows.size and columns.size:
            # Outside the scanned rectangle, missing pixels are not shadows.
            window = np.ix_(*(np.arange(kept[0], kept[-1] + 1) for kept in (rows, columns)))
            pairs.append(
                (HeightMap(without_holes(scan).height[window], scan.radius[window], scan.pixel), missing[window])
            )
    holes = sum(int(missing.sum()) for _, missing in pairs)
    if holes <= FEW * sum(missing.size for _, missing in pairs):
        return Sight(noise=noise)
    best, most = Sight(noise=noise), COVERED
    for azimuth in AZIMUTHS:
        shadows = zip(*(_shadows(surface, azimuth, ELEVATIONS) for surface, _ in pairs), strict=True)
        for elevation, seen in zip(ELEVATIONS, shadows, strict=True):
            both = sum(int((shadow & missing).sum()) for shadow, (_, missing) in zip(seen, pairs, strict=True))
            union = sum(int((shadow | missing).sum()) for shadow, (_, missing) in zip(seen, pairs, strict=True))
            if both > most * union:
                best, most = Sight(azimuth, elevation, noise), both / union
    return best
