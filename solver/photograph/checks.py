"""Is it a pile, one pile, whole, and clearly seen? Each check either ends the reading with a reason or lets it pass."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.repose import FlankLine
from solver.photograph.base_line import BaseLine
from solver.photograph.picture import NotAPile, Reason

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

LEAST_HEIGHT = 12.0
"""Smallest height of a pile [pixels of the picture]."""
SECOND_HEAP = 0.35
"""Smallest height of a second heap, over that of the first."""
VALLEY, VALLEY_DEPTH = 0.08, 0.25
"""Smallest area of a valley between two heaps, over that of the outline, and smallest depth, over the lower top."""
SECOND_AREA = 0.10
STEEPEST_DEG, FLATTEST_DEG = 75.0, 2.0
LEAST_EDGE = 6.0
"""Smallest number of grey levels between both sides of the edge."""
WIDEST_EDGE = 0.25
FAINT = 0.3
"""Smallest contrast of the edge where it is faintest, over the usual contrast."""
MOST_BELOW = 0.1
"""Share of the height by which the flanks may go on below the base line."""
MOST_BEND_DEG = 4.0
"""Largest standard deviation of the slopes of the thirds of a flank, beyond that by the bodies."""
DRAWN_NOISE, DRAWN_SHARE, DRAWN_MISS = 0.05, 0.995, 0.45
"""A drawing: grey levels of noise, share of one grey level on either side, pixels by which the flanks miss a line."""
MOST_ROUGHNESS = 0.30
"""Root mean square distance of the outline from its line, over the height of the window: nothing heaped is rougher."""


def check_alone(part: Image, others: Sequence[Image], line: BaseLine) -> None:
    """NotAPile where another part of the mask stands beside ``part`` like a second pile."""
    height, area = _height(part, line), int(part.sum())
    for other in others:
        low = np.flatnonzero(other.any(axis=1))[-1] - line.at(np.flatnonzero(other.any(axis=0)).astype(float)).mean()
        stands = abs(low) < 0.25 * height
        if stands and other.sum() >= SECOND_AREA * area and _height(other, line) >= SECOND_HEAP * height:
            raise NotAPile(
                Reason.TWO_PILES,
                f"beside the largest silhouette is another with {other.sum() / area:.0%} of its area; show one pile",
            )


def check_uncut(part: Image, line: BaseLine) -> None:
    """NotAPile if the pile goes on beyond the frame: above its base line it must not touch the frame."""
    height = _height(part, line)
    columns = part.shape[1]
    margin = 0.08 * height
    for side, x in (("left", 0), ("right", columns - 1)):
        rows = np.flatnonzero(part[:, x])
        if rows.size and line.at(np.array([float(x)]))[0] - rows[0] > margin + 2.0:
            raise NotAPile(Reason.CUT_BY_FRAME, f"the pile reaches the {side} edge of the picture; show all of it")
    if part[0].any():
        raise NotAPile(Reason.CUT_BY_FRAME, "the pile reaches the upper edge of the picture; show all of it")


def check_one_heap(tops: Array) -> None:
    """NotAPile where an outline of heights ``tops`` has a valley as large as between two heaps: gaps between bodies are
    as deep, but narrow."""
    left, right = np.maximum.accumulate(tops), np.maximum.accumulate(tops[::-1])[::-1]
    lower = np.minimum(left, right)
    labels, n = ndimage.label(lower - tops > 0.0)
    if n == 0:
        return
    valleys = np.arange(1, n + 1)
    missing = ndimage.sum_labels(lower - tops, labels, valleys)
    depth = ndimage.maximum((lower - tops) / np.maximum(lower, 1.0), labels, valleys)
    if ((missing > VALLEY * tops.sum()) & (depth > VALLEY_DEPTH)).any():
        raise NotAPile(Reason.TWO_PILES, "the outline has two tops with a valley between them; show one pile")


def check_size(height: float) -> None:
    """NotAPile for a pile of ``height`` [pixels of the picture] that is too small to be read."""
    if height < LEAST_HEIGHT:
        raise NotAPile(
            Reason.TOO_SMALL, f"the pile is {height:.0f} pixels high; at least {LEAST_HEIGHT:g} are needed; go nearer"
        )


def check_edge(contrast: float, faintest: float, noise: float) -> None:
    """NotAPile if both sides of the flanks differ by only ``contrast`` grey levels, or somewhere by ``faintest``."""
    if faintest < FAINT * contrast:
        raise NotAPile(
            Reason.NO_CLEAR_SILHOUETTE,
            f"part of the edge fades into the backdrop: its contrast is {faintest:.0f} of 255 grey levels, elsewhere "
            f"{contrast:.0f}; use an even backdrop and even light",
        )
    if contrast < max(LEAST_EDGE, 1.5 * noise):
        raise NotAPile(
            Reason.NO_CLEAR_SILHOUETTE,
            f"along the flanks pile and backdrop differ by {contrast:.0f} of 255 grey levels (noise {noise:.1f}); "
            "use a backdrop that stands out",
        )


def check_sharp(width: float, height: float) -> None:
    """NotAPile if the grey levels change over too large a ``width`` at the edge of a pile of ``height`` (same unit)."""
    if width > WIDEST_EDGE * height:
        raise NotAPile(
            Reason.NO_CLEAR_SILHOUETTE,
            f"the edge of the pile is blurred over {width / height:.0%} of its height; focus on the pile's middle",
        )


def check_flanks(
    lines: tuple[FlankLine | None, FlankLine | None], roughness: tuple[float, float], height: float
) -> tuple[FlankLine, FlankLine]:
    """Both flanks; NotAPile where one could not be fitted or is no slope of a pile."""
    for side, line, rough in zip(("left", "right"), lines, roughness, strict=True):
        if line is None:
            raise NotAPile(Reason.NO_FLANK, f"the {side} side has no slope between 20 % and 80 % of the height")
        if not FLATTEST_DEG <= line.angle_deg <= STEEPEST_DEG:
            raise NotAPile(
                Reason.NO_FLANK,
                f"the {side} side slopes by {line.angle_deg:.0f}°; allowed: {FLATTEST_DEG:g} … {STEEPEST_DEG:g}°",
            )
        if rough > MOST_ROUGHNESS * 0.6 * height:
            raise NotAPile(
                Reason.NO_FLANK,
                f"the {side} side is not a straight slope: it deviates from its fitted line by {rough / height:.0%} of "
                "the height",
            )
    left, right = lines
    assert left is not None
    assert right is not None
    return left, right


def check_below(share: float) -> None:
    """NotAPile where the flanks go on below the base line by ``share`` of the height."""
    if share > MOST_BELOW:
        raise NotAPile(
            Reason.CAMERA_LOOKS_DOWN,
            f"the flanks continue below the base line by at least {share:.0%} of the height: the plate is seen from "
            "above and its edge lies behind the pile; lower the camera to the level of the plate, or state --baseline",
        )


def check_bend(thirds_deg: Sequence[Sequence[float]], bend_deg: Sequence[float]) -> None:
    """NotAPile if a flank's thirds (left, right; each from below) differ by more than bodies and a natural bend."""
    for side, thirds, bend in zip(("left", "right"), thirds_deg, bend_deg, strict=True):
        if bend > MOST_BEND_DEG:
            lower, middle, upper = thirds
            cause = (
                "something lies under the pile, or its foot is spread out; state the pile's foot with --baseline"
                if abs(lower - middle) >= abs(upper - middle) or not np.isfinite(lower)
                else "the tip of a funnel or a round top; remove it, or show the flanks alone"
            )
            words = ", ".join("none" if not np.isfinite(one) else f"{one:.0f}°" for one in thirds)
            raise NotAPile(
                Reason.BENT_FLANK,
                f"the {side} flank has no single slope: {words} in its lower, middle and upper third, which the size "
                f"of the bodies does not explain; {cause}",
            )


def check_photographed(noise: float, inside: Array, outside: Array, roughness: float) -> None:
    """NotAPile for a drawing: two flat tones with no noise at all, and flanks (``roughness`` [px]) straight to a pixel.

    A photograph has noise, and one that was made black and white still has the outline of bodies.
    """
    flat = all(
        one.size > 0 and np.unique(one, return_counts=True)[1].max() >= DRAWN_SHARE * one.size
        for one in (inside, outside)
    )
    if noise <= DRAWN_NOISE and flat and roughness <= DRAWN_MISS:
        raise NotAPile(
            Reason.DRAWN,
            "each side of the edge has one grey level without noise, and the flanks are straight to a pixel: this is a "
            "drawing, not a photograph of a pile",
        )


def check_levels(shift_deg: float) -> None:
    """NotAPile if a flank that is found at one threshold cannot be read at the next (``shift_deg`` infinite)."""
    if not np.isfinite(shift_deg):
        raise NotAPile(
            Reason.NO_CLEAR_SILHOUETTE,
            "a flank is found at some grey thresholds only: the edge is blurred or in shadow",
        )


def _height(part: Image, line: BaseLine) -> float:
    """Height of the highest pixel above the line [pixels of the mask]."""
    columns = np.flatnonzero(part.any(axis=0))
    return float((line.at(columns.astype(float)) - part.argmax(axis=0)[columns]).max())
