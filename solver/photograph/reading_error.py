"""How well a picture determines the angle of the silhouette that it shows: standard errors, and intervals of ±2 errors.

Four sources of reading the silhouette, taken as independent:

level    the angle with the edge at 35 % and at 65 % of the way from outside to inside, half their difference
tilt     the standard error of the base line's slope (it turns one flank up and the other down, so that the mean of both
         is free of it)
window   root mean square of the changes of the angle when the base line, or the top, is moved up and down by the base
         line's standard error, a pixel at least, and when the whole edge is moved out and in by half a pixel: a fit
         between 20 % and 80 % of the height may begin at another body then, and a steep side lie in another column
pixel    jitter of the edge in each column, half a pixel's rounding and the noise left by the smoothing over the slope
         of the grey levels, through the least-squares line: σ √12 / (√n L), n columns 8 pixels apart, L wide

and three of what the silhouette is of:

flank    a straight flank has one slope. Lines through the lower, the middle and the upper third of the window differ by
         the outline's roughness r about two lines, by r √12 / (√n L) as above, n the stretches on one side of it; the
         variance of the three beyond SURE_BEND of that, by which chance alone has it in one of twenty, over three
lens     the change of the angle with k (`lens.py`) times the standard deviation of k that is left
camera   a cone of angle α looks like tan² α' = tan² α cos² e - sin² e from e above its foot, and like tan α cos θ from
         the level of the foot where half of it fills the angle θ (the planes through the camera that touch it).
         e is up to what the foot of the pile allows, or UNSEEN_ABOVE_DEG; θ is known from the focal length in the file,
         and up to UNSEEN_NEAR elsewhere. Anything up to there is as likely: standard deviation 1/√3 of it

What they do not include: another pour, a wrong base line, a camera farther above the plate or nearer than that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.repose import FlankLine, flank_angles_deg, flank_lines
from solver.observables.silhouette import EIGHT_NEIGHBOURS, column_tops
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
"""Width over which places of the edge may be correlated: a block of a JPEG [pixel]."""
LEAST_DEG = 0.02
THIRDS = (0.2, 0.4, 0.6, 0.8)
"""Ends of the thirds of the window, over the height."""
CORNERS = tuple(np.linspace(0.08, 0.92, 15))
"""Places along a flank where its slope may change."""
SURE_BEND = 3.0
"""χ²/2 with two degrees of freedom at 95 %."""
COARSE_DEG = 2.0
"""Scatter of the thirds above which a few large bodies determine them, so that they tell nothing about a bend."""
COARSE_SPREAD = 6.0
"""Multiple of that scatter by which they must differ to tell of a bend all the same: bodies make up to 4."""
UNSEEN_NEAR = 0.1
"""Half the width of the pile over the distance of the camera, if nothing shows it: five widths."""


@dataclass(frozen=True)
class Angle:
    """An angle that was read off a picture."""

    value_deg: float
    error_deg: float
    """Standard error of reading it."""
    thirds_deg: tuple[float, float, float] = (float("nan"),) * 3
    """Angles over the lower, the middle and the upper third of the window; NaN of one with no slope."""
    parts_deg: dict[str, float] = field(default_factory=dict)
    """Source → its standard error."""

    @property
    def interval_deg(self) -> tuple[float, float]:
        """Angle ± ``COVERAGE`` standard errors [°]: about 95 %."""
        reach = COVERAGE * self.error_deg
        return self.value_deg - reach, self.value_deg + reach


@dataclass(frozen=True)
class Angles:
    """Angles of the left and the right flank, and their mean."""

    left: Angle
    right: Angle
    mean: Angle
    level_shift_deg: float
    """Largest half difference between the angles at 35 % and at 65 %; infinite where one of them cannot be read, or
    no change of a flank when base line, top and edge are moved."""
    bend_deg: tuple[float, float]
    """Standard deviation of the thirds of the left and the right flank beyond that by roughness."""


@dataclass(frozen=True)
class View:
    """What is known of the lens and of the camera's place."""

    lens_deg: tuple[float, float]
    """Standard errors of the left and the right angle by the lens [°]."""
    above_deg: float
    """How far above the plate the camera is at most."""
    near: float
    """Half the width of the pile over the distance of the camera."""


def angles_of(
    seen: Silhouettes, flanks: tuple[FlankLine, FlankLine], step: float, line: BaseLine, noise_share: float, view: View
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
    level_known = np.nan_to_num(level)
    # A flank that is lost when it is moved tells nothing: the other moves speak for it.
    held = np.isfinite(moved)
    window = np.where(held, moved, 0.0) ** 2
    window = window.sum(axis=0) / np.maximum(held.sum(axis=0), 1)
    both_held = held.all(axis=1)
    each = np.sqrt(level_known**2 + window + turn**2 + pixel**2 + LEAST_DEG**2)
    window_of_mean = (moved[both_held].mean(axis=1) ** 2).mean() if both_held.any() else window.mean()
    both = np.sqrt(level_known.mean() ** 2 + window_of_mean + (pixel**2).sum() / 4.0 + LEAST_DEG**2)
    sides, tops = _thirds(seen.images[1]), column_tops(seen.images[1]).astype(np.float64)
    thirds = np.array([[np.nan if third is None else third.angle_deg for third in side] for side in sides])
    bend = np.array([_bend_deg(side, line, tops) for side, line in zip(sides, flanks, strict=True)])
    flank = bend / np.sqrt(len(THIRDS) - 1)
    lens = np.array(view.lens_deg)
    camera = np.array([_camera_deg(angle, view) for angle in value])
    found = [
        _angle(*of)
        for of in (
            (value[0], thirds[0], each[0], flank[0], lens[0], camera[0]),
            (value[1], thirds[1], each[1], flank[1], lens[1], camera[1]),
            # Whatever bends, distorts or foreshortens one flank does the same to the other.
            (value.mean(), thirds.mean(axis=0), both, flank.mean(), lens.mean(), camera.mean()),
        )
    ]
    read = np.isfinite(level).all() and held.any(axis=0).all()
    shift = float(np.abs(level).max()) if read else float("inf")
    return Angles(found[0], found[1], found[2], shift, (float(bend[0]), float(bend[1])))


def _angle(value: float, thirds: Array, reading: float, flank: float, lens: float, camera: float) -> Angle:
    parts = {"reading": float(reading), "flank": float(flank), "lens": float(lens), "camera": float(camera)}
    error = float(np.sqrt(sum(part**2 for part in parts.values())))
    return Angle(float(value), error, (float(thirds[0]), float(thirds[1]), float(thirds[2])), parts)


def _thirds(image: Image) -> list[list[FlankLine | None]]:
    """Lines of the left and the right flank by thirds of the window, from below."""
    lines = [flank_lines(image, 1.0, window=window) for window in pairwise(THIRDS)]
    return [list(side) for side in zip(*lines, strict=True)]


def _bend_deg(thirds: Sequence[FlankLine | None], flank: FlankLine, tops: Array) -> float:
    """Standard deviation of the angles of ``thirds`` beyond that by the roughness of the outline ``tops`` [°].

    The roughness is that about two straight stretches with the best corner between them, so that neither a corner nor a
    smooth bend of the whole ``flank`` is any.
    """
    known = [third.angle_deg for third in thirds if third is not None]
    if len(known) < 2:
        return 0.0
    inner, outer = sorted(flank.u)
    columns = np.arange(int(inner), int(outer) + 1)
    x = np.linspace(0.0, 1.0, columns.size)
    straight = (np.stack([np.ones_like(x), x, np.maximum(x - corner, 0.0)], axis=1) for corner in CORNERS)
    misses = [tops[columns] - terms @ np.linalg.lstsq(terms, tops[columns], rcond=None)[0] for terms in straight]
    miss = min(misses, key=np.linalg.norm)
    n = max(1.0, (1.0 + np.count_nonzero(np.diff(np.signbit(miss)))) / 3.0)
    scatter = np.sqrt(12.0 * np.mean(miss**2) / n) / (columns.size / 3.0) / (1.0 + flank.slope**2)
    spread, scatter_deg = float(np.std(known, ddof=1)), float(np.degrees(scatter))
    if scatter_deg > COARSE_DEG and spread < COARSE_SPREAD * scatter_deg:
        return 0.0
    return float(np.sqrt(max(0.0, spread**2 - SURE_BEND * scatter_deg**2)))


def _camera_deg(angle_deg: float, view: View) -> float:
    """How much steeper the pile may be than it looks to a camera above the plate and close by, over √3 [°]."""
    tangent, above = np.tan(np.radians(angle_deg)), np.radians(view.above_deg)
    from_above = np.hypot(tangent, np.sin(above)) / np.cos(above)
    close_by = tangent * np.hypot(1.0, view.near)
    steeper = np.degrees(np.arctan([from_above, close_by])) - angle_deg
    return float(np.hypot(*steeper) / np.sqrt(3.0))


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
    """Standard error by jitter of the line of ``flank`` [pixels of the silhouettes], in degrees."""
    length = max(abs(flank.u[1] - flank.u[0]), 3.0) * step
    jitter = np.hypot(ROUNDING * step, EDGE * noise_share)
    slope_error = jitter * np.sqrt(12.0 / max(length / BLOCK, 3.0)) / length
    return float(np.degrees(slope_error / (1.0 + flank.slope**2)))
