"""A photograph of a pile → its outline and flank lines, by the function that reads simulated piles.

    grey levels → light of the backdrop → masks and their parts → base line → upright silhouette → flank lines

The picture is one view along the plate, by a camera that is far away, level and no higher than the plate. Lengths are
in metres where the scale of the picture is known, in its pixels elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from solver.observables.repose import FlankLine, Outline, flank_feet, outline_of
from solver.observables.silhouette import column_tops
from solver.photograph import checks
from solver.photograph.base_line import BaseLine, check_tilt, given_base_line, sharp_base_line
from solver.photograph.clearest import find_pile
from solver.photograph.edge import (
    Patch,
    edge_contrast,
    edge_width,
    faintest,
    pixel_noise,
    roughness,
    silhouettes,
    upright,
)
from solver.photograph.picture import NotAPile, Picture, Reason, Refusal
from solver.photograph.reading_error import Angles, angles_of

Array = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]


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

    @property
    def flanks(self) -> tuple[FlankLine, FlankLine]:
        """Lines of the left and the right flank."""
        left, right = self.outline.flanks
        assert left is not None
        assert right is not None
        return left, right

    def in_picture(self, u: Array, z: Array) -> tuple[Array, Array]:
        """x, y [px] of points of the outline."""
        along = np.array([1.0, self.base.slope]) / np.hypot(1.0, self.base.slope)
        x = self.origin[0] + (along[0] * u + along[1] * z) / self.pixel
        y = self.origin[1] + (along[1] * u - along[0] * z) / self.pixel
        return x, y


def read_photograph(
    picture: Picture, metres_per_pixel: float | None = None, base_line: tuple[float, float] | None = None
) -> PhotographedPile | Refusal:
    """The pile in ``picture``, or why there is none.

    ``metres_per_pixel``: of the picture itself. ``base_line``: y [px of the picture] of the plate at its left and its
    right edge; found by itself if None.
    """
    try:
        return _read(picture, metres_per_pixel, base_line)
    except NotAPile as reason:
        return Refusal(picture.name, reason.reason, reason.detail)


def _read(picture: Picture, metres_per_pixel: float | None, base_line: tuple[float, float] | None) -> PhotographedPile:
    grey = picture.grey.astype(np.float64)
    given = None
    if base_line is not None:
        left, right = picture.index(np.array(base_line))
        given = given_base_line(float(left), float(right), grey.shape[1])
    found, scale = find_pile(picture.grey, given)
    line = given or sharp_base_line(grey, found.line, scale)
    check_tilt(line)
    patch = upright(grey, found.candidate.part, line, scale)
    return _measured(picture, patch, line, pixel_noise(grey), found.difference, metres_per_pixel)


def _measured(
    picture: Picture,
    patch: Patch,
    line: BaseLine,
    noise: float,
    difference: float,
    metres_per_pixel: float | None,
) -> PhotographedPile:
    seen = silhouettes(patch, noise)
    image = seen.images[1]
    if not image.any():
        raise NotAPile(Reason.NO_CLEAR_SILHOUETTE, "nothing stands above the base line")
    tops = column_tops(image).astype(np.float64)
    unit_pixel = 1.0 if metres_per_pixel is None else metres_per_pixel
    side = patch.step * picture.reduced
    checks.check_size(float(tops.max()) * side)
    contrast = edge_contrast(patch, seen, tops)
    checks.check_edge(contrast, faintest(patch, seen, tops), noise)
    checks.check_sharp(edge_width(patch, tops, difference), float(tops.max()))
    checks.check_one_heap(tops)
    in_patch = outline_of(image, 0.0, 0.0, 1.0)
    rough = (roughness(in_patch, in_patch.flanks[0]), roughness(in_patch, in_patch.flanks[1]))
    flanks = checks.check_flanks(in_patch.flanks, rough, float(tops.max()))
    angles = angles_of(seen, flanks, patch.step, line, min(noise / max(contrast, 1.0), 0.125))
    checks.check_levels(angles.level_shift_deg)
    feet = flank_feet(flanks)
    middle = 0.5 * (feet[0] + feet[1])
    place = np.array(patch.foot) + np.array(patch.along) * middle * patch.step
    origin = picture.place(place)
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
    )


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
