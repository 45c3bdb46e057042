"""What stands out from the backdrop: masks at a few thresholds, darker and lighter, and the parts that they fall into.

A picture may hold a pile, a plate and a shadow of different grey. Otsu's threshold (1979) splits what stands out in
two, and each of the halves in two again; which of these masks has the pile's edge is decided by how sharp it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.silhouette import EIGHT_NEIGHBOURS
from solver.photograph.illumination import Illumination

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

LEAST_CONTRAST = 8.0
"""Grey levels between backdrop and threshold."""
LEAST_SIGNAL = 4.0
"""The same in standard deviations of the noise."""
LEAST_AREA = 0.002
"""Share of the picture that a pile covers at least."""
BINS = 256


@dataclass(frozen=True, eq=False)
class Candidate:
    """A part of a mask that may be the pile. Arrays have row 0 on top."""

    sign: int
    """1: darker than the backdrop, -1: lighter."""
    part: Image
    others: tuple[Image, ...]
    """Further parts of the same mask that do not hang from the top, largest first."""


def candidates(grey: Array, light: Illumination) -> Iterator[Candidate]:
    """Parts that may be the pile, from every sensible mask."""
    for sign in (1, -1):
        excess = np.clip(sign * (light.surface - grey), 0.0, None)
        for threshold in thresholds(excess):
            if threshold >= max(LEAST_CONTRAST, LEAST_SIGNAL * light.noise):
                parts = standing_parts(excess > threshold)
                if parts:
                    yield Candidate(sign, parts[0], tuple(parts[1:]))


def stands_out(grey: Array, light: Illumination) -> bool:
    """True if anything but noise differs from the backdrop."""
    smooth = ndimage.gaussian_filter(np.abs(grey - light.surface), 2.0)
    limit = max(LEAST_CONTRAST, LEAST_SIGNAL * light.noise)
    return bool((smooth > limit).mean() > LEAST_AREA)


def thresholds(excess: Array) -> list[float]:
    """Otsu's threshold of ``excess``, and those of what lies below and above it."""
    middle = otsu(excess)
    found = [middle, otsu(excess[excess <= middle]), otsu(excess[excess > middle])]
    return [threshold for threshold in found if np.isfinite(threshold)]


def otsu(values: Array) -> float:
    """The threshold that parts ``values`` with the greatest variance between the parts (Otsu 1979); NaN for a constant.

    Of thresholds that are equally good the middle one, so that it lies half-way across an empty stretch.
    """
    if values.size == 0 or values.min() == values.max():
        return float("nan")
    count, edges = np.histogram(values, bins=BINS)
    middle = 0.5 * (edges[:-1] + edges[1:])
    below = np.cumsum(count)[:-1].astype(np.float64)
    above = values.size - below
    sums = np.cumsum(count * middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        between = below * above * (sums[:-1] / below - (sums[-1] - sums[:-1]) / above) ** 2
    best = np.flatnonzero(between >= np.nanmax(between) * (1.0 - 1e-9))
    return float(edges[1:-1][best].mean())


def standing_parts(mask: Image) -> list[Image]:
    """Connected parts of ``mask`` as large as a pile, largest first, without what hangs from the top (a funnel)."""
    labels, n = ndimage.label(mask, structure=EIGHT_NEIGHBOURS)
    if n == 0:
        return []
    area = np.bincount(labels.ravel())
    area[0] = 0
    hanging = np.unique(labels[0])
    large = [k for k in np.argsort(area)[::-1] if area[k] >= LEAST_AREA * mask.size]
    standing = [k for k in large if k not in hanging]
    # If only something that reaches the top is left, it is a pile that is cut there.
    return [labels == k for k in (standing or large)]
