"""How well a picture fixes the angle of the silhouette that it shows: standard errors, and intervals of ±2 of them.

Four sources, taken as independent:

level    the angle with the edge at 35 % and at 65 % of the way from outside to inside, half their difference
tilt     the standard error of the base line's slope (it turns one flank up and the other down, so that the mean of both
         is free of it)
window   root mean square of the changes of the angle when the base line, or the top, is moved up and down by the base
         line's standard error, a pixel at least, and when the whole edge is moved out and in by half a pixel: a fit
         between 20 % and 80 % of the height may begin at another body then, and a steep side lie in another column
pixel    jitter of the edge in each column, half a pixel's rounding and the noise left by the smoothing over the slope
         of the grey levels, through the least-squares line: σ √12 / (√n L), n columns 8 pixels apart, L wide

What they do not hold: another pour, a camera above the plate, the perspective of a camera close by, a wrong base line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.repose import FlankLine, flank_angles_deg
from solver.observables.silhouette import EIGHT_NEIGHBOURS
from solver.photograph.base_line import BaseLine
from solver.photograph.edge import Silhouettes

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

COVERAGE = 2.0
"""Standard errors on either side of an interval."""
ROUNDING = 12.0**-0.5
"""Standard deviation of a place known to a pixel [pixel]."""
EDGE = 2.0
"""Width over which the grey levels change sides [pixel]."""
BLOCK = 8.0
"""Width over which places of the edge may hang together: a block of a JPEG [pixel]."""
LEAST_DEG = 0.02


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
    """Largest half difference between the angles at 35 % and at 65 %; infinite where one of them cannot be read."""


def angles_of(
    seen: Silhouettes, flanks: tuple[FlankLine, FlankLine], step: float, line: BaseLine, noise_share: float
) -> Angles:
    """Angles with their errors; ``step`` [pixels of the picture worked on] along a pixel of the silhouettes,
    ``noise_share``: standard deviation of a smoothed pixel over the contrast of the edge."""
    value = np.array([flank.angle_deg for flank in flanks])
    low, high = (np.array(flank_angles_deg(image, 1.0)) for image in (seen.images[0], seen.images[-1]))
    level = 0.5 * (high - low)
    changed = _moved(seen.images[1], max(1, round(max(line.offset_error, 1.0) / step)), max(1, round(0.5 / step)))
    moved = np.stack([np.array(flank_angles_deg(image, 1.0)) - value for image in changed])
    pixel = np.array([_jitter_deg(flank, step, noise_share) for flank in flanks])
    turn = float(np.degrees(line.slope_error))
    level_known, moved_known = np.nan_to_num(level), np.nan_to_num(moved)
    window = (moved_known**2).mean(axis=0)
    each = np.sqrt(level_known**2 + window + turn**2 + pixel**2 + LEAST_DEG**2)
    window_of_mean = (moved_known.mean(axis=1) ** 2).mean()
    both = np.sqrt(level_known.mean() ** 2 + window_of_mean + (pixel**2).sum() / 4.0 + LEAST_DEG**2)
    left, right = (Angle(float(v), float(e)) for v, e in zip(value, each, strict=True))
    shift = float(np.abs(level).max()) if np.isfinite(level).all() else float("inf")
    return Angles(left, right, Angle(float(value.mean()), float(both)), shift)


def _moved(image: Image, rows: int, edge: int) -> Iterator[Image]:
    """``image`` with its base line, and with its top, moved up and down by ``rows``, and its edge out and in by
    ``edge`` [pixels]."""
    top = int(np.flatnonzero(image.any(axis=1))[-1]) + 1
    apex = int(np.flatnonzero(image[top - 1])[0])
    yield image[rows:]
    yield np.concatenate([np.repeat(image[:1], rows, axis=0), image])
    yield image[: top - rows]
    taller = np.concatenate([image[:top], np.zeros((rows, image.shape[1]), dtype=bool)])
    taller[:, apex] = True
    yield taller
    yield ndimage.binary_dilation(np.pad(image, ((0, edge), (edge, edge))), EIGHT_NEIGHBOURS, iterations=edge)
    yield ndimage.binary_erosion(image, EIGHT_NEIGHBOURS, iterations=edge, border_value=1)


def _jitter_deg(flank: FlankLine, step: float, noise_share: float) -> float:
    """Of the line of ``flank`` [pixels of the silhouettes]."""
    length = max(abs(flank.u[1] - flank.u[0]), 3.0) * step
    jitter = np.hypot(ROUNDING * step, EDGE * noise_share)
    slope_error = jitter * np.sqrt(12.0 / max(length / BLOCK, 3.0)) / length
    return float(np.degrees(slope_error / (1.0 + flank.slope**2)))
