"""A bar of known length in the picture: the one part that fills a long rectangle.

From the second moments of a part's pixels: a rectangle of length L and width W has variances L²/12 and W²/12 along its
axes, so that L, W and the share of L · W that is covered follow without its outline.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.silhouette import EIGHT_NEIGHBOURS
from solver.photograph.clearest import ROUGH, reduced_grey
from solver.photograph.illumination import illumination
from solver.photograph.parts import LEAST_CONTRAST, LEAST_SIGNAL, thresholds
from solver.photograph.picture import Picture
from solver.photograph.refusal import NotAPile, Reason

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

LEAST_ASPECT = 4.0
LEAST_LENGTH = 0.06
"""Of the picture's longest side."""
FILLED = (0.95, 1.03)
"""Covered share of the rectangle of these moments: 1 of a rectangle, π/3 = 1.05 of an ellipse, 0.87 of a triangle."""


@dataclass(frozen=True)
class Bar:
    """A rectangle in the reduced picture [px]."""

    length: float
    width: float
    x: float
    y: float


def reference_pixels(picture: Picture) -> float:
    """Length [px of the picture] of the one bar that it shows; NotAPile where there is none, or more than one."""
    scale = max(max(picture.grey.shape) / ROUGH, 1.0)
    grey = ndimage.gaussian_filter(reduced_grey(picture.grey, scale), 0.8)
    bars = bars_in(grey)
    if len(bars) != 1:
        raise NotAPile(
            Reason.NO_SCALE,
            f"{len(bars) or 'no'} straight bar{'s' * (len(bars) != 1)} stand out, one is needed: at least "
            f"{LEAST_ASPECT:g} times as long as wide, apart from pile and frame; or state its ends by --reference",
        )
    return bars[0].length * scale * picture.reduced


def bars_in(grey: Array) -> list[Bar]:
    """Every bar in ``grey``, in whichever mask it shows first."""
    light = illumination(grey)
    found: list[Bar] = []
    for sign in (1, -1):
        excess = np.clip(sign * (light.surface - grey), 0.0, None)
        for threshold in thresholds(excess):
            if threshold < max(LEAST_CONTRAST, LEAST_SIGNAL * light.noise):
                continue
            for bar in _bars(excess > threshold):
                if all(np.hypot(bar.x - other.x, bar.y - other.y) > 3.0 for other in found):
                    found.append(bar)
    return found


def _bars(mask: Image) -> list[Bar]:
    labels, _ = ndimage.label(mask, structure=EIGHT_NEIGHBOURS)
    at_frame = set(np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]]).tolist())
    found = []
    for k, where in enumerate(ndimage.find_objects(labels), start=1):
        rows, columns = np.nonzero(labels[where] == k)
        if k in at_frame or max(np.ptp(rows), np.ptp(columns)) < LEAST_LENGTH * max(mask.shape):
            continue
        variance, _ = np.linalg.eigh(np.cov(np.stack([columns, rows]), bias=True))
        width, length = np.sqrt(12.0 * np.maximum(variance, 1e-9))
        if length >= LEAST_ASPECT * width and FILLED[0] <= rows.size / (length * width) <= FILLED[1]:
            found.append(
                Bar(
                    float(length),
                    float(width),
                    float(columns.mean() + where[1].start),
                    float(rows.mean() + where[0].start),
                )
            )
    return found
