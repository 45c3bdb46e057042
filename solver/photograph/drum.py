"""A picture of a drum's face while it turns → the free surface of the bed in it, and the angle of simulated beds.

    grey levels → the drum's circle → darker and lighter part of its inside → the lower one is the bed
        → its top over the middle of the drum → line over the middle half, as in `observables/free_surface.py`

The camera looks along the axis and is level: the picture holds nothing that would tell how far it is not, and a camera
that is turned by 1° turns the angle by 1°. A picture is one moment, or the time that it was exposed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.optimize import least_squares

from solver.observables.free_surface import CHORD, slope_angle_deg
from solver.observables.silhouette import column_tops, largest_part
from solver.photograph.backdrop import otsu
from solver.photograph.clearest import reduced_grey
from solver.photograph.edge import LEVELS, Patch, pixel_noise, silhouettes
from solver.photograph.picture import NotAPile, Picture, Reason, Refusal

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

CIRCLE_SIDE = 360
"""Longest side of the picture in which the circle is looked for [px]."""
RADII = (0.15, 0.75)
"""Of the drum, over the shorter side of the picture."""
EDGE_SHARE = 0.15
"""Of the pixels of a picture, those with the steepest grey may be the drum's edge."""
SECTORS = 72
"""Of a circle, in which an edge is looked for."""
SEEN = 0.6
"""Share of them in which a drum has one at least."""
INNER = 0.75
"""Of the share of the clearest circle: of two circles that are about as clear the inner one is where the bed ends."""
NEAR = 0.06
"""Share of the radius about the rough circle in which its edge is looked for in the picture itself."""
RIM = 0.95
"""Of the radius: beyond it the wall is seen, or its shadow."""
TEXTURE = 1.0 / 40.0
"""Of the radius: width of the smoothing that leaves the bed's tone of its grains' light and dark."""
COLUMNS = 400
"""Columns that the middle of the drum is resampled to."""
LEAST_STEPS = 12.0
"""Grey levels between bed and background."""
FILLED = (0.03, 0.9)
"""Share of the drum's face that a bed covers."""
WINDOW = 0.5
"""Half width over the radius in which the angle is read, that of the solver's ``dynamic_angle_deg``."""
LEAST_WINDOW = 0.6
"""Share of the window's columns that the surface has to be seen over."""
STRAIGHT = 0.12
"""Root mean square distance of the surface from its line, over the radius, beyond which it is no bed's."""


@dataclass(frozen=True)
class Circle:
    """The inner edge of a drum, in pixels of the picture."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, eq=False)
class PhotographedDrum:
    """The free surface in a picture."""

    name: str
    angle_deg: float
    """Of the line through the surface over the middle half of the drum, above the horizontal of the picture."""
    error_deg: float
    """Standard error: of the line by the surface's roughness, and of where between bed and background the edge is."""
    carried: Literal["left", "right"]
    """The side on which the bed lies higher: to which the drum carries it up."""
    circle: Circle
    filled: float
    """Share of the drum's face that the bed covers."""
    x: Array
    """Places over the radius, over the middle of the drum; the side on which the bed lies higher is at x < 0."""
    height: Array
    """Of the surface over the radius, from the drum's centre; NaN where it is not seen. Shape of ``x``."""
    contrast: float
    """Grey levels between bed and background, of 255."""


def read_drum(picture: Picture) -> PhotographedDrum | Refusal:
    """The free surface in ``picture``, or why there is none."""
    try:
        return _read(picture)
    except NotAPile as reason:
        return Refusal(picture.name, reason.reason, reason.detail)


def _read(picture: Picture) -> PhotographedDrum:
    grey = picture.grey.astype(np.float64)
    x, y, radius = _circle(grey)
    bed, contrast, filled = _bed(grey, x, y, radius)
    patch, half = _middle(grey, bed, x, y, radius)
    images = silhouettes(patch, pixel_noise(grey)).images
    places: Array = (np.arange(patch.grey.shape[1], dtype=np.float64) + 0.5) * patch.step / radius - half
    surfaces = [_surface(image, patch, radius) for image in images]
    angles = [slope_angle_deg(places, surface, WINDOW) for surface in surfaces]
    height = surfaces[LEVELS.index(0.5)]
    window = np.abs(places) <= WINDOW
    known = window & np.isfinite(height)
    if np.count_nonzero(known) < LEAST_WINDOW * np.count_nonzero(window):
        raise NotAPile(Reason.NO_SURFACE, "the bed's surface does not reach over the middle half of the drum")
    line = np.polyfit(places[known], height[known], 1)
    off = height[known] - np.polyval(line, places[known])
    if float(np.sqrt(np.mean(off**2))) > STRAIGHT:
        raise NotAPile(Reason.NO_SURFACE, "what stands out in the drum has no even surface")
    angle = slope_angle_deg(places, height, WINDOW)
    sign = 1.0 if angle >= 0.0 else -1.0
    level = 0.5 * abs(angles[0] - angles[-1])
    # A flowing bed is bent like an S by itself: what is left of a cubic is its roughness.
    rough = height[known] - np.polyval(np.polyfit(places[known], height[known], 3), places[known])
    return PhotographedDrum(
        name=picture.name,
        angle_deg=abs(angle),
        error_deg=float(np.hypot(_line_error_deg(places[known], rough, float(line[0])), level)),
        carried="left" if sign > 0.0 else "right",
        circle=Circle(
            float(picture.place(np.array(x))), float(picture.place(np.array(y))), float(radius * picture.reduced)
        ),
        filled=filled,
        x=places,
        height=height if sign > 0.0 else height[::-1].copy(),
        contrast=contrast,
    )


# The circle


def _circle(grey: Array) -> tuple[float, float, float]:
    """Middle and radius [px of ``grey``] of the innermost circle that is about as clear as the clearest one.

    Every steep pixel votes for the circles through it whose middle lies along its gradient (Duda & Hart 1972, doi
    10.1145/361237.361242, with the direction of the gradient as Kimme, Ballard & Sklansky 1975 take it).
    """
    scale = max(max(grey.shape) / CIRCLE_SIDE, 1.0)
    small = reduced_grey(grey.astype(np.float32), scale)
    smooth = ndimage.gaussian_filter(small, 1.2)
    gx, gy = ndimage.sobel(smooth, 1), ndimage.sobel(smooth, 0)
    steep = np.hypot(gx, gy)
    rows, columns = np.nonzero((steep > np.quantile(steep, 1.0 - EDGE_SHARE)) & (steep > 1.0))
    if rows.size == 0:
        raise NotAPile(Reason.BLANK, "nothing in the picture differs from the rest")
    ux, uy = gx[rows, columns] / steep[rows, columns], gy[rows, columns] / steep[rows, columns]
    edge = np.stack([columns, rows, ux, uy]).astype(np.float64)
    side = min(small.shape)
    found = []
    for radius in np.arange(RADII[0] * side, RADII[1] * side, 1.5):
        votes = np.zeros(small.shape)
        for sign in (1.0, -1.0):
            x = np.rint(edge[0] + sign * radius * edge[2]).astype(np.int64)
            y = np.rint(edge[1] + sign * radius * edge[3]).astype(np.int64)
            inside = (x >= 0) & (y >= 0) & (x < small.shape[1]) & (y < small.shape[0])
            np.add.at(votes, (y[inside], x[inside]), 1.0)
        votes = ndimage.gaussian_filter(votes, 1.5)
        row, column = np.unravel_index(int(votes.argmax()), votes.shape)
        found.append((float(votes.max()) / radius, float(column), float(row), float(radius)))
    refined = [_refined(edge, *circle) for _, *circle in sorted(found, reverse=True)[:12]]
    best = max(share for share, *_ in refined)
    if best < SEEN:
        raise NotAPile(
            Reason.NO_DRUM, f"no circle: of the clearest one {best:.0%} can be seen; the whole face has to be in it"
        )
    _, x0, y0, radius = min((one for one in refined if one[0] >= max(SEEN, INNER * best)), key=lambda one: one[3])
    return _on_the_edge(grey, (x0 + 0.5) * scale - 0.5, (y0 + 0.5) * scale - 0.5, radius * scale)


def _refined(edge: Array, x: float, y: float, radius: float) -> tuple[float, float, float, float]:
    """Share of the sectors with an edge, and the circle by least squares through the edges near it, across it."""
    share = 0.0
    for width in (4.0, 2.5, 2.0):
        dx, dy = edge[0] - x, edge[1] - y
        off = np.hypot(dx, dy)
        across = np.abs(dx * edge[2] + dy * edge[3]) > 0.95 * off
        near = across & (np.abs(off - radius) < width)
        if np.count_nonzero(near) < 8:
            return 0.0, x, y, radius
        sector = ((np.arctan2(dy, dx)[near] / (2.0 * np.pi) + 0.5) * SECTORS).astype(np.int64) % SECTORS
        # Grains have edges everywhere, but none that goes on all along the circle.
        along = 2.0 * np.pi * radius / SECTORS
        share = float(np.count_nonzero(np.bincount(sector, minlength=SECTORS) >= along)) / SECTORS
        # x² + y² = 2 a x + 2 b y + c (Kåsa 1976, doi 10.1109/TIM.1976.6312298); every sector counts alike.
        weight = 1.0 / np.sqrt(np.bincount(sector, minlength=SECTORS)[sector])
        px, py = edge[0][near], edge[1][near]
        terms = np.stack([2.0 * px, 2.0 * py, np.ones_like(px)], axis=1)
        (a, b, c), *_ = np.linalg.lstsq(weight[:, None] * terms, weight * (px**2 + py**2), rcond=None)
        x, y, radius = float(a), float(b), float(np.sqrt(max(c + a * a + b * b, 1.0)))
    return share, x, y, radius


def _on_the_edge(grey: Array, x: float, y: float, radius: float) -> tuple[float, float, float]:
    """The circle through the first steep edge outward in each sector of the picture; outliers weigh little."""
    azimuth = np.linspace(-np.pi, np.pi, 4 * SECTORS, endpoint=False)
    out = np.arange((1.0 - NEAR) * radius, (1.0 + NEAR) * radius, 0.5)
    px, py = x + out * np.cos(azimuth)[:, None], y + out * np.sin(azimuth)[:, None]
    seen = ndimage.map_coordinates(grey, [py, px], order=1, mode="nearest")
    steep = np.abs(ndimage.gaussian_filter1d(seen, 0.004 * radius + 2.0, axis=1, order=1))
    peak = (steep[:, 1:-1] >= steep[:, :-2]) & (steep[:, 1:-1] > steep[:, 2:])
    first = np.argmax(peak & (steep[:, 1:-1] >= 0.5 * steep.max(axis=1, keepdims=True)), axis=1) + 1
    at = out[first]

    def off(circle: Array) -> Array:
        dx, dy = x + at * np.cos(azimuth) - circle[0], y + at * np.sin(azimuth) - circle[1]
        return np.asarray(np.hypot(dx, dy) - circle[2])

    found = least_squares(off, (x, y, float(np.median(at))), loss="cauchy", f_scale=0.004 * radius)
    return float(found.x[0]), float(found.x[1]), float(found.x[2])


# The bed


def _bed(grey: Array, x: float, y: float, radius: float) -> tuple[Image, float, float]:
    """The bed's pixels roughly, in the shape of ``grey``; grey levels to the background; share of the face."""
    rows, columns = np.mgrid[: grey.shape[0], : grey.shape[1]]
    face = np.hypot(columns - x, rows - y) < RIM * radius
    # Of the face alone: what lies beyond the rim is nobody's tone.
    weight = ndimage.gaussian_filter(face.astype(np.float64), TEXTURE * radius)
    smooth = ndimage.gaussian_filter(np.where(face, grey, 0.0), TEXTURE * radius) / np.maximum(weight, 1e-6)
    threshold = otsu(smooth[face])
    if not np.isfinite(threshold):
        raise NotAPile(Reason.BLANK, "the drum is of one tone")
    dark = face & (smooth < threshold)
    light = face & ~dark
    contrast = float(np.median(smooth[light]) - np.median(smooth[dark])) if dark.any() and light.any() else 0.0
    if contrast < LEAST_STEPS:
        raise NotAPile(
            Reason.BLANK, f"in the drum light and dark differ by {contrast:.0f} of 255 grey levels: no bed stands out"
        )
    bed = largest_part(dark if rows[dark].mean() > rows[light].mean() else light)
    filled = float(bed.sum() / face.sum())
    if not FILLED[0] <= filled <= FILLED[1]:
        raise NotAPile(Reason.NO_SURFACE, f"the lower tone covers {filled:.0%} of the drum; a bed has a surface")
    return bed, contrast, filled


def _middle(grey: Array, bed: Image, x: float, y: float, radius: float) -> tuple[Patch, float]:
    """The middle of the drum upright, row 0 at its bottom, and its half width over the radius."""
    step = min(1.0, 2.0 * CHORD * radius / COLUMNS)
    n = int(2.0 * CHORD * radius / step)
    u = (np.arange(n) + 0.5) * step - 0.5 * n * step
    v = (np.arange(int(2.0 * radius / step)) + 0.5) * step - radius
    px, py = np.broadcast_arrays((x + u)[None, :], (y - v)[:, None])
    seen = ndimage.map_coordinates(grey, [py, px], order=1, mode="nearest")
    rough = ndimage.map_coordinates(bed.astype(np.float32), [py, px], order=1, mode="nearest") > 0.5
    beyond = np.hypot(u[None, :], v[:, None]) >= RIM * radius
    below = beyond & (v < 0.0)[:, None]
    # The wall is taken for what it holds: bed below, background above.
    inside = ~beyond
    tones = [float(np.median(seen[inside & part])) if (inside & part).any() else 0.0 for part in (rough, ~rough)]
    seen = np.where(beyond, np.where(below, tones[0], tones[1]), seen)
    rough = (rough & inside) | below
    rough = np.logical_or.accumulate(rough[::-1], axis=0)[::-1]
    band = max(3.0, 1.5 * TEXTURE * radius / step)
    return Patch(seen, rough, step, band, (x + float(u[0]), y + radius), (1.0, 0.0)), 0.5 * n * step / radius


def _surface(image: Image, patch: Patch, radius: float) -> Array:
    """Heights of the surface from the drum's centre over the radius; NaN where the bed ends at the wall."""
    tops: Array = column_tops(image).astype(np.float64) * patch.step / radius - 1.0
    n = tops.size
    u = ((np.arange(n) + 0.5) - 0.5 * n) * patch.step / radius
    return np.where(np.hypot(u, tops) < RIM - 2.0 * patch.step / radius, tops, np.nan)


def _line_error_deg(x: Array, rough: Array, slope: float) -> float:
    """Standard error of the line's angle [°]: neighbouring columns are of one grain, so that fewer are independent than
    there are columns, by the sum of the residuals' autocorrelation up to its first zero."""
    variance = float(rough @ rough)
    if variance <= 0.0:
        return 0.0
    correlation = np.correlate(rough, rough, "full")[rough.size - 1 :] / variance
    first_zero = int(np.argmax(correlation <= 0.0)) or correlation.size
    together = 1.0 + 2.0 * float(correlation[1:first_zero].sum())
    independent = max(rough.size / together, 5.0)
    run = x - x.mean()
    error = np.sqrt(variance / rough.size / (independent - 4.0) / float(np.mean(run**2)))
    return float(np.degrees(error / (1.0 + slope**2)))
