"""Supports of the pile's own tone under it, and bodies in its apex: a disc, a tray's rim, a dish; a funnel's tip.

In the silhouette they are one body with the pile, so that its base line is too low or its top too high. Both show in
how far the outline reaches at each height: on a body under the pile it leaps outward at one height on both sides, and
goes straight down from there; at a funnel's tip it keeps its width over a long stretch, and widens below.

In a silhouette a gable on a house is a pile on a block: nothing tells them apart, and it is cut in the same way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.silhouette import EIGHT_NEIGHBOURS

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

SHARP = 0.012
"""Share of the height; within twice as much the outline leaps from the pile to the end of the body under it."""
LEAP = 0.06
"""Smallest leap over how far the pile reaches there: a smaller one is that of bodies, or of a rounded foot."""
BOTH = 1.7
"""Multiple of that for the mean of both sides: the pile may stand near one end."""
SLACK = 3.0
"""Smallest leap in pixels of the picture."""
SIDE = (0.25, 0.8)
"""Shares of its height between which the side of a body under the pile goes straight down; that of bodies is round."""
UPRIGHT, LEAST_UPRIGHT = 0.07, 1.2
"""Largest growth there, over that height and in pixels of the picture: a sphere's side grows by 0.1 of it."""
LOWEST, HIGHEST = 0.05, 0.75
"""Shares of the height between which the top of a body under the pile lies."""
LEAST_HIGH = 10.0
"""Smallest height in pixels of the picture: a lower body cannot be told from a layer of bodies."""
EVEN = 0.15
"""Rise over run by which the top of a body under the pile may slope."""
CORNER = 0.08
"""Share of its height below its top at which the outline of a body under the pile is hardly narrower than at half its
height."""
SQUARE, BLURRED = 0.13, 1.9
"""Largest narrowing there, over its height and in pixels of the picture: values up to 0.10 and 1.9 were found."""
BALL = 0.27
"""A sphere narrows by 0.23 of its height, and a layer of similar bodies by 0.16 to 0.23: anything that narrows by more
is a rim that is seen from above."""
FLAT, ROUND = 1.0, 0.003
"""Pixels of the picture, and share of the height, by which the top may deviate from a line (root mean square)."""
NECK, STEADY = 1.25, 0.9
"""Width of the end of a tip over that where it is thinnest, and of its beginning over that."""
LEAST_NECK = 0.15
"""Smallest length of a tip over the height: a body that sticks out of the apex is shorter."""
LONGER = 1.5
"""Smallest length of a tip over its thickness: a body on the apex is about as high as it is wide; the tips found are
over three times as long."""
THINNEST = 0.3
"""Largest width of a tip over that of the pile."""
THIN, LONG = 0.15, 0.12
"""Share of the pile's height below which a rim's thickness lies, and of its width by which it sticks out at least, on
either side."""


@dataclass(frozen=True)
class Support:
    """The top of a body under the pile, in pixels of the outline: z = height + slope · (column + 1/2)."""

    height: float
    slope: float
    slope_error: float
    error: float
    """Standard error of its height."""
    left: float
    right: float
    """Ends of its top."""


def support_under(tops: Array, pixel: float) -> Support | None:
    """The body on which the pile of an outline of heights ``tops`` stands; None where the outline shows none.

    ``pixel``: number of the outline's pixels along one of the picture. A leap on one side only does not count, because
    bodies make such corners as well.
    """
    height = float(tops.max())
    apex = int(tops.argmax())
    reach = np.stack([_reach(tops[apex::-1], height), _reach(tops[apex:], height)])
    half = max(2, round(2.0 * pixel), round(SHARP * height))
    z = np.arange(round(max(LOWEST * height, LEAST_HIGH * pixel, half + 1)), round(HIGHEST * height))
    if z.size == 0 or height < 8 * half:
        return None
    over = np.minimum(z + half + round(0.2 * height), int(height) - 1)
    grown = (reach[:, z + half] - reach[:, over]) / np.maximum(over - z - half, 1)
    leap = reach[:, z - half] - reach[:, z + half] - 2.0 * half * 1.5 * grown
    low, high = (np.round(share * z).astype(np.int64) for share in SIDE)
    upright = reach[:, low] - reach[:, high] <= np.maximum(UPRIGHT * z, LEAST_UPRIGHT * pixel)
    size = leap / np.maximum(LEAP * reach[:, z + half], SLACK * pixel)
    size = np.where(upright, size, 0.0)
    both = np.flatnonzero((size.min(axis=0) >= 1.0) & (size.mean(axis=0) >= BOTH))
    # The highest one: supports under it are looked for in the next round, from there.
    for k in both[::-1]:
        found = _top(tops, apex, reach[:, z[k] + half], reach[:, z[k] - half], pixel)
        if found is not None and not _of_bodies(found, reach, pixel):
            best = k - int(size.min(axis=0)[max(0, k - 2 * half) : k + 1][::-1].argmax())
            return _top(tops, apex, reach[:, z[best] + half], reach[:, z[best] - half], pixel) or found
    return None


def _of_bodies(found: Support, reach: Array, pixel: float) -> bool:
    """Whether a corner of this top is as round as a body's: similar bodies in one layer end at one height as well.

    ``reach`` is that of the outline, per side and height.
    """
    for side, end in zip(reach, (found.left, found.right), strict=True):
        height = found.height + found.slope * end
        corner = side[round(0.5 * height)] - side[round((1.0 - CORNER) * height)]
        if max(SQUARE * height, BLURRED * pixel) < corner <= BALL * height:
            return True
    return False


def severed(part: Image) -> Image | None:
    """``part`` of a mask (row 0 on top) without the funnel or rod whose tip is in its apex; None without one."""
    rows = np.flatnonzero(part.any(axis=1))
    left, right = part.argmax(axis=1)[rows], part.shape[1] - 1 - part[:, ::-1].argmax(axis=1)[rows]
    width = (right - left + 1).astype(np.float64)
    widest = int(width[rows.size // 4 :].argmax()) + rows.size // 4
    long = max(4, round(LEAST_NECK * rows.size))
    # Over this height a cone narrows by a tenth of its width; a tip does not.
    tip = np.flatnonzero((width[:-long] >= STEADY * width[long:]) & (width[long:] <= THINNEST * width[widest])) + long
    tip = tip[tip < widest]
    if tip.size == 0:
        return None
    neck = width[tip[-1] - long : tip[-1] + 1].min()
    last = int(np.flatnonzero(width[:widest] <= NECK * neck)[-1])
    if last + 8 > rows.size or last < LONGER * neck:
        return None
    cut = part.copy()
    cut[: rows[last] + 1] = False
    return cut


def rimless(part: Image) -> Image:
    """``part`` of a mask (row 0 on top) without a glass dish's rim: thin bars that stick out of both sides, with
    nothing directly under them."""
    rows = np.flatnonzero(part.any(axis=1))
    body = ndimage.binary_opening(part, np.ones((max(3, round(THIN * rows.size)), 1), dtype=bool))
    columns = np.flatnonzero(body.any(axis=0))
    if columns.size < 8:
        return part
    slope, offset = np.polyfit(columns, part.shape[0] - 1.0 - body[::-1].argmax(axis=0)[columns], 1)
    labels, _ = ndimage.label(part & ~body, structure=EIGHT_NEIGHBOURS)
    cut, sides = part.copy(), set()
    for k, where in enumerate(ndimage.find_objects(labels), start=1):
        y, x = np.nonzero(labels[where] == k)
        y, x = y + where[0].start, x + where[1].start
        thick = y.size / (np.ptp(x) + 1.0)
        over_foot = float((slope * x + offset - y).mean()) - 0.5 * thick
        if np.ptp(x) >= LONG * columns.size and over_foot > max(2.0, 0.5 * thick):
            cut[y, x] = False
            sides.add(x.mean() > columns.mean())
    return cut if len(sides) == 2 else part


def _reach(tops: Array, height: float) -> Array:
    """Columns from the first of ``tops`` to the last one that is so high, per height 0, 1, …, shape (height,)."""
    envelope = np.maximum.accumulate(tops[::-1])[::-1]
    return np.searchsorted(-envelope, -np.arange(int(height), dtype=np.float64), side="right").astype(np.float64) - 1.0


def _top(tops: Array, apex: int, inner: Array, outer: Array, pixel: float) -> Support | None:
    """The line through the tops of the columns between ``inner`` and ``outer`` reach (left, right); None if they are
    not on a line: bodies are round."""
    blur = round(2.0 * pixel)
    left = np.arange(apex - int(outer[0]) + blur, apex - int(inner[0]) - blur)
    right = np.arange(apex + int(inner[1]) + blur + 1, apex + int(outer[1]) - blur + 1)
    if min(left.size, right.size) < 3:
        return None
    columns = np.concatenate([left, right])
    slope, height = np.polyfit(columns + 0.5, tops[columns], 1)
    miss = tops[columns] - slope * (columns + 0.5) - height
    if abs(slope) > EVEN or float(np.sqrt(np.mean(miss**2))) > max(FLAT * pixel, ROUND * float(tops.max())):
        return None
    error = float(np.sqrt(np.mean(miss**2) + 0.25) / np.sqrt(max(4.0, columns.size / 8.0)))
    ends = float(apex - outer[0]), float(apex + outer[1])
    return Support(float(height), float(slope), error / float(np.std(columns)), error, *ends)
