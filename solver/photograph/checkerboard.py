"""How far a lens bends pictures, by the corners of a printed checkerboard that the same camera took.

Where four fields meet, the smoothed grey level has a saddle: its second derivatives have fxy² − fxx fyy > 0, largest at
the corner, whose place between pixels is where both first derivatives vanish (two Newton steps). Starting from the
corner in the middle, each neighbour is looked for where the step from the last one leads, so that every corner gets its
row and column. A lens without distortion shows a plane board by a homography (eight numbers); a lens with distortion
adds k of `lens.py` (Brown 1966, first order, about the middle of the picture) as the ninth. They are fitted by least
squares over all corners.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage, optimize

from solver.photograph.clearest import reduced_grey
from solver.photograph.lens import MOST, Bend, bent, centred
from solver.photograph.picture import PhotographError, Picture

Array = npt.NDArray[np.float64]

SEARCHED = 1200
"""Longest side of the picture in which corners are looked for [px]."""
BLUR = 2.0
"""Standard deviation of the smoothing [px of that picture]."""
STRONG = 0.25
"""Smallest strength of a corner, over that of the last of the strongest ``FEWEST`` corners."""
OPPOSITE, AROUND = 0.5, 5.0
"""Smallest correlation of the grey levels around a corner with those opposite, and radius of that ring [px]: at a
corner of the board itself, where one field is alone, it is negative."""
APART = 7
"""Side of the square in which a peak is the largest [px]."""
NEAR = 0.3
"""Largest deviation of the next corner from its expected place, over the step between corners."""
FEWEST = 20
"""Smallest number of corners of a grid."""
LEAST_REACH = 0.5
"""Smallest distance of the outermost corners from the middle of the picture, over half the diagonal: the bend grows
with r²."""
MOST_MISS = 2.0
"""Largest deviation of the corners from their places [px] (root mean square): beyond it the board is not plane, or is
no board."""


@dataclass(frozen=True)
class Board:
    """What a picture of a checkerboard tells."""

    name: str
    """Name of the picture."""
    bend: Bend
    corners: int
    miss: float
    """Root mean square deviation of the corners from the places of a plane board [px of the picture]."""
    shape: float
    """Columns of the picture over its rows."""


def board_of(picture: Picture) -> Board:
    """The lens by the checkerboard in ``picture``; PhotographError, in one line, if it shows none."""
    scale = max(max(picture.grey.shape) / SEARCHED, 1.0)
    grey = reduced_grey(picture.grey, scale)
    places, indices = _grid(_corners(grey))
    if len(places) < FEWEST:
        raise PhotographError(
            f"{picture.name}: no checkerboard: {len(places)} corners of a grid found; at least {FEWEST} are needed; "
            "show the board large, flat and sharp"
        )
    x, y, half = centred(places[:, 0], places[:, 1], grey.shape)
    reach = float(np.hypot(x, y).max())
    if reach < LEAST_REACH:
        raise PhotographError(
            f"{picture.name}: the checkerboard reaches {reach:.0%} of the way from the middle of the picture to its "
            f"corner; at least {LEAST_REACH:.0%} is needed; go nearer"
        )
    k, error, miss = _fitted(np.stack([x, y], axis=1), indices)
    if miss * half > MOST_MISS or abs(k) > MOST:
        raise PhotographError(
            f"{picture.name}: its {len(places)} corners deviate from those of a flat board by "
            f"{miss * half * scale:.1f} px (k = {k:+.2f}); lay the checkerboard flat, and show nothing else"
        )
    return Board(
        picture.name, Bend(k, error), len(places), miss * half * scale * picture.reduced, picture.width / picture.height
    )


def _corners(grey: Array) -> Array:
    """x, y of the saddles of ``grey``, shape (corners, 2)."""
    along_x, along_y = (ndimage.gaussian_filter(grey, BLUR, order=order) for order in ((0, 1), (1, 0)))
    xx, yy, xy = (ndimage.gaussian_filter(grey, BLUR, order=order) for order in ((0, 2), (2, 0), (1, 1)))
    saddle = xy * xy - xx * yy
    peak = (saddle == ndimage.maximum_filter(saddle, APART)) & (saddle > 0.0)
    if not peak.any():
        return np.empty((0, 2))
    strengths = saddle[peak]
    good = float(np.sort(strengths)[-min(strengths.size, FEWEST)])
    rows, columns = np.nonzero(peak & (saddle >= STRONG * good))
    x, y = columns.astype(np.float64), rows.astype(np.float64)
    for _ in range(2):
        gx, gy, a, b, c = (
            ndimage.map_coordinates(of, [y, x], order=3, mode="nearest") for of in (along_x, along_y, xx, xy, yy)
        )
        determinant = np.minimum(a * c - b * b, -1e-12)
        x = x - np.clip((c * gx - b * gy) / determinant, -1.0, 1.0)
        y = y - np.clip((a * gy - b * gx) / determinant, -1.0, 1.0)
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ring = [y + AROUND * np.sin(turn)[:, None], x + AROUND * np.cos(turn)[:, None]]
    levels = ndimage.map_coordinates(grey, ring, order=1, mode="nearest")
    levels = levels - levels.mean(axis=0)
    alike = (levels * np.roll(levels, 12, axis=0)).sum(axis=0) >= OPPOSITE * (levels**2).sum(axis=0)
    return np.stack([x, y], axis=1)[alike]


def _grid(corners: Array) -> tuple[Array, Array]:
    """Those of ``corners`` that are on one grid, and their columns and rows in it."""
    if len(corners) < 5:
        return np.empty((0, 2)), np.empty((0, 2))
    start = int(np.hypot(*(corners - np.median(corners, axis=0)).T).argmin())
    off = corners - corners[start]
    nearest = np.argsort(np.hypot(*off.T))[1:9]
    first = off[nearest[0]]
    # The other direction of the grid: the nearest of the near corners that is more across than along.
    across = np.abs(first[0] * off[nearest, 1] - first[1] * off[nearest, 0]) / np.hypot(*first)
    steep = across > 0.7 * np.hypot(*off[nearest].T)
    if not steep.any():
        return np.empty((0, 2)), np.empty((0, 2))
    steps = {start: (first, off[nearest[steep][0]])}
    found = {start: (0, 0)}
    taken = {(0, 0)}
    waiting = deque([start])
    while waiting:
        at = waiting.popleft()
        for axis in (0, 1):
            for sign in (1, -1):
                index = (found[at][0] + sign * (axis == 0), found[at][1] + sign * (axis == 1))
                step = sign * steps[at][axis]
                miss = np.hypot(*(corners - corners[at] - step).T)
                there = int(miss.argmin())
                if index in taken or there in found or miss[there] > NEAR * np.hypot(*step):
                    continue
                own = list(steps[at])
                own[axis] = sign * (corners[there] - corners[at])
                found[there], steps[there] = index, (own[0], own[1])
                taken.add(index)
                waiting.append(there)
    known = list(found)
    return corners[known], np.array([found[one] for one in known], dtype=np.float64)


def _fitted(places: Array, indices: Array) -> tuple[float, float, float]:
    """k, its standard error, and the root mean square deviation of the corners at ``places`` (from the middle, over
    half the diagonal); ``indices``: their columns and rows on the board."""
    middle, size = indices.mean(axis=0), float(np.abs(indices - indices.mean(axis=0)).max())
    board = (indices - middle) / size

    def misses(unknown: Array) -> Array:
        h = unknown[:8]
        depth = 1.0 + board @ h[6:8]
        u, v = (board @ h[0:2] + h[2]) / depth, (board @ h[3:5] + h[5]) / depth
        return np.concatenate([np.subtract(*pair) for pair in zip(bent(u, v, unknown[8]), places.T, strict=True)])

    flat = np.linalg.lstsq(np.column_stack([board, np.ones(len(board))]), places, rcond=None)[0]
    start = np.array([flat[0, 0], flat[1, 0], flat[2, 0], flat[0, 1], flat[1, 1], flat[2, 1], 0.0, 0.0, 0.0])
    fit = optimize.least_squares(misses, start, x_scale="jac")
    variance = float(np.sum(fit.fun**2)) / (fit.fun.size - start.size)
    covariance = np.linalg.inv(fit.jac.T @ fit.jac) * variance
    return float(fit.x[8]), float(np.sqrt(covariance[8, 8])), float(np.sqrt(2.0 * np.mean(fit.fun**2)))
