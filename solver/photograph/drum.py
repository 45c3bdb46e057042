"""A picture of a drum's face while it turns → the free surface of the bed in it, and the angle of simulated beds.

    grey levels → the drum's circle → darker and lighter part of its inside → the lower one is the bed
        → its top over the middle of the drum → line over the middle half, as in `observables/free_surface.py`

The camera must look along the axis; otherwise the rim is an ellipse, which is refused. It must also be level, which the
picture does not show: a camera that is turned about the axis by 1° turns the angle by 1°. A picture shows one moment,
or the time of its exposure.
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
from solver.photograph.edge import LEVELS, Patch, edge_width, pixel_noise, silhouettes
from solver.photograph.picture import NotAPile, Picture, Reason, Refusal

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

CIRCLE_SIDE = 360
"""Longest side of the picture in which the circle is looked for [px]."""
RADII = (0.15, 0.75)
"""Smallest and largest radius of the drum, over the shorter side of the picture."""
EDGE_SHARE = 0.15
"""Share of the pixels of a picture, those with the steepest grey, that may be the drum's edge."""
SECTORS = 72
"""Number of sectors of a circle in which an edge is looked for."""
SEEN = 0.6
"""Smallest share of the sectors in which a drum has an edge."""
CLEAR = 0.75
"""Share of the sectors with an edge, over that of the clearest circle, from which another circle is clear."""
CANDIDATES = 24
NEAR = 0.06
"""Share of the radius about the rough circle at which the rim is looked for in the picture itself, from which on."""
FAINT = 0.2
"""Share of the steepest edge of a sector below which an edge is that of a grain."""
SEEN_INNER = 0.5
"""Smallest share of the sectors in which the inner edge of a rim is seen."""
EDGE = 0.004
"""Share of the radius by which the edge of a sector may lie off the rim."""
BIG_GAP = 0.03
"""Smallest relative difference between the radii of two circles."""
CONCENTRIC = 0.06
"""Share of the radius by which the middles of a drum's circles may differ."""
BOTH_TONES = 0.1
"""Smallest share of a ring that each tone covers if the bed goes on into it."""
ASLANT = 0.008
"""Share of the radius by which the rim may be an ellipse; an axis that is 7° off makes as much."""
OUTSIDE = 0.01
"""Share of the radius by which the circle may lie outside the picture."""
RIM = 0.95
"""Share of the radius beyond which the wall is seen, or its shadow."""
TEXTURE = 1.0 / 40.0
"""Width of the smoothing, over the radius, that averages the light and dark of grains to the tone of the bed."""
COLUMNS = 400
"""Number of columns that the middle of the drum is resampled to."""
LEAST_STEPS = 12.0
"""Smallest number of grey levels between bed and background."""
FILLED = (0.03, 0.9)
"""Smallest and largest share of the drum's face that a bed covers."""
WINDOW = 0.5
"""Half width over the radius in which the angle is read, that of the solver's ``dynamic_angle_deg``."""
LEAST_WINDOW = 0.6
"""Smallest share of the window's columns in which the surface has to be seen."""
STRAIGHT = 0.12
"""Root mean square distance of the surface from its line, over the radius, beyond which it is not that of a bed."""
CROSSED = 0.08
"""Share of the area below the topmost place of the bed's tone, column by column, that may be of the other tone: 0 for
beds; 0.12 and more if a bar, a spoke or a reflection crosses the drum."""
WIDEST = 0.12
"""Largest width, over the radius, of the change of grey from the bed to the background: slanting light changes more
slowly."""
LEAST_ANGLE, MOST_ERROR = 1.0, 2.0
"""Angle [°] below which a drum does not turn, or what was read is no bed's surface; and greatest standard error [°]."""


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
    """Of the line through the surface over the middle half of the drum, to the horizontal of the picture."""
    error_deg: float
    """Standard error: of the line by the surface's roughness, of the place of the edge between bed and background, and
    of an axis that the camera does not look along."""
    carried: Literal["left", "right"]
    """The side on which the bed lies higher, to which the drum carries it up."""
    circle: Circle
    filled: float
    """Share of the drum's face that the bed covers."""
    x: Array
    """Places over the radius, over the middle of the drum; the side on which the bed lies higher is at x < 0."""
    height: Array
    """Height of the surface over the radius, from the drum's centre; NaN where it is not seen. Shape of ``x``."""
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
    x, y, radius, ellipse = _circle(grey)
    _check_circle(grey, x, y, radius, ellipse)
    bed, contrast, filled = _bed(grey, x, y, radius)
    patch, half = _middle(grey, bed, x, y, radius)
    images = silhouettes(patch, pixel_noise(grey)).images
    places: Array = (np.arange(patch.grey.shape[1], dtype=np.float64) + 0.5) * patch.step / radius - half
    low, height, high = (_surface(image, places, patch.step / radius) for image in images)
    _check_surface(places, height)
    angle = slope_angle_deg(places, height, WINDOW)
    if abs(angle) < LEAST_ANGLE:
        raise NotAPile(
            Reason.NO_SURFACE,
            "the line across the drum is level: the drum does not turn, or this is not the surface of a bed",
        )
    width = edge_width(patch, column_tops(images[LEVELS.index(0.5)]).astype(np.float64), contrast) * patch.step
    if width > WIDEST * radius:
        raise NotAPile(Reason.NO_SURFACE, "light and dark blend gradually at the surface, as under slanting light")
    level = 0.5 * abs(slope_angle_deg(places, low, WINDOW) - slope_angle_deg(places, high, WINDOW))
    aslant = float(np.degrees(ellipse * np.sin(2.0 * np.radians(abs(angle)))))
    error = float(np.linalg.norm([_line_error_deg(places, height), level, aslant]))
    if error > MOST_ERROR:
        raise NotAPile(Reason.NO_SURFACE, f"the surface is so rough that its angle is known to ± {error:.1f}° only")
    return PhotographedDrum(
        name=picture.name,
        angle_deg=abs(angle),
        error_deg=error,
        carried="left" if angle > 0.0 else "right",
        circle=Circle(
            float(picture.place(np.array(x))), float(picture.place(np.array(y))), float(radius * picture.reduced)
        ),
        filled=filled,
        x=places,
        height=height if angle > 0.0 else height[::-1].copy(),
        contrast=contrast,
    )


# The circle


def _circle(grey: Array) -> tuple[float, float, float, float]:
    """Middle and radius [px of ``grey``] of the circle that the bed ends at, and how far it is an ellipse.

    Every steep pixel votes for the circles through it whose middle lies along its gradient (Duda & Hart 1972, doi
    10.1145/361237.361242, with the direction of the gradient as Kimme, Ballard & Sklansky 1975 use it). The largest of
    the clear circles is the drum, or its outer edge; of the circles about the same middle the drum is the innermost
    one beyond which the bed does not go on.
    """
    scale = max(max(grey.shape) / CIRCLE_SIDE, 1.0)
    small = reduced_grey(grey.astype(np.float32), scale)
    edge = _steep(ndimage.gaussian_filter(small, 1.2))
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
    refined = [_refined(edge, *circle) for _, *circle in sorted(found, reverse=True)[:CANDIDATES]]
    best = max(share for share, *_ in refined)
    if best < SEEN:
        raise NotAPile(
            Reason.NO_DRUM,
            f"no circle found: only {best:.0%} of the clearest one is visible; show the whole face of the drum",
        )
    clear = sorted((r, x, y) for share, x, y, r in refined if share >= max(SEEN, CLEAR * best))
    largest, x0, y0 = clear[-1]
    rings = [(r, x, y) for r, x, y in clear if np.hypot(x - x0, y - y0) < CONCENTRIC * largest]
    drum = rings[0]
    for ring in rings[1:]:
        if ring[0] > (1.0 + BIG_GAP) * drum[0] and _goes_on(small, drum, ring):
            drum = ring
    radius, x0, y0 = drum
    return _on_the_edge(grey, (x0 + 0.5) * scale - 0.5, (y0 + 0.5) * scale - 0.5, radius * scale)


def _steep(smooth: Array) -> Array:
    """Places and unit gradients, x, y, u, v by row, of the steepest pixels."""
    gx, gy = ndimage.sobel(smooth, 1), ndimage.sobel(smooth, 0)
    steep = np.hypot(gx, gy)
    rows, columns = np.nonzero((steep > np.quantile(steep, 1.0 - EDGE_SHARE)) & (steep > 1.0))
    if rows.size == 0:
        raise NotAPile(Reason.BLANK, "nothing in the picture differs from the rest")
    size = steep[rows, columns]
    found: Array = np.stack([columns, rows, gx[rows, columns] / size, gy[rows, columns] / size]).astype(np.float64)
    return found


def _goes_on(grey: Array, inner: tuple[float, float, float], outer: tuple[float, float, float]) -> bool:
    """Whether both tones inside a circle, the one above the other, go on as far as a larger one (radius, x, y)."""
    rows, columns = np.mgrid[: grey.shape[0], : grey.shape[1]]
    within = np.hypot(columns - inner[1], rows - inner[2]) < RIM * inner[0]
    ring = np.hypot(columns - outer[1], rows - outer[2]) < RIM * outer[0]
    ring &= np.hypot(columns - inner[1], rows - inner[2]) > (2.0 - RIM) * inner[0]
    threshold = otsu(grey[within])
    if not np.isfinite(threshold) or not ring.any():
        return False
    share = float((grey[ring] < threshold).mean())
    if not BOTH_TONES < share < 1.0 - BOTH_TONES:
        return False
    lower = [
        rows[part & (grey < threshold)].mean() > rows[part & (grey >= threshold)].mean() for part in (within, ring)
    ]
    return bool(lower[0] == lower[1])


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


def _on_the_edge(grey: Array, x: float, y: float, radius: float) -> tuple[float, float, float, float]:
    """The inner edge of the rim near a circle: middle and radius, and by what share of that it is an ellipse.

    Starting from a few radii, the steep edge of every sector that is nearest to the rim so far is taken, and the rim is
    fitted to these, with little weight on outliers: within the bed grains have edges too, and a rim has two.
    """
    azimuth = np.linspace(-np.pi, np.pi, 4 * SECTORS, endpoint=False)
    out = np.arange((1.0 - 2.0 * NEAR) * radius, (1.0 + 2.0 * NEAR) * radius, 0.5)
    px, py = x + out * np.cos(azimuth)[:, None], y + out * np.sin(azimuth)[:, None]
    seen = ndimage.map_coordinates(grey, [py, px], order=1, mode="nearest")
    steep = np.abs(ndimage.gaussian_filter1d(seen, 0.004 * radius + 2.0, axis=1, order=1))
    peak = (steep[:, 1:-1] >= steep[:, :-2]) & (steep[:, 1:-1] > steep[:, 2:])
    peak &= steep[:, 1:-1] >= FAINT * steep.max(axis=1, keepdims=True)
    wave = np.cos(2.0 * azimuth), np.sin(2.0 * azimuth)
    size, scale = EDGE * radius, (1.0, 1.0, 1.0, 0.01, 0.01)

    def off(rim: Array, at: Array) -> Array:
        dx, dy = x + at * np.cos(azimuth) - rim[0], y + at * np.sin(azimuth) - rim[1]
        return np.asarray(np.hypot(dx, dy) - rim[2] * (1.0 + rim[3] * wave[0] + rim[4] * wave[1]))

    found: list[tuple[int, Array]] = []
    for share in np.linspace(1.0 - NEAR, 1.0 + NEAR, 7):
        rim = np.array([x, y, share * radius, 0.0, 0.0])
        for _ in range(3):
            far = np.where(peak, np.abs(off(rim, out[1:-1, None])).T, np.inf)
            at = out[far.argmin(axis=1) + 1]
            rim = least_squares(off, rim, loss="cauchy", f_scale=size, x_scale=scale, args=(at,)).x
        found.append((int(np.count_nonzero(np.abs(off(rim, at)) < size)), rim))
    rim = max(found, key=lambda one: one[0])[1]
    # A rim has two edges of one shape; if the bed has its tone, the inner one is seen only above the bed.
    beyond = np.where(peak, off(rim, out[1:-1, None]).T, np.inf)
    for inward in np.arange(-2.0 * NEAR * radius, -2.0 * size, 0.5 * size):
        if np.count_nonzero((np.abs(beyond - inward) < size).any(axis=1)) > SEEN_INNER * len(azimuth):
            rim[2] += float(np.median(beyond[np.abs(beyond - inward) < 2.0 * size]))
            break
    return float(rim[0]), float(rim[1]), float(rim[2]), float(np.hypot(rim[3], rim[4]))


def _check_circle(grey: Array, x: float, y: float, radius: float, ellipse: float) -> None:
    """Refuse a drum that is not seen whole, or aslant."""
    beyond = max(radius - x, radius - y, x + radius - grey.shape[1], y + radius - grey.shape[0])
    if beyond > OUTSIDE * radius:
        raise NotAPile(Reason.CUT_BY_FRAME, f"{beyond / radius:.0%} of the drum's radius lies outside the picture")
    if ellipse > ASLANT:
        raise NotAPile(
            Reason.CAMERA_ASLANT,
            f"the rim is an ellipse; its longer axis is {2.0 * ellipse:.1%} over the mean; look along the drum's axis",
        )


# The bed


def _bed(grey: Array, x: float, y: float, radius: float) -> tuple[Image, float, float]:
    """Rough pixels of the bed, in the shape of ``grey``; its grey levels to the background; its share of the face."""
    rows, columns = np.mgrid[: grey.shape[0], : grey.shape[1]]
    face = np.hypot(columns - x, rows - y) < RIM * radius
    # Of the face alone: the tone beyond the rim is neither that of the bed nor of the background.
    weight = ndimage.gaussian_filter(face.astype(np.float64), TEXTURE * radius)
    smooth = ndimage.gaussian_filter(np.where(face, grey, 0.0), TEXTURE * radius) / np.maximum(weight, 1e-6)
    threshold = otsu(smooth[face])
    if not np.isfinite(threshold):
        raise NotAPile(Reason.BLANK, "the face of the drum has one tone: no bed stands out")
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
        raise NotAPile(
            Reason.NO_SURFACE,
            f"the lower tone covers {filled:.0%} of the drum; allowed: {FILLED[0]:.0%} … {FILLED[1]:.0%}",
        )
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
    full = np.logical_or.accumulate(rough[::-1], axis=0)[::-1]
    crossed = float((full & ~rough).sum() / full.sum())
    if crossed > CROSSED:
        raise NotAPile(
            Reason.NO_SURFACE, f"{crossed:.0%} of the area below the bed's surface is not bed: something covers it"
        )
    band = max(3.0, 1.5 * TEXTURE * radius / step)
    return Patch(seen, full, step, band, (x + float(u[0]), y + radius), (1.0, 0.0)), 0.5 * n * step / radius


def _surface(image: Image, places: Array, pixel: float) -> Array:
    """Heights of the surface from the drum's centre at ``places``; NaN where the bed ends at the wall. All lengths are
    over the radius, including the side of a ``pixel``."""
    tops: Array = column_tops(image).astype(np.float64) * pixel - 1.0
    return np.where(np.hypot(places, tops) < RIM - 2.0 * pixel, tops, np.nan)


def _check_surface(x: Array, height: Array) -> None:
    """Refuse a surface that is not seen over the middle half of the drum, or is not even."""
    window = np.abs(x) <= WINDOW
    known = window & np.isfinite(height)
    if np.count_nonzero(known) < LEAST_WINDOW * np.count_nonzero(window):
        raise NotAPile(Reason.NO_SURFACE, "the bed's surface does not span the middle half of the drum")
    off = height[known] - np.polyval(np.polyfit(x[known], height[known], 1), x[known])
    if float(np.sqrt(np.mean(off**2))) > STRAIGHT:
        raise NotAPile(Reason.NO_SURFACE, "what stands out in the drum has no straight surface")


def _line_error_deg(x: Array, height: Array) -> float:
    """Standard error of the angle of the line through the middle half [°], from the roughness of the surface.

    The surface of a flowing bed is S-shaped: its roughness is the residual of a cubic fit. Neighbouring columns show
    the same grain, so that there are fewer independent values than columns, by the sum of the autocorrelation up to its
    first zero.
    """
    known = (np.abs(x) <= WINDOW) & np.isfinite(height)
    x, height = x[known], height[known]
    rough = height - np.polyval(np.polyfit(x, height, 3), x)
    variance = float(rough @ rough)
    if variance <= 0.0:
        return 0.0
    correlation = np.correlate(rough, rough, "full")[rough.size - 1 :] / variance
    first_zero = int(np.argmax(correlation <= 0.0)) or correlation.size
    together = 1.0 + 2.0 * float(correlation[1:first_zero].sum())
    independent = max(rough.size / together, 5.0)
    run, slope = x - x.mean(), float(np.polyfit(x, height, 1)[0])
    error = np.sqrt(variance / rough.size / (independent - 4.0) / float(np.mean(run**2)))
    return float(np.degrees(error / (1.0 + slope**2)))
