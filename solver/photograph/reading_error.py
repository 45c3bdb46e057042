"""How well a picture fixes the angle of the silhouette that it shows: standard errors, and intervals of ±2 of them.

Four sources, taken as independent:

level    the angle with the edge at 35 % and at 65 % of the way from outside to inside, half their difference
tilt     the standard error of the base line's slope (it turns one flank up and the other down, so that the mean of both
         is free of it)
window   the largest change of the angle when the base line or the top is moved by its standard error, 1.5 pixels at
         least: a fit between 20 % and 80 % of the height may begin at another body then
pixel    jitter of the edge in each column, half a pixel's rounding and the noise left by the smoothing over the slope
         of the grey levels, through the least-squares line: σ √12 / (√n L), n columns that are independent, L wide

What they do not hold: another pour, a camera above the plate, the perspective of a camera close by, a wrong base line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.observables.repose import FlankLine, flank_angles_deg
from solver.photograph.base_line import BaseLine
from solver.photograph.edge import Silhouettes

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

COVERAGE = 2.0
"""Standard errors on either side of an interval."""
ROUNDING = 12.0**-0.5
"""Standard deviation of a place known to a pixel [pixel]."""
EDGE = 2.0
"""Width over which the grey levels change sides, and places of neighbouring columns hang together [pixel]."""
LEAST_DEG = 0.02
LEAST_MOVE = 1.5
"""[pixel]"""


@dataclass(frozen=True)
class Angle:
    """An angle that was read off a picture."""

    value_deg: float
    error_deg: float
    """Standard error of reading it."""

    @property
    def interval_deg(self) -> tuple[float, float]:
        """About 95 %."""
        reach = COVERAGE * self.error_deg
        return self.value_deg - reach, self.value_deg + reach


@dataclass(frozen=True)
class Angles:
    """Of the left and the right flank, and their mean."""

    left: Angle
    right: Angle
    mean: Angle
    level_shift_deg: float
    """Largest half difference between the angles at 35 % and at 65 %."""


def angles_of(
    seen: Silhouettes, flanks: tuple[FlankLine, FlankLine], step: float, line: BaseLine, noise_share: float
) -> Angles:
    """Angles with their errors; ``step`` [pixels of the picture worked on] along a pixel of the silhouettes,
    ``noise_share``: standard deviation of a smoothed pixel over the contrast of the edge."""
    value = np.array([flank.angle_deg for flank in flanks])
    low, high = (np.array(flank_angles_deg(image, 1.0)) for image in (seen.images[0], seen.images[-1]))
    level = np.stack([0.5 * (high - low)])
    moved = np.stack(
        [
            np.array(flank_angles_deg(image, 1.0)) - value
            for image in _moved(seen.images[1], max(1, round(max(line.offset_error, LEAST_MOVE) / step)))
        ]
    )
    pixel = np.array([_jitter_deg(flank, step, noise_share) for flank in flanks])
    turn = float(np.degrees(line.slope_error))
    each = np.sqrt(_largest(level) ** 2 + _largest(moved) ** 2 + turn**2 + pixel**2 + LEAST_DEG**2)
    both = np.sqrt(
        _largest(level.mean(axis=1, keepdims=True)) ** 2
        + _largest(moved.mean(axis=1, keepdims=True)) ** 2
        + (pixel**2).sum() / 4.0
        + LEAST_DEG**2
    )
    left, right = (Angle(float(v), float(e)) for v, e in zip(value, each, strict=True))
    # An angle that cannot be read at a neighbouring level at all has no clear edge.
    shift = float(np.abs(level).max()) if np.isfinite(level).all() else float("inf")
    return Angles(left, right, Angle(float(value.mean()), float(both[0])), shift)


def _moved(image: Image, rows: int) -> Iterator[Image]:
    """``image`` with its base line, and with its top, moved up and down by ``rows``."""
    top = int(np.flatnonzero(image.any(axis=1))[-1]) + 1
    apex = int(np.flatnonzero(image[top - 1])[0])
    yield image[rows:]
    yield np.concatenate([np.repeat(image[:1], rows, axis=0), image])
    yield image[: top - rows]
    taller = np.concatenate([image[:top], np.zeros((rows, image.shape[1]), dtype=bool)])
    taller[:, apex] = True
    yield taller


def _largest(changes: Array) -> Array:
    """Largest change of each angle, ``changes`` (ways, angles); a way by which it cannot be read does not count."""
    return np.nan_to_num(np.abs(changes)).max(axis=0)


def _jitter_deg(flank: FlankLine, step: float, noise_share: float) -> float:
    """Of the line of ``flank`` [pixels of the silhouettes]."""
    length = max(abs(flank.u[1] - flank.u[0]), 3.0) * step
    jitter = np.hypot(ROUNDING * step, EDGE * noise_share)
    slope_error = jitter * np.sqrt(12.0 / max(length / EDGE, 3.0)) / length
    return float(np.degrees(slope_error / (1.0 + flank.slope**2)))
