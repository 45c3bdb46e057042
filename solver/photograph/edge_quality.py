"""How the edge of a pile shows: its contrast, the noise, the width of the change, and how rough the outline is."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.outline import Outline
from solver.observables.repose import FLOOR, FlankLine
from solver.photograph.edge import Patch, Silhouettes
from solver.photograph.illumination import NORMAL
from solver.photograph.refusal import NotAPile, Reason

Array = npt.NDArray[np.float64]

SPAN = 0.06
"""Share of the height."""


def pixel_noise(grey: Array) -> float:
    """Standard deviation of a pixel of ``grey``, from second differences along the rows, which slanting light does not
    touch: median, so that edges and the pile do not count. Over one pixel and over eight, the block of a JPEG, within
    which its noise is smoothed away."""
    found = []
    for k in (1, 8):
        second = grey[:, k:-k] - 0.5 * (grey[:, : -2 * k] + grey[:, 2 * k :])
        found.append(NORMAL * float(np.median(np.abs(second))) / 1.5**0.5)
    return max(found)


def edge_contrast(patch: Patch, seen: Silhouettes, tops: Array) -> float:
    """Grey levels between both sides, median along the flanks."""
    columns = _flank_columns(tops)
    rows = np.clip(tops[columns].astype(np.int64) - 1, 0, patch.grey.shape[0] - 1)
    return float(np.median(np.abs(seen.inside - seen.outside)[rows, columns]))


def faintest(patch: Patch, seen: Silhouettes, tops: Array) -> float:
    """The same at its faintest stretch, a twentieth of the pile wide, from the top down to the ends of the window."""
    columns = np.flatnonzero(tops >= FLOOR * tops.max())
    share = max(3, columns.size // 20)
    faint = []
    for side in (columns[columns <= tops.argmax()][::-1], columns[columns >= tops.argmax()]):
        rows = np.clip(tops[side].astype(np.int64) - 1, 0, patch.grey.shape[0] - 1)
        contrast = np.abs(seen.inside - seen.outside)[rows, side]
        # At its very end the side of a pile may be a drop: the levels there are of what stands before and behind it.
        faint.append(float(ndimage.median_filter(contrast, share, mode="nearest").min()))
    return min(faint)


def edge_width(patch: Patch, tops: Array, difference: float) -> float:
    """Pixels of the patch over which the grey changes sides along the flanks: the ``difference`` between the middle of
    the pile and the backdrop, over the steepest change of the grey across the edge.

    The grey is averaged along the flanks at equal distance from the outline, and its change taken over ``SPAN`` of the
    height: the outline follows the noise of a hazy edge, which looks like a step there.
    """
    columns = _flank_columns(tops)
    span = max(1, round(SPAN * float(tops.max())))
    reach = np.arange(-2 * span, 2 * span + 1)
    rows = np.clip(tops[columns].astype(np.int64)[None, :] + reach[:, None], 0, patch.grey.shape[0] - 1)
    profile = patch.grey[rows, columns].mean(axis=1)
    return difference * span / max(float(np.abs(profile[span:] - profile[:-span]).max()), 1e-9)


def roughness(outline: Outline, flank: FlankLine | None) -> float:
    """Root mean square distance, across the line, of the outline from ``flank`` within its window."""
    if flank is None:
        return 0.0
    low, high = sorted(flank.u)
    inside = (outline.u >= low) & (outline.u <= high)
    (u_in, u_out), (z_in, z_out) = flank.u, flank.z
    line = z_in + (z_out - z_in) / (u_out - u_in) * (outline.u[inside] - u_in)
    return float(np.sqrt(np.mean((outline.top[inside] - line) ** 2)) * np.cos(np.arctan(flank.slope)))


def _flank_columns(tops: Array) -> npt.NDArray[np.intp]:
    columns = np.flatnonzero((tops > 0.2 * tops.max()) & (tops < 0.95 * tops.max()))
    if columns.size == 0:
        raise NotAPile(Reason.NO_FLANK, "what stands out has no slope on either side")
    return columns
