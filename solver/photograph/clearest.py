"""Which part of which mask is the pile: the one that stands whole on a base line and has the sharpest flanks.

Masks are looked for in the picture reduced to ``ROUGH`` pixels: only their rough edge is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image as PillowImage
from scipy import ndimage

from solver.photograph import checks
from solver.photograph.backdrop import Candidate, Illumination, candidates, illumination, stands_out
from solver.photograph.base_line import BaseLine, check_tilt, rough_base_line
from solver.photograph.picture import NotAPile, Reason

Array = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]

IN_FRONT = 0.04
"""Share of a pile's width by which its foot lies below a plate's edge that is behind it."""
ROUGH = 600
"""Longest side of the reduced picture [px]."""


@dataclass(frozen=True, eq=False)
class Found:
    """A candidate on its base line, in the reduced picture."""

    candidate: Candidate
    line: BaseLine
    sharpness: float
    difference: float
    """Grey levels between the middle of the pile and the backdrop behind it."""


def find_pile(grey: npt.NDArray[np.float32], given: BaseLine | None) -> tuple[Found, float]:
    """The pile in ``grey``, roughly, and how many of its pixels lie along one of the mask; NotAPile without a pile.

    ``given``: the base line, if it is known.
    """
    scale = max(max(grey.shape) / ROUGH, 1.0)
    small = reduced_grey(grey, scale)
    light = illumination(small)
    if not stands_out(small, light):
        raise NotAPile(
            Reason.BLANK, f"nothing differs from the backdrop by more than its noise ({light.noise:.1f} grey levels)"
        )
    smooth = ndimage.gaussian_filter(small, 0.8)
    line = None if given is None else _in_mask(given, scale)
    return _clearest(small, light, list(candidates(smooth, illumination(smooth))), line), scale


def _clearest(small: Array, light: Illumination, found: Sequence[Candidate], given: BaseLine | None) -> Found:
    """The candidate with the sharpest flanks among those that stand.

    NotAPile if none does, with the reason of the largest, and whenever a foot shows that it is seen from above.
    """
    reasons: list[tuple[Bool, NotAPile]] = []
    standing: list[Found] = []
    for candidate in found:
        try:
            line = given or rough_base_line(candidate.part)
            check_tilt(line)
            checks.check_uncut(candidate.part, line)
            checks.check_alone(candidate.part, candidate.others, line)
            difference = float(np.median(np.abs(small - light.surface)[candidate.part]))
            standing.append(Found(candidate, line, _sharpness(small, candidate.part, line), difference))
        except NotAPile as reason:
            reasons.append((candidate.part, reason))
    best = max(standing, key=lambda one: one.sharpness, default=None)
    for part, why in reasons:
        if why.reason == Reason.CAMERA_LOOKS_DOWN and (best is None or _in_front(part, best)):
            raise why
    if best is not None:
        return best
    if reasons:
        raise max(reasons, key=lambda one: int(one[0].sum()))[1]
    raise NotAPile(
        Reason.NO_CLEAR_SILHOUETTE,
        "nothing connected stands out from the backdrop; use an even backdrop that differs in grey from the pile",
    )


def _in_front(part: Bool, best: Found) -> bool:
    """Whether the foot of ``part`` lies in front of the plate's edge on which the ``best`` part seems to stand."""
    columns = np.flatnonzero(part.any(axis=0))
    lowest = part.shape[0] - 1 - part[::-1].argmax(axis=0)[columns]
    below = lowest - best.line.at(columns.astype(np.float64))
    return best.line.kind == "plate" and float(below.max()) > IN_FRONT * columns.size


def _sharpness(small: Array, part: Bool, line: BaseLine) -> float:
    """Mean change of grey across the upper edge of ``part``, on the duller of its two sides."""
    columns = np.flatnonzero(part.any(axis=0))
    tops = part.argmax(axis=0)[columns]
    above = line.at(columns.astype(np.float64)) - tops
    apex = int(above.argmax())
    change = ndimage.gaussian_gradient_magnitude(small, 1.0)[tops, columns]
    flank = (above > 0.2 * above.max()) & (above < 0.95 * above.max())
    sides = [change[flank & side] for side in (np.arange(columns.size) < apex, np.arange(columns.size) > apex)]
    if any(side.size < 3 for side in sides):
        raise NotAPile(Reason.NO_FLANK, "the silhouette does not slope on both sides of its top")
    return min(float(np.median(side)) for side in sides)


def reduced_grey(grey: npt.NDArray[np.float32], scale: float) -> Array:
    """``grey`` with one pixel for ``scale`` × ``scale``."""
    if scale == 1.0:
        return grey.astype(np.float64)
    size = (max(1, round(grey.shape[1] / scale)), max(1, round(grey.shape[0] / scale)))
    return np.asarray(PillowImage.fromarray(grey).resize(size, PillowImage.Resampling.BOX), dtype=np.float64)


def _in_mask(line: BaseLine, scale: float) -> BaseLine:
    """``line`` in the pixels of the reduced picture."""
    offset = (line.offset + 0.5 - line.slope * 0.5) / scale - 0.5 + 0.5 * line.slope
    return BaseLine(offset, line.slope, 0.0, 0.0, "given", line.left / scale, line.right / scale)
