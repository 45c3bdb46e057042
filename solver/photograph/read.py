"""A photograph of a pile → its outline and flank lines, by the function that reads simulated piles.

    grey levels → light of the backdrop → masks and their parts → base line → the picture without the lens's bend →
    upright silhouette, above any support of the pile's tone → flank lines, and by thirds

The picture is one view along the plate, by a camera that is far away, level and no higher than the plate. Lengths are
in metres if the scale of the picture is known, otherwise in its pixels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from solver.observables.repose import FlankLine, Outline, flank_feet, outline_of
from solver.observables.silhouette import column_tops
from solver.photograph import checks, lens
from solver.photograph.base_line import BaseLine, check_tilt, given_base_line, sharp_base_line
from solver.photograph.clearest import Found, find_pile
from solver.photograph.edge import (
    Patch,
    Silhouettes,
    both_sides,
    edge_contrast,
    edge_width,
    faintest,
    goes_on_below,
    pixel_noise,
    roughness,
    silhouettes,
    upright,
)
from solver.photograph.picture import NotAPile, Picture, Reason, Refusal
from solver.photograph.reading_error import UNSEEN_NEAR, Angles, View, angles_of
from solver.photograph.support import Support, support_under

Array = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]

MOST_SUPPORTS = 3
"""Largest number of bodies under each other: a disc on a plate on a table."""


@dataclass(frozen=True, eq=False)
class PhotographedPile:
    """What a picture shows of a pile. Lengths in ``unit``."""

    name: str
    angles: Angles
    unit: Literal["m", "px"]
    pixel: float
    """Length of a pixel of the picture."""
    height: float
    half_width: float
    """Half the distance of the points where the two flank lines reach the base line."""
    roughness: tuple[float, float]
    """Root mean square distance of the outline from the left and the right flank line."""
    outline: Outline
    """Over the base line; u = 0 is in the middle of these two points."""
    base: BaseLine
    """In pixels of the picture."""
    origin: tuple[float, float]
    """x, y of u = 0 on the base line in the picture [px]."""
    contrast: float
    """Grey levels between both sides of the flanks, of 255."""
    noise: float
    """Standard deviation of a pixel, in grey levels."""
    size: tuple[int, int]
    """Size of the picture [px]: columns, rows."""
    lens: float = 0.0
    """k of the lens that was taken out of the picture (`lens.py`); all lines are on the straight copy. 0: none."""

    @property
    def flanks(self) -> tuple[FlankLine, FlankLine]:
        """Lines of the left and the right flank."""
        left, right = self.outline.flanks
        assert left is not None
        assert right is not None
        return left, right

    @property
    def base_ends(self) -> tuple[float, float]:
        """y of the base line at the left and the right edge of the picture, as seen [px]."""
        columns = self.size[0]
        x = np.linspace(0.0, columns - 1.0, 101)
        if self.lens:
            # The edges of the straight copy are others than those of the picture.
            edges = np.array([0.0, columns - 1.0])
            u, v, half = lens.centred(edges, self.base.at(edges), self.size[::-1])
            ends = lens.straight(u, v, self.lens)[0] * half + 0.5 * (columns - 1)
            x = np.linspace(ends[0], ends[1], 101)
        x, y = self.as_seen(x, self.base.at(x))
        left, right = np.interp([0.0, columns - 1.0], x, y)
        return float(left), float(right)

    def in_picture(self, u: Array, z: Array) -> tuple[Array, Array]:
        """x, y [px] of points of the outline."""
        along = np.array([1.0, self.base.slope]) / np.hypot(1.0, self.base.slope)
        x = self.origin[0] + (along[0] * u + along[1] * z) / self.pixel
        y = self.origin[1] + (along[1] * u - along[0] * z) / self.pixel
        return self.as_seen(x, y)

    def as_seen(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Where in the picture places [px] of its straight copy are."""
        if self.lens == 0.0:
            return x, y
        u, v, half = lens.centred(x, y, self.size[::-1])
        u, v = lens.bent(u, v, self.lens)
        return u * half + 0.5 * (self.size[0] - 1), v * half + 0.5 * (self.size[1] - 1)


def read_photograph(
    picture: Picture,
    metres_per_pixel: float | None = None,
    base_line: tuple[float, float] | None = None,
    bend: lens.Bend | None = None,
) -> PhotographedPile | Refusal:
    """The pile in ``picture``, or why there is none.

    ``metres_per_pixel``: scale of the picture itself. ``base_line``: y [px of the picture] of the plate at the left and
    the right edge of the picture; None: found automatically. ``bend``: that of the lens, if a checkerboard showed it
    (`checkerboard.py`); None: found from the base line.
    """
    try:
        if bend is None:
            return _read(picture, metres_per_pixel, base_line)
        if base_line is not None:
            base_line = _unbent(picture, base_line, bend.k)
        pile = _read(lens.straightened(picture, bend.k), metres_per_pixel, base_line, replace(bend, k=0.0))
        return replace(pile, lens=bend.k)
    except NotAPile as reason:
        return Refusal(picture.name, reason.reason, reason.detail)


def _read(
    picture: Picture,
    metres_per_pixel: float | None,
    base_line: tuple[float, float] | None,
    known: lens.Bend | None = None,
) -> PhotographedPile:
    if base_line is not None:
        left, right = picture.index(np.array(base_line))
        given = given_base_line(float(left), float(right), picture.grey.shape[1])
        found, scale = find_pile(picture.grey, given)
        return _measured(picture, found, scale, given, known or lens.UNKNOWN, metres_per_pixel)
    found, scale = find_pile(picture.grey, None)
    grey = picture.grey.astype(np.float64)
    line = sharp_base_line(grey, found.line, scale)
    bend = known or lens.bend_of(grey, found.candidate.part, line, scale)
    if not bend.sure:
        return _measured(picture, found, scale, line, bend, metres_per_pixel)
    picture = lens.straightened(picture, bend.k)
    found, scale = find_pile(picture.grey, None)
    line = sharp_base_line(picture.grey.astype(np.float64), found.line, scale)
    pile = _measured(picture, found, scale, line, replace(bend, k=0.0), metres_per_pixel)
    return replace(pile, lens=bend.k)


def _unbent(picture: Picture, base_line: tuple[float, float], k: float) -> tuple[float, float]:
    """The ends of a stated base line [px of the picture] in its straight copy."""
    size = (picture.height, picture.width)
    x = np.array([0.0, picture.width - 1.0])
    u, v, half = lens.centred(x, np.array(base_line), size)
    u, v = lens.straight(u, v, k)
    slope = (v[1] - v[0]) / (u[1] - u[0])
    left, right = (v[0] + slope * (lens.centred(x, x, size)[0] - u[0])) * half + 0.5 * (size[0] - 1)
    return float(left), float(right)


def _measured(
    picture: Picture, found: Found, scale: float, line: BaseLine, bend: lens.Bend, metres_per_pixel: float | None
) -> PhotographedPile:
    check_tilt(line)
    grey = picture.grey.astype(np.float64)
    noise = pixel_noise(grey)
    patch, seen, tops, line = _standing(grey, found, line, scale, noise)
    image = seen.images[1]
    unit_pixel = 1.0 if metres_per_pixel is None else metres_per_pixel
    side = patch.step * picture.reduced
    checks.check_size(float(tops.max()) * side)
    in_patch = outline_of(image, 0.0, 0.0, 1.0)
    if line.kind == "plate" and all(in_patch.flanks):
        sloping = checks.check_flanks(in_patch.flanks, (0.0, 0.0), float(tops.max()))
        checks.check_below(goes_on_below(grey, patch, sloping, float(tops.max())))
    contrast = edge_contrast(patch, seen, tops)
    checks.check_edge(contrast, faintest(patch, seen, tops), noise)
    checks.check_sharp(edge_width(patch, tops, found.difference), float(tops.max()))
    checks.check_one_heap(tops)
    rough = (roughness(in_patch, in_patch.flanks[0]), roughness(in_patch, in_patch.flanks[1]))
    flanks = checks.check_flanks(in_patch.flanks, rough, float(tops.max()))
    checks.check_photographed(noise, *both_sides(patch), max(rough) * patch.step)
    feet = flank_feet(flanks)
    near = UNSEEN_NEAR if picture.focal is None else 0.5 * (feet[1] - feet[0]) * side / picture.focal
    view = View(_lens_deg(grey, patch, tops, flanks, bend.left_over), line.above_deg, near)
    angles = angles_of(seen, flanks, patch.step, line, min(noise / max(contrast, 1.0), 0.125), view)
    checks.check_levels(angles.level_shift_deg)
    checks.check_bend([angles.left.thirds_deg, angles.right.thirds_deg], angles.bend_deg)
    middle = 0.5 * (feet[0] + feet[1])
    origin = picture.place(np.array(patch.place(np.asarray(middle), np.zeros(()))))
    pixel = side * unit_pixel
    ends = picture.place(line.at(np.array([0.0, picture.grey.shape[1] - 1.0])))
    return PhotographedPile(
        name=picture.name,
        angles=angles,
        unit="px" if metres_per_pixel is None else "m",
        pixel=unit_pixel,
        height=float(tops.max()) * pixel,
        half_width=0.5 * (feet[1] - feet[0]) * pixel,
        roughness=(rough[0] * pixel, rough[1] * pixel),
        outline=_trimmed(outline_of(image, -middle * pixel, 0.0, pixel)),
        base=_in_picture(line, picture, float(ends[0]), float(ends[1])),
        origin=(float(origin[0]), float(origin[1])),
        contrast=contrast,
        noise=noise,
        size=(picture.width, picture.height),
    )


def _standing(
    grey: Array, found: Found, line: BaseLine, scale: float, noise: float
) -> tuple[Patch, Silhouettes, Array, BaseLine]:
    """The pile upright on ``line``, or on the top of a support of the pile's tone that stands on it, with its
    silhouettes and its heights per column."""
    for _ in range(MOST_SUPPORTS):
        patch = upright(grey, found.candidate.part, line, scale)
        seen = silhouettes(patch, noise)
        if not seen.images[1].any():
            raise NotAPile(Reason.NO_CLEAR_SILHOUETTE, "nothing is seen above the base line")
        tops = column_tops(seen.images[1]).astype(np.float64)
        under = None if line.kind == "given" else support_under(tops, 1.0 / patch.step)
        if under is None:
            return patch, seen, tops, line
        line = _on(under, patch)
        check_tilt(line)
    raise NotAPile(
        Reason.SUPPORT,
        f"{MOST_SUPPORTS} or more objects are stacked under the pile; state the pile's foot with --baseline",
    )


def _on(under: Support, patch: Patch) -> BaseLine:
    """The top of the support ``under`` the pile, as its base line."""
    ends = np.array([under.left, under.right])
    z = under.height + under.slope * ends
    x, y = patch.place(ends, z)
    slope = float((y[1] - y[0]) / (x[1] - x[0]))
    return BaseLine(
        float(y[0] - slope * x[0]),
        slope,
        under.slope_error,
        under.error * patch.step,
        "support",
        float(x[0]),
        float(x[1]),
    )


def _lens_deg(
    grey: Array, patch: Patch, tops: Array, flanks: tuple[FlankLine, FlankLine], k_error: float
) -> tuple[float, float]:
    """Angle by which a lens of ``k_error`` turns the flank lines against the base line [°]."""

    def angles(k: float) -> Array:
        found = []
        for flank in flanks:
            inner, outer = sorted(flank.u)
            column = np.arange(int(inner), int(outer) + 1)
            found.append(
                _directions(patch, column.astype(np.float64) + 0.5, tops[column], flank_feet(flanks), grey.shape, k)
            )
        return np.array(found)

    step = 0.01
    turned = np.abs(angles(step) - angles(-step)) / (2.0 * step) * k_error
    return float(turned[0]), float(turned[1])


def _directions(
    patch: Patch, column: Array, z: Array, feet: tuple[float, float], shape: tuple[int, ...], k: float
) -> float:
    """Angle [°] of the line through columns and heights of the patch against the base line, without a bend of ``k``."""
    u = np.concatenate([column, feet])
    v = np.concatenate([z, [0.0, 0.0]])
    x, y = patch.place(u, v)
    a, b, _ = lens.centred(x, y, shape)
    a, b = lens.straight(a, b, k)
    flank = np.polyfit(a[:-2], b[:-2], 1)[0]
    base = (b[-1] - b[-2]) / (a[-1] - a[-2])
    return float(np.degrees(np.arctan(flank) - np.arctan(base)))


def _in_picture(line: BaseLine, picture: Picture, y_left: float, y_right: float) -> BaseLine:
    """``line``, which passes y_left and y_right at the outermost columns of the grey levels, in picture pixels."""
    k = picture.reduced
    x = picture.place(np.array([0.0, picture.grey.shape[1] - 1.0]))
    slope = (y_right - y_left) / (x[1] - x[0])
    left, right = picture.place(np.array([line.left, line.right]))
    return BaseLine(
        float(y_left - slope * x[0]), float(slope), line.slope_error, line.offset_error * k, line.kind, left, right
    )


def _trimmed(outline: Outline) -> Outline:
    """Without the columns beside the pile, where a plate's edge rises over the base line by a pixel of noise."""
    high = np.flatnonzero(outline.top > 0.02 * outline.top.max())
    kept = slice(int(high[0]), int(high[-1]) + 1)
    return Outline(outline.azimuth_deg, outline.u[kept], outline.top[kept], outline.flanks)
