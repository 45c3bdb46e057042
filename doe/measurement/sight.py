"""What a surface is seen through: a camera aslant, from which some of it is hidden, and the noise of a height.

A scanner that sees the plate from one side misses what stands behind something higher. Where its camera stands is told
by the holes of its scans themselves: of all directions that one whose shadows, cast by the scanned surface, cover the
holes best (share of the union that is in both). Nothing is assumed where no direction covers ``COVERED`` of it.
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
"""Directions that are tried [rad]: from 85° to 30° above the plate."""
COVERED = 0.25
"""Least share for a camera; holes at random are covered by a few per cent."""
FEW = 0.003
"""Share of holes below which nothing is hidden."""


@dataclass(frozen=True)
class Sight:
    """Direction of the camera [rad], ``elevation`` π/2 where nothing is hidden; standard deviation of a height [m]."""

    azimuth: float = 0.0
    elevation: float = 0.5 * math.pi
    noise: float = 0.0

    @property
    def label(self) -> str:
        """Its numbers."""
        return f"{math.degrees(self.azimuth):.0f} {math.degrees(self.elevation):.0f} {1e3 * self.noise:.4g}"


PERFECT = Sight()


def seen_through(surface: HeightMap, sight: Sight) -> HeightMap:
    """``surface`` with NaN where ``sight`` shows nothing, and with its noise, which is the same for the same map."""
    if sight == PERFECT:
        return surface
    height = surface.height
    if sight.noise > 0.0:
        height = height + sight.noise * np.random.default_rng(0).standard_normal(height.shape)
    return HeightMap(np.where(hidden(surface, sight), np.nan, height), surface.radius, surface.pixel)


def hidden(surface: HeightMap, sight: Sight) -> Bools:
    """Pixels from which the line to the camera meets something higher."""
    if not 0.0 < sight.elevation < 0.5 * math.pi:
        return np.zeros(surface.height.shape, dtype=bool)
    return _shadows(surface, sight.azimuth, (sight.elevation,))[0]


def _shadows(surface: HeightMap, azimuth: float, elevations: Sequence[float]) -> list[Bools]:
    """Hidden pixels by each of ``elevations``, from the highest down: the lower the camera, the farther the shadows."""
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
    """The sight of ``scans`` of one scanner, NaN where it saw nothing, with a height's ``noise`` [m]."""
    pairs = []
    for scan in scans:
        missing = np.isnan(scan.height)
        rows, columns = (np.flatnonzero(~missing.all(axis=axis)) for axis in (1, 0))
        if rows.size and columns.size:
            # Beyond what was scanned at all nothing is hidden.
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
