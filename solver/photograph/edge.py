"""The pile upright on its base line, and its silhouette at the place where grey is half-way between both sides.

The rough part of a mask shows within a few pixels where the edge is. There the mean grey levels just inside and just
outside are taken along the edge, and a pixel belongs to the pile if it is nearer to the inside (regions of local extent
as in Lankton & Tannenbaum 2008, here without a moving contour). A shadow or slanting light changes both means alike and
the half-way place little; noise and the texture of bodies cancel in the means.

How well the edge shows: its contrast, the noise, the width of the change, and how rough the outline is.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from solver.observables.repose import CEILING, FLOOR, FlankLine, Outline
from solver.observables.silhouette import largest_part
from solver.photograph.backdrop import NORMAL
from solver.photograph.base_line import BaseLine
from solver.photograph.picture import NotAPile, Reason

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

COLUMNS = 1000
"""Number of columns that a pile is resampled to if the picture has fewer."""
FOOT = 0.03
"""Share of the height above which the width of the pile is looked for."""
LEAST_COLUMNS = 5.0
"""Smallest width of a pile [pixels of the mask]."""
MARGIN = 0.1
"""Share of that width that is resampled on either side of it."""
BAND = 2.5
"""Half width of the band about the rough edge, in pixels of the mask."""
NEIGHBOURHOOD = 0.06
"""Side of the square, over the width of the patch, in which the means of both sides are taken."""
LEVELS = (0.35, 0.5, 0.65)
"""Levels between outside (0) and inside (1) at which the edge is placed: the middle one counts, the others show how
sharp it is."""
BELOW = (0.04, 0.09, 0.14, 0.19, 0.24)
"""Depths below the base line, over the height, between which continuing flanks are looked for."""
BESIDE = 5.0
"""Width of the strips on either side of a continuing flank [px]."""
LEAST_STRETCH = 4
SURE_BELOW, LEAST_BELOW = 4.0, 4.0
"""Smallest change of the grey across a continuing flank, in standard errors and in grey levels."""
NEAR_TOP = 0.95
"""Share of the height above which a pile is round."""
SPAN = 0.06
"""Share of the height over which the change of the grey across the edge is taken."""


@dataclass(frozen=True, eq=False)
class Patch:
    """The pile's surroundings resampled upright: row 0 on the base line, rows up, columns to the right."""

    grey: Array
    rough: Image
    """The part of the mask there, filled down to the base line."""
    step: float
    """Side of a pixel of the patch [pixels of the resampled picture]."""
    band: float
    """Half width of the band in which the edge lies [pixels of the patch]."""
    foot: tuple[float, float]
    """x, y in the resampled picture of the lower left corner of the patch."""
    along: tuple[float, float]
    """Unit vector of the columns in the resampled picture (y down)."""

    def place(self, u: Array, z: Array) -> tuple[Array, Array]:
        """x, y in the resampled picture of places ``u`` along the base line and ``z`` above it [px of the patch]."""
        x = self.foot[0] + self.step * (self.along[0] * u + self.along[1] * z)
        y = self.foot[1] + self.step * (self.along[1] * u - self.along[0] * z)
        return x, y


@dataclass(frozen=True, eq=False)
class Silhouettes:
    """The pile at each of ``LEVELS``, and how its edge shows."""

    images: tuple[Image, ...]
    inside: Array
    """Mean grey inside, near the edge, per pixel."""
    outside: Array


def upright(grey: Array, part: Image, line: BaseLine, scale: float) -> Patch:
    """``grey`` about the ``part`` of a mask that has 1/``scale`` of its resolution, above the base ``line``.

    NotAPile if almost nothing is there.
    """
    rows, columns = np.nonzero(part)
    # In the picture's own pixels: along the line, and up from it.
    along = np.array([1.0, line.slope]) / np.hypot(1.0, line.slope)
    up = np.array([along[1], -along[0]])
    place = np.stack([(columns + 0.5) * scale - 0.5, (rows + 0.5) * scale - 0.5 - line.offset])
    u, z = along @ place, up @ place
    top = max(float(z.max()), scale)
    # Not the plate's own edge, which a pixel of noise lifts above the line.
    above = z >= min(max(FOOT * top, 1.5 * scale), z.max())
    left, right = float(u[above].min()), float(u[above].max())
    if right - left < LEAST_COLUMNS * scale:
        raise NotAPile(Reason.NO_FLANK, "the silhouette above the base line is only a few pixels wide")
    margin = 8.0 * scale + MARGIN * (right - left)
    step = min(1.0, (right - left) / COLUMNS)
    n_columns = int(np.ceil((right - left + 2.0 * margin) / step))
    n_rows = max(4, int(np.ceil((top + 8.0 * scale) / step)))
    foot = np.array([0.0, line.offset]) + along * (left - margin)
    c, r = (np.arange(n_columns) + 0.5) * step, (np.arange(n_rows) + 0.5) * step
    x = foot[0] + along[0] * c[None, :] + up[0] * r[:, None]
    y = foot[1] + along[1] * c[None, :] + up[1] * r[:, None]
    patch = ndimage.map_coordinates(grey, [y, x], order=1, mode="nearest")
    there = [(y + 0.5) / scale - 0.5, (x + 0.5) / scale - 0.5]
    rough = ndimage.map_coordinates(part.astype(np.float32), there, order=1, mode="nearest") > 0.5
    # Below its topmost pixel a pile is full, whatever shines through between bodies.
    rough = np.logical_or.accumulate(rough[::-1], axis=0)[::-1]
    return Patch(
        patch, rough, step, BAND * scale / step, (float(foot[0]), float(foot[1])), (float(along[0]), float(along[1]))
    )


def silhouettes(patch: Patch, noise: float) -> Silhouettes:
    """The pile at each level; ``noise``: standard deviation of a pixel of the resampled picture."""
    depth = ndimage.distance_transform_edt(np.pad(patch.rough, ((1, 0), (0, 0)), mode="edge"))[1:]
    distance = np.where(patch.rough, depth, -ndimage.distance_transform_edt(~patch.rough))
    side = max(5, round(NEIGHBOURHOOD * patch.grey.shape[1]))
    # Beyond the blur of the edge, and of the foot as well, or a thin foot would seem paler than it is.
    within = ndimage.distance_transform_edt(np.pad(patch.rough, ((1, 0), (0, 0))))[1:]
    inside = _mean_where(patch.grey, (within > patch.band) & (within < side), side)
    outside = _mean_where(patch.grey, (distance < -patch.band) & (distance > -side), side)
    contrast = float(np.median(np.abs(inside - outside)[np.abs(distance) < patch.band]))
    smooth = ndimage.gaussian_filter(patch.grey, _blur(noise, contrast, patch.step))
    # 0 outside, 1 inside.
    gap = inside - outside
    gap = np.where(np.abs(gap) < 1.0, np.where(gap < 0.0, -1.0, 1.0), gap)
    share = (smooth - outside) / gap
    images = []
    for level in LEVELS:
        image = (distance > patch.band) | ((np.abs(distance) <= patch.band) & (share > level))
        images.append(largest_part(image))
    return Silhouettes(tuple(images), inside, outside)


def both_sides(patch: Patch) -> tuple[Array, Array]:
    """Grey levels of the pile and of what is about it, away from the edge."""
    depth = ndimage.distance_transform_edt(np.pad(patch.rough, ((1, 0), (0, 0))))[1:]
    off = ndimage.distance_transform_edt(~patch.rough)
    return patch.grey[depth > 2.0 * patch.band].round(), patch.grey[off > 2.0 * patch.band].round()


def pixel_noise(grey: Array) -> float:
    """Standard deviation of a pixel of ``grey``, from second differences along the rows, which slanting light does not
    affect, and their median, so that edges and the pile do not count. Over one pixel and over eight, the block of a
    JPEG, within which its noise is smoothed away."""
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
    """The same at its faintest stretch, a twentieth of the pile wide, within the window of the fit, as a funnel's tip
    may have been above it."""
    columns = np.flatnonzero((tops >= FLOOR * tops.max()) & (tops <= CEILING * tops.max()))
    share = max(3, columns.size // 20)
    faint = []
    for side in (columns[columns < tops.argmax()][::-1], columns[columns > tops.argmax()]):
        if side.size == 0:
            continue
        rows = np.clip(tops[side].astype(np.int64) - 1, 0, patch.grey.shape[0] - 1)
        contrast = np.abs(seen.inside - seen.outside)[rows, side]
        # The end of a pile's side may be a steep drop: the levels there are those of what is in front and behind.
        faint.append(float(ndimage.median_filter(contrast, share, mode="nearest").min()))
    return min(faint, default=0.0)


def goes_on_below(grey: Array, patch: Patch, flanks: tuple[FlankLine, FlankLine], height: float) -> float:
    """How far the flanks of a pile of ``height`` [pixels of the patch] go on below the base line, over the height; 0
    if they end there.

    Along the lines that continue the ``flanks``, the grey just inside is compared with that just outside, both as means
    over stretches. If it changes in the same sense on both lines the pile goes on, as it does on a plate that is seen
    from above and begins behind it.
    """
    width = BESIDE / patch.step
    reach = 0.0
    for low, high in pairwise(BELOW):
        # Above the base line lies the backdrop.
        depth = np.arange(max(low * height, width + 2.0), high * height)
        if depth.size < LEAST_STRETCH:
            continue
        changes = []
        for flank, outward in zip(flanks, (-1.0, 1.0), strict=True):
            slant = np.arctan(flank.slope)
            foot = flank.u[1] + outward * flank.z[1] / flank.slope
            off = np.concatenate([-np.linspace(width / 3.0, width, 6), np.linspace(width / 3.0, width, 6)])
            column = foot + outward * (depth[:, None] / flank.slope + np.sin(slant) * off)
            z = np.cos(slant) * off - depth[:, None]
            x, y = patch.place(column, z)
            if x.min() < 0 or y.min() < 0 or x.max() > grey.shape[1] - 1 or y.max() > grey.shape[0] - 1:
                return reach
            seen = ndimage.map_coordinates(grey, [y, x], order=1)
            change = seen[:, 6:].mean(axis=1) - seen[:, :6].mean(axis=1)
            changes.append(
                (float(change.mean()), float(change.std()) / np.sqrt(max(depth.size * patch.step / 4.0, 1.0)))
            )
        (left, left_error), (right, right_error) = changes
        sure = abs(left) > SURE_BELOW * left_error and abs(right) > SURE_BELOW * right_error
        if not (left * right > 0.0 and sure and min(abs(left), abs(right)) > LEAST_BELOW):
            break
        reach = high
    return reach


def edge_width(patch: Patch, tops: Array, difference: float) -> float:
    """Pixels of the patch over which the grey changes sides along the flanks: the ``difference`` between the middle of
    the pile and the backdrop, over the steepest change of the grey across the edge.

    The grey is averaged along the flanks at equal distance from the outline, and its change is taken over ``SPAN`` of
    the height, because the outline follows the noise of a hazy edge, which then looks like a step.
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


def _blur(noise: float, contrast: float, step: float) -> float:
    """Width of the smoothing [pixels of the patch] that leaves noise of an eighth of the contrast, 0.5 … 3 pixels of
    the picture: a Gaussian of width s leaves noise/(2 s √π)."""
    wanted = 8.0 * noise / max(contrast, 1.0) / (2.0 * np.sqrt(np.pi))
    return float(np.clip(wanted, 0.5, 3.0)) / step


def _mean_where(values: Array, where: Image, side: int) -> Array:
    """Mean of ``values`` over a square of ``side`` where ``where`` holds; over all of ``where`` if it does not hold
    nearby."""
    weight = ndimage.uniform_filter(where.astype(np.float64), side, mode="nearest")
    total = ndimage.uniform_filter(np.where(where, values, 0.0), side, mode="nearest")
    overall = float(values[where].mean()) if where.any() else float(values.mean())
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(weight > 1e-3, total / weight, overall)


def _flank_columns(tops: Array) -> npt.NDArray[np.intp]:
    columns = np.flatnonzero((tops > 0.2 * tops.max()) & (tops < NEAR_TOP * tops.max()))
    if columns.size == 0:
        raise NotAPile(Reason.NO_FLANK, "the silhouette has no slope on either side")
    return columns
