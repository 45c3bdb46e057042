"""Distortion of the picture by the lens, found from the base line, which is straight; and the picture without it.

Radial distortion of the first order (Brown 1966): a place at the distance r from the middle of the picture is seen at
r (1 + k r²), r over half the diagonal; k < 0 is a barrel, k > 0 a pincushion. A straight line that passes the middle
at the distance a bows by a k r², so that k is known better the farther the base line is from the middle and the longer
it shows; a line through the middle stays straight with any lens.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.photograph.base_line import REACH, BaseLine, crossings
from solver.photograph.picture import Picture

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

UNSEEN = 0.02
"""Standard deviation of k if the base line does not tell it."""
SURE = 5.0
"""Number of standard errors from which k is taken out of the picture."""
LEAST = 0.008
"""Smallest k that is taken out of the picture."""
MOST = 0.25
"""k beyond which it is not a lens that bends the base line."""
STEEP = 0.12
"""Rise over run of the plate's edge at which the pile begins."""
INNER = 0.10
"""Share of a foot at either end where the pile is too thin to show it."""
BLOCK = 8.0
FOLD = 1.5
"""r over 1 + k r² times it where 3 k r² = -1."""


@dataclass(frozen=True)
class Bend:
    """What the base line tells of the lens."""

    k: float
    error: float
    """Standard error of ``k``."""

    @property
    def sure(self) -> bool:
        """Whether the bend is to be taken out of the picture."""
        return LEAST <= abs(self.k) <= MOST and abs(self.k) >= SURE * self.error

    @property
    def left_over(self) -> float:
        """Standard deviation of k of a picture from which nothing is taken out."""
        return float(min(np.hypot(self.k, self.error), UNSEEN))


UNKNOWN = Bend(0.0, float("inf"))


def straight(x: Array, y: Array, k: float) -> tuple[Array, Array]:
    """Places without the bend of a lens, from places as seen; both from the middle, over half the diagonal."""
    share = np.ones_like(x)
    for _ in range(50):
        # A barrel of this order folds back at 3 k r² = -1, farther out than a lens can show: it is cut off there.
        share = 1.0 / np.maximum(1.0 + k * (x * x + y * y) * share * share, 1.0 / FOLD)
    return x * share, y * share


def bent(x: Array, y: Array, k: float) -> tuple[Array, Array]:
    """The inverse of :func:`straight`."""
    share = 1.0 + k * (x * x + y * y)
    return x * share, y * share


def centred(x: Array, y: Array, shape: tuple[int, ...]) -> tuple[Array, Array, float]:
    """Pixels of a picture of ``shape`` (rows, columns) from its middle over half its diagonal, and that [px]."""
    half = 0.5 * float(np.hypot(shape[0], shape[1]))
    return (x - 0.5 * (shape[1] - 1)) / half, (y - 0.5 * (shape[0] - 1)) / half, half


def straightened(picture: Picture, k: float) -> Picture:
    """``picture`` without the bend ``k``."""
    shape = picture.grey.shape
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    u, v, half = centred(x, y, shape)
    u, v = bent(u, v, k)
    places = [v * half + 0.5 * (shape[0] - 1), u * half + 0.5 * (shape[1] - 1)]
    grey = ndimage.map_coordinates(picture.grey, places, order=1, mode="nearest")
    return replace(picture, grey=grey.astype(np.float32))


def bend_of(grey: Array, part: Image, line: BaseLine, scale: float) -> Bend:
    """The bend that the plate's edge beside the pile shows, or the foot of the pile.

    ``part`` is of a mask with ``scale`` pixels of ``grey`` along one of its own.
    """
    columns = np.flatnonzero(part.any(axis=0))
    if line.kind == "foot":
        middles = (columns + 0.5) * scale - 0.5
        columns = columns[(middles >= line.left - 0.5) & (middles <= line.right + 0.5)]
    if columns.size < 40:
        return UNKNOWN
    x = columns.astype(np.float64)
    if line.kind == "plate":
        edge = part.argmax(axis=0)[columns] - 0.5
        kept = _beside(edge - line.slope * x)
    else:
        edge = part.shape[0] - part[::-1].argmax(axis=0)[columns] - 0.5
        kept = np.zeros(x.size, dtype=bool)
        kept[round(INNER * x.size) : x.size - round(INNER * x.size)] = True
    if kept.sum() < 20:
        return UNKNOWN
    rough = ndimage.median_filter(edge, 5, mode="nearest")
    places = np.arange(x[0] * scale, x[-1] * scale)
    at = (places + 0.5) / scale - 0.5
    shown = np.interp(at, x, kept.astype(float)) > 0.99
    places, start = places[shown], (np.interp(at, x, rough)[shown] + 0.5) * scale - 0.5
    depth = np.arange(-REACH * scale, REACH * scale + 0.5, 0.5)
    strip = ndimage.map_coordinates(
        grey, [start + depth[:, None], np.broadcast_to(places, (depth.size, places.size))], order=1, mode="nearest"
    )
    found = crossings(*((strip, depth) if line.kind == "plate" else (strip[::-1], depth[::-1])))
    seen = np.isfinite(found)
    if seen.sum() < 40:
        return UNKNOWN
    return _fitted(*centred(places[seen], (start + found)[seen], grey.shape), line.kind == "foot")


def _beside(edge: Array) -> Image:
    """Columns of a plate's ``edge`` from either end up to the pile, where it begins to rise (y down)."""
    kept = np.zeros(edge.size, dtype=bool)
    near = max(4, edge.size // 60)
    for step in (1, -1):
        own = edge[::step]
        rise = own[:-near] - own[near:]
        begins = np.flatnonzero(rise > STEEP * near + 1.0)
        stop = int(begins[0]) - near if begins.size else edge.size
        kept[::step][: max(0, min(stop, edge.size // 2))] = True
    return kept


def _fitted(x: Array, y: Array, half: float, foot: bool) -> Bend:
    """k of the straight line that is seen through x, y, by repeated least squares.

    With a small change dk of k a straight line v = a + b u is seen as v = a + b u + dk r² (v - b u).
    """
    k = slope = 0.0
    keep = np.ones(x.size, dtype=bool)
    for _ in range(10):
        u, v = straight(x, y, k)
        terms = np.stack([np.ones_like(u), u, (u * u + v * v) * (v - slope * u)], axis=1)
        coefficients = np.linalg.lstsq(terms[keep], v[keep], rcond=None)[0]
        slope = float(coefficients[1])
        k = float(np.clip(k + coefficients[2], -0.5, 0.5))
        miss = v - terms @ coefficients
        spread = 1.4826 * float(np.median(np.abs(miss[keep] - np.median(miss[keep]))))
        keep = np.abs(miss) <= max(3.0 * spread, 0.5 / half)
        if keep.sum() < 20:
            return UNKNOWN
    u, v = straight(x, y, k)
    lever = (u * u + v * v) * (v - slope * u)
    line = np.stack([np.ones_like(u), u], axis=1)[keep]
    alone = lever[keep] - line @ np.linalg.lstsq(line, lever[keep], rcond=None)[0]
    miss = v[keep] - line @ np.linalg.lstsq(line, v[keep], rcond=None)[0]
    n = max(4.0, min(keep.sum() / BLOCK, 1.0 + int(np.count_nonzero(np.diff(np.signbit(miss))))))
    error = float(np.sqrt(np.mean(miss**2) + (0.1 / half) ** 2) / np.sqrt(n) / max(float(np.std(alone)), 1e-12))
    if foot and _round(x[keep], y[keep]) < float(np.std(miss)):
        # As round as a foot that is seen from above: which of the two it is remains open.
        error = max(error, abs(k))
    return Bend(k, error)


def _round(x: Array, y: Array) -> float:
    """Standard deviation of y about the near half of an ellipse over x."""
    t = (x - x.mean()) / (np.ptp(x) / (2.0 - 4.0 * INNER))
    terms = np.stack([np.ones_like(t), t, np.sqrt(np.clip(1.0 - t * t, 0.0, None))], axis=1)
    return float(np.std(y - terms @ np.linalg.lstsq(terms, y, rcond=None)[0]))
