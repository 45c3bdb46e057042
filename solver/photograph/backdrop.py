"""The light on the backdrop, and what stands out from it: masks at a few thresholds, darker and lighter.

The light is a quadratic surface fitted to what surrounds the pile, with the noise about it. The fit starts from the
upper rim of the picture, where a whole pile cannot be, and grows downward over every pixel that follows the surface, so
that the thresholds need not deal with light that slants or falls off.

A picture may hold a pile, a plate and a shadow of different grey. Otsu's threshold (1979) splits what stands out in
two, and each of the halves in two again; the sharpness of the edge decides which of these masks, and which of its
parts, has the edge of the pile.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.silhouette import EIGHT_NEIGHBOURS
from solver.photograph.support import severed

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

DOWN_TO = (0.0, 0.0, 0.4, 0.55, 0.7, 0.85, 1.0, 1.0)
"""Share of the rows, from the top, over which the surface is fitted, round by round; 0: the rim alone."""
FEWEST_LEVELS = 4.0
"""Grey levels by which the backdrop may deviate from the surface, however little noise there is."""
NORMAL = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
LEAST_CONTRAST = 8.0
"""Smallest number of grey levels between backdrop and threshold."""
LEAST_SIGNAL = 4.0
"""The same in standard deviations of the noise."""
LEAST_AREA = 0.002
"""Smallest share of the picture that a pile covers."""
BINS = 256
CONSTANT = 1e-6
"""Range of grey levels below which they count as constant."""


@dataclass(frozen=True, eq=False)
class Illumination:
    """Grey levels of the backdrop, also where something stands before it."""

    surface: Array
    """Shape of the picture."""
    noise: float
    """Standard deviation of a pixel of the backdrop about the surface."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A part of a mask that may be the pile. Arrays have row 0 on top."""

    sign: int
    """1: darker than the backdrop, -1: lighter."""
    part: Image
    others: tuple[Image, ...]
    """Further parts of the same mask that do not hang from the top, largest first."""


def illumination(grey: Array) -> Illumination:
    """The backdrop of ``grey`` (0 … 255, row 0 on top)."""
    terms = _terms(grey.shape)
    flat, seen = grey.ravel(), _rim(grey.shape).ravel()
    surface = np.full(flat.shape, np.median(flat[seen]))
    rows = np.repeat(np.arange(grey.shape[0]) / grey.shape[0], grey.shape[1])
    scale = np.inf
    for round_, share in enumerate(DOWN_TO):
        residual = np.abs(flat - surface)
        # The initial constant cannot follow slanting light: every pixel of the rim counts in the first round.
        chosen = (seen | (rows < share)) & (residual <= max(3.0 * scale, FEWEST_LEVELS))
        k = 3 if round_ == 0 else terms.shape[1]
        coefficients = np.linalg.lstsq(terms[chosen, :k], flat[chosen], rcond=None)[0]
        surface = terms[:, :k] @ coefficients
        scale = NORMAL * float(np.median(np.abs(flat - surface)[chosen]))
    residual = np.abs(flat - surface)
    noise = NORMAL * float(np.median(residual[residual <= max(4.0 * scale, FEWEST_LEVELS)]))
    return Illumination(surface.reshape(grey.shape), noise)


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
    """The threshold that divides ``values`` with the greatest variance between the parts (Otsu 1979); NaN for a
    constant, even one with the rounding of a filter.

    Of equally good thresholds it is the middle one, so that it lies half-way across an empty stretch.
    """
    if values.size == 0 or float(np.ptp(values)) < CONSTANT:
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
    whole = [(labels == k, k in hanging) for k in large]
    cut = [(severed(part), part, hangs) for part, hangs in whole]
    # A pile whose apex a funnel touches hangs from the top with it.
    standing = [part if below is None else below for below, part, hangs in cut if below is not None or not hangs]
    # If all that is left reaches the top, it is a pile that is cut there.
    return standing or [part for part, _ in whole]


def _rim(shape: tuple[int, ...]) -> Image:
    """The upper sixth, and the sides of the upper half."""
    rim = np.zeros(shape, dtype=bool)
    side = max(2, shape[1] // 12)
    rim[: max(2, shape[0] // 6)] = True
    rim[: shape[0] // 2, :side] = rim[: shape[0] // 2, -side:] = True
    return rim


def _terms(shape: tuple[int, ...]) -> Array:
    y, x = np.meshgrid(np.linspace(-1, 1, shape[0]), np.linspace(-1, 1, shape[1]), indexing="ij")
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1).reshape(-1, 6)
