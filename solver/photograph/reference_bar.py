"""A bar of known length in the picture: the one part that fills a long rectangle.

From the second moments of a part's pixels: a rectangle of length L and width W has variances L²/12 and W²/12 along its
axes, so that L, W and the share of L · W that is covered follow without its outline. Its ends are then placed in the
picture itself, where the grey along its middle is half-way between the bar and what lies beyond that end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.silhouette import EIGHT_NEIGHBOURS
from solver.photograph.backdrop import LEAST_CONTRAST, LEAST_SIGNAL, illumination, thresholds
from solver.photograph.clearest import ROUGH, reduced_grey
from solver.photograph.picture import NotAPile, Picture, Reason

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

LEAST_ASPECT = 4.0
LEAST_LENGTH = 0.06
"""Smallest length of the bar, over the picture's longest side."""
FILLED = (0.95, 1.03)
"""Covered share of the rectangle of these moments: 1 for a rectangle, π/3 = 1.05 for an ellipse, 0.87 a triangle."""


@dataclass(frozen=True)
class Bar:
    """A rectangle in the reduced picture [px]."""

    length: float
    width: float
    x: float
    y: float
    along: tuple[float, float]
    """Unit vector of its length (y down)."""
    sharpness: float
    """Change of grey per pixel at its rim."""


def reference_pixels(picture: Picture) -> float:
    """Length [px of the picture] of the one bar that it shows; NotAPile if there is none, or more than one."""
    scale = max(max(picture.grey.shape) / ROUGH, 1.0)
    grey = ndimage.gaussian_filter(reduced_grey(picture.grey, scale), 0.8)
    bars = bars_in(grey)
    if len(bars) != 1:
        raise NotAPile(
            Reason.NO_SCALE,
            f"{len(bars) or 'no'} straight bar{'s' * (len(bars) != 1)} stand out; exactly one is needed, at least "
            f"{LEAST_ASPECT:g} times as long as wide, apart from pile and frame; or state its ends by --reference",
        )
    return _between_ends(picture.grey.astype(np.float64), bars[0], scale) * picture.reduced


def bars_in(grey: Array) -> list[Bar]:
    """Every bar in ``grey``, from the mask that shows it sharpest: a bar together with its shadow is a bar as well."""
    light = illumination(grey)
    change = ndimage.gaussian_gradient_magnitude(grey, 1.0)
    found: list[Bar] = []
    for sign in (1, -1):
        excess = np.clip(sign * (light.surface - grey), 0.0, None)
        for threshold in thresholds(excess):
            if threshold < max(LEAST_CONTRAST, LEAST_SIGNAL * light.noise):
                continue
            found += _bars(excess > threshold, change)
    separate: list[Bar] = []
    for bar in sorted(found, key=lambda bar: -bar.sharpness):
        if not any(_same(bar, other) for other in separate):
            separate.append(bar)
    return separate


def _same(one: Bar, other: Bar) -> bool:
    """True if both are at about the same place, offset sideways by less than their widths."""
    x, y = one.x - other.x, one.y - other.y
    along, across = x * other.along[0] + y * other.along[1], y * other.along[0] - x * other.along[1]
    return abs(along) < 0.25 * other.length and abs(across) < one.width + other.width


def _bars(mask: Image, change: Array) -> list[Bar]:
    labels, _ = ndimage.label(mask, structure=EIGHT_NEIGHBOURS)
    at_frame = set(np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]]).tolist())
    found = []
    for k, where in enumerate(ndimage.find_objects(labels), start=1):
        rows, columns = np.nonzero(labels[where] == k)
        if k in at_frame or max(np.ptp(rows), np.ptp(columns)) < LEAST_LENGTH * max(mask.shape):
            continue
        variance, axes = np.linalg.eigh(np.cov(np.stack([columns, rows]), bias=True))
        width, length = np.sqrt(12.0 * np.maximum(variance, 1e-9))
        if length >= LEAST_ASPECT * width and FILLED[0] <= rows.size / (length * width) <= FILLED[1]:
            part = labels[where] == k
            rim = part & ~ndimage.binary_erosion(part)
            found.append(
                Bar(
                    float(length),
                    float(width),
                    float(columns.mean() + where[1].start),
                    float(rows.mean() + where[0].start),
                    (float(axes[0, 1]), float(axes[1, 1])),
                    float(change[where][rim].mean()),
                )
            )
    return found


def _between_ends(grey: Array, bar: Bar, scale: float) -> float:
    """Distance of the ends of ``bar`` [pixels of ``grey``], which has ``scale`` of them along one of the bar's."""
    half, width = 0.5 * bar.length * scale, bar.width * scale
    t = np.arange(-half - 6.0 * scale, half + 6.0 * scale, 0.25)
    across = np.linspace(-0.25, 0.25, 5)[:, None] * width
    x = (bar.x + 0.5) * scale - 0.5 + bar.along[0] * t - bar.along[1] * across
    y = (bar.y + 0.5) * scale - 0.5 + bar.along[1] * t + bar.along[0] * across
    profile = ndimage.map_coordinates(grey, [y, x], order=1, mode="nearest").mean(axis=0)
    ends = []
    for direction in (-1, 1):
        out = direction * t - half
        inside = float(np.median(profile[(out < -3.0 * scale) & (out > -0.3 * half)]))
        outside = float(np.median(profile[out > 3.0 * scale]))
        share = (profile - outside) / (inside - outside)
        near = (np.abs(out) <= 3.0 * scale) & (share >= 0.5)
        ends.append(float(out[near].max()) if near.any() else 0.0)
    # These are the last places inside; the edge lies half a step further on.
    return 2.0 * half + sum(ends) + 0.25
