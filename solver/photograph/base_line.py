"""The line on which the pile stands: the plate's upper edge beside the pile, or the foot of the pile itself.

Lines are y = offset + slope · x in pixels, y down. If the part that holds the pile ends on both sides in a level
stretch (a plate of the pile's grey), that stretch is the plate; otherwise the pile's lower boundary is used. Either is
first found in the mask and then placed between pixels, where the grey is half-way between both sides of the edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.photograph.picture import NotAPile, Reason
from solver.photograph.support import rimless

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]
Kind = Literal["plate", "foot", "given", "support"]

SHOULDER = 0.04
"""Share of the part's width, at either end, that is level where a plate shows beside the pile."""
SLOPES = (0.08, 0.2)
"""Largest difference of rise over run between both ends, for a plate and for one that goes on beyond the picture,
besides the rounding to a pixel over an end."""
INNER = 0.10
"""Share of the part's width at either end where the pile is too thin to tell its foot."""
REACH = 6
"""Pixels of the mask on either side of the rough line within which the edge is looked for."""
MOST_SAG = 0.05
"""Depth of a bulging foot over its width; a round pile seen from 5° above has 0.044, which lowers 25° by 0.5°."""
UNSEEN_ABOVE_DEG = 3.0
"""Largest angle at which a camera is assumed to be above the plate, if no foot shows it."""
MOST_TILT_DEG = 7.0
BLOCK = 8.0


@dataclass(frozen=True)
class BaseLine:
    """Where the pile stands."""

    offset: float
    """y at x = 0 [px]."""
    slope: float
    slope_error: float
    """Standard error of ``slope``; 0 for a given line."""
    offset_error: float
    """Standard error of the line's height in the middle [px]."""
    kind: Kind
    left: float
    """x of the outermost columns that it was fitted to [px]."""
    right: float
    above_deg: float = UNSEEN_ABOVE_DEG
    """How far above the plate the camera may be (95 %), from the foot of the pile; nothing else shows it."""

    def at(self, x: Array) -> Array:
        """y [px] at ``x`` [px]."""
        return self.offset + self.slope * x

    @property
    def tilt_deg(self) -> float:
        """Angle against the picture's rows [°], positive where the right end is lower."""
        return float(np.degrees(np.arctan(self.slope)))


def rough_base_line(part: Image) -> BaseLine:
    """The base line of a mask's ``part``, to about a pixel; NotAPile if it has none."""
    x, tops, bottoms = _edges(part)
    plate = _shoulders(x, tops, bottoms, bool(part[:, 0].any() and part[:, -1].any()))
    if plate is not None:
        return plate
    at_side = [side for side, column in (("left", 0), ("right", -1)) if part[:, column].any()]
    if at_side or part[-1].any():
        where = " and ".join([*at_side, *(["lower"] if part[-1].any() else [])])
        raise NotAPile(
            Reason.CUT_BY_FRAME,
            f"the silhouette reaches the {where} edge of the picture, and no level plate is seen on both sides of it; "
            "show the whole pile with the camera level with the plate, or state --baseline",
        )
    try:
        return _foot(x, bottoms)
    except NotAPile as reason:
        # The rim of a glass that sticks out over the foot makes the foot look like a bulge.
        bare = rimless(part)
        if reason.reason != Reason.CAMERA_LOOKS_DOWN or bare is part:
            raise
        x, _, bottoms = _edges(bare)
        return _foot(x, bottoms)


def sharp_base_line(grey: Array, rough: BaseLine, scale: float) -> BaseLine:
    """``rough`` placed between the pixels of ``grey``, which has ``scale`` pixels along one of the mask's."""
    start = BaseLine(
        (rough.offset + 0.5 - 0.5 * rough.slope) * scale - 0.5 + 0.5 * rough.slope,
        rough.slope,
        0.0,
        0.0,
        rough.kind,
        (rough.left + 0.5) * scale - 0.5,
        (rough.right + 0.5) * scale - 0.5,
        rough.above_deg,
    )
    width = start.right - start.left
    if rough.kind == "foot":
        x = np.arange(start.left + INNER * width, start.right - INNER * width)
    else:
        edge = np.arange(SHOULDER * width)
        x = np.concatenate([start.left + edge, start.right - edge[::-1]])
    depth = np.arange(-REACH * scale, REACH * scale + 0.5, 0.5)
    y = start.at(x)[None, :] + depth[:, None]
    strip = ndimage.map_coordinates(grey, [y, np.broadcast_to(x, y.shape)], order=1, mode="nearest")
    # From outside the pile inward: outside is above a plate, and below a foot.
    found = crossings(*((strip, depth) if rough.kind == "plate" else (strip[::-1], depth[::-1])))
    seen = np.isfinite(found)
    if seen.sum() < 8:
        # There is no edge there: the rough line is used, to a pixel of the mask.
        return replace(start, slope_error=scale / width, offset_error=scale)
    fitted = _fitted(x[seen], (y[0] - depth[0])[seen] + found[seen], rough.kind, start.left, start.right)
    return replace(fitted, above_deg=rough.above_deg)


def given_base_line(left: float, right: float, columns: int) -> BaseLine:
    """The line through y = ``left`` and ``right`` [px] at the left and the right edge of ``columns`` columns."""
    slope = (right - left) / max(columns - 1, 1)
    return BaseLine(left, slope, 0.0, 0.0, "given", 0.0, columns - 1.0)


def check_tilt(line: BaseLine) -> None:
    """NotAPile if the picture is turned so far that the camera cannot have been level."""
    if abs(line.tilt_deg) > MOST_TILT_DEG:
        raise NotAPile(
            Reason.TILTED_CAMERA,
            f"the base line slopes by {line.tilt_deg:+.1f}°; allowed: up to {MOST_TILT_DEG:g}°; level the camera, or "
            "state --baseline if the line found is wrong",
        )


def _edges(part: Image) -> tuple[Array, Array, Array]:
    """Columns of ``part``, and its upper and its lower edge there."""
    columns = np.flatnonzero(part.any(axis=0))
    tops = part.argmax(axis=0)[columns].astype(np.float64) - 0.5
    bottoms = part.shape[0] - part[::-1].argmax(axis=0)[columns] - 0.5
    return columns.astype(np.float64), tops, bottoms


def _shoulders(x: Array, tops: Array, bottoms: Array, across: bool) -> BaseLine | None:
    """The line through the tops of both ends, if these are level stretches of one line; None otherwise.

    ``across``: whether they go on beyond both sides of the picture, like a plate, which a lens may bend.
    """
    n = max(5, round(SHOULDER * x.size))
    if x.size < 6 * n:
        return None
    ends = np.r_[0:n, x.size - n : x.size]
    slope, offset = np.polyfit(x[ends], tops[ends], 1)
    own = [np.polyfit(x[side], tops[side], 1)[0] for side in (slice(0, n), slice(-n, None))]
    misses = np.abs(tops[ends] - slope * x[ends] - offset)
    # A level stretch deviates by pixel steps and noise; the flanks' feet slope in opposite directions.
    level = (
        np.median(misses) < 1.0 and np.percentile(misses, 90) < 2.5 and abs(own[0] - own[1]) < SLOPES[across] + 0.5 / n
    )
    thick = np.median((bottoms - tops)[ends]) >= 3.0
    if not (level and thick):
        return None
    return BaseLine(float(offset), float(slope), 0.0, 0.0, "plate", float(x[0]), float(x[-1]))


def _foot(x: Array, bottoms: Array) -> BaseLine:
    inner = slice(round(INNER * x.size), x.size - round(INNER * x.size))
    if x[inner].size < 5:
        raise NotAPile(Reason.TOO_SMALL, f"the silhouette is only {x.size} pixels wide in the reduced picture")
    fitted = _fitted(x[inner], bottoms[inner], "foot", float(x[0]), float(x[-1]))
    return replace(fitted, above_deg=_above_deg(x, bottoms))


def _above_deg(x: Array, bottoms: Array) -> float:
    """How far above the plate the camera may be (95 %): the near half of a round foot bulges downward by the sine of
    that angle times half its width. NotAPile if it is too far."""
    u = (x - x.mean()) / (0.5 * max(x[-1] - x[0], 1.0))
    inner = np.abs(u) < 1.0 - INNER
    # Near half of an ellipse: y = line + sag √(1 − u²).
    terms = np.stack([np.ones_like(u), u, np.sqrt(np.clip(1.0 - u * u, 0.0, None))], axis=1)[inner]
    coefficients = np.linalg.lstsq(terms, bottoms[inner], rcond=None)[0]
    straight = np.linalg.lstsq(terms[:, :2], bottoms[inner], rcond=None)[0]
    bent_miss = np.std(bottoms[inner] - terms @ coefficients)
    sag = float(coefficients[2] / (x[-1] - x[0]))
    if sag > MOST_SAG and bent_miss < 0.6 * np.std(bottoms[inner] - terms[:, :2] @ straight):
        degrees = np.degrees(np.arcsin(min(1.0, 2.0 * sag)))
        raise NotAPile(
            Reason.CAMERA_LOOKS_DOWN,
            f"the foot of the pile is curved by {sag:.0%} of its width, as when seen from {degrees:.0f}° above; "
            "lower the camera to the level of the plate",
        )
    alone = terms[:, 2] - terms[:, :2] @ np.linalg.lstsq(terms[:, :2], terms[:, 2], rcond=None)[0]
    miss = bottoms[inner] - terms @ coefficients
    n = max(4.0, min(inner.sum() / BLOCK, 1.0 + int(np.count_nonzero(np.diff(np.signbit(miss))))))
    error = np.hypot(bent_miss, 0.3) / np.sqrt(n) / float(np.std(alone)) / (x[-1] - x[0])
    return float(np.degrees(np.arcsin(min(2.0 * MOST_SAG, 2.0 * max(sag, 0.0) + 4.0 * error))))


def _fitted(x: Array, y: Array, kind: Kind, left: float, right: float) -> BaseLine:
    """Least squares, repeated without outliers; for a foot the lower half counts, as bodies touch the plate here and
    there and leave gaps above it."""
    keep = np.ones(x.size, dtype=bool)
    slope = offset = 0.0
    for _ in range(8):
        slope, offset = np.polyfit(x[keep], y[keep], 1)
        miss = y - slope * x - offset
        spread = 1.4826 * float(np.median(np.abs(miss[keep] - np.median(miss[keep]))))
        slack = max(1.5 * spread, 0.5)
        keep = (miss > -slack) & (miss < (3.0 * slack if kind == "foot" else slack))
        if keep.sum() < 5:
            break
    keep = keep if keep.sum() >= 5 else np.ones(x.size, dtype=bool)
    miss = y[keep] - slope * x[keep] - offset
    # Neighbouring columns deviate alike: at most as many are independent as the deviations change sign, and as there
    # are blocks of a JPEG.
    n = max(4, min(keep.sum() / BLOCK, 1 + int(np.count_nonzero(np.diff(np.signbit(miss - miss.mean()))))))
    across = float(np.std(x[keep])) or 1.0
    error = float(np.sqrt(np.mean(miss**2) + 0.1**2) / np.sqrt(n))
    return BaseLine(float(offset), float(slope), error / across, error, kind, left, right)


def crossings(into: Array, steps: Array) -> Array:
    """Place among ``steps`` (depths,) where each column of ``into`` first passes half-way; NaN where it never does.

    ``into`` (depths, columns) are grey levels from outside to inside. The levels of both sides are means over
    neighbouring columns.
    """
    edge = max(2, len(steps) // 6)
    width = max(3, into.shape[1] // 20)
    outside = ndimage.uniform_filter1d(into[:edge].mean(axis=0), width)
    inside = ndimage.uniform_filter1d(into[-edge:].mean(axis=0), width)
    if np.median(outside) < np.median(inside):
        into, outside, inside = -into, -outside, -inside
    half = 0.5 * (outside + inside)
    below = into < half
    k = below.argmax(axis=0)
    column = np.arange(into.shape[1])
    seen = below.any(axis=0) & (k > 0) & (outside > inside)
    before, after = into[np.maximum(k - 1, 0), column], into[k, column]
    part = (before - half) / np.where(seen, before - after, 1.0)
    place = steps[np.maximum(k - 1, 0)] + part * (steps[k] - steps[np.maximum(k - 1, 0)])
    return np.where(seen, place, np.nan)
