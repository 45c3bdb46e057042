"""The free surface y(x) of a flowing bed, as a camera that looks along +y sees it, and the angles read off it.

At one moment the surface is the outline of the bed's silhouette: in every column of pixels, the top of its largest
connected part, so that single bodies in the air do not count. The profile over time is the median of these outlines:
the line along which the time-averaged image of a bed without holes is 50 % grey (Lumay et al. 2012, Powder Technology
224:19, for the instrument that measures it this way).

x points to the right, y up, both from the rig's centre. An angle is positive where the bed lies higher at −x, the side
to which the drum carries the material.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.effects.effect import Telltale
from solver.observables.observable import TILT, Value, mean_value, of_record
from solver.observables.silhouette import PIXEL, column_tops, largest_part, silhouette
from solver.rigs.rig import FREE_SURFACE

if TYPE_CHECKING:
    from solver.pours.record import FreeSurface, Record, Spheres

Array = npt.NDArray[np.float64]

WINDOWS = 5
"""Number of parts of the averaging time; the spread is that of their angles."""
CORE = 10.0e-3
"""Half width [m] over which ``slope_core_deg`` is taken."""
CHORD = 0.6
"""Share of the drum's radius over which ``slope_deg`` and the profile are taken: beyond it the wall bends the bed."""
LEAST_COLUMNS = 3


def column_places(half_width: float, pixel: float = PIXEL) -> Array:
    """Middles of the columns of pixels with |x| < ``half_width`` [m], shape (c,)."""
    n = int(np.ceil(half_width / pixel))
    places: Array = (np.arange(-n, n, dtype=np.float64) + 0.5) * pixel
    return places


def surface_heights(spheres: Spheres, half_width: float, pixel: float = PIXEL) -> Array:
    """Top of the largest connected part of the silhouette along +y, over the columns of :func:`column_places` [m].

    NaN over a column where there is nothing. Shape (c,).
    """
    heights = np.full(column_places(half_width, pixel).size, np.nan)
    if spheres.radius.size == 0:
        return heights
    tops = column_tops(largest_part(silhouette(spheres, 0.0, pixel)))
    # The image begins at a whole pixel; column k of the profile begins at pixel k − c/2.
    first = int(np.floor(((spheres.centre[:, 0] - spheres.radius) / pixel).min())) + heights.size // 2
    columns = first + np.flatnonzero(tops)
    kept = (columns >= 0) & (columns < heights.size)
    heights[columns[kept]] = tops[columns[kept] - first] * pixel
    return heights


def slope_angle_deg(x: Array, height: Array, half_width: float) -> float:
    """Angle [°] of the least-squares line through ``height`` [m] over |x| ≤ ``half_width`` [m]; NaN without columns.

    Positive where the left is higher.
    """
    used = (np.abs(x) <= half_width) & np.isfinite(height)
    if np.count_nonzero(used) < LEAST_COLUMNS:
        return float("nan")
    run, rise = x[used] - x[used].mean(), height[used]
    return float(np.degrees(np.arctan(-(run @ rise) / (run @ run))))


def time_profile(surface: FreeSurface) -> Array:
    """Median over time of the height in each column [m], shape (c,); NaN if there is no bed for half of the time."""
    known = np.isfinite(surface.height)
    filled = np.where(known, surface.height, -np.inf)
    median = np.median(filled, axis=0)
    return np.where(np.isfinite(median), median, np.nan)


def surface_profile(record: Record) -> tuple[Array, Array]:
    """``surface_profile_m``: places x [m] and the free surface y(x) there [m], from the drum's centre; shape (c,) each.

    Over the middle ``CHORD`` of the drum. Empty for a run without a free surface.
    """
    surface = record.free_surface
    if surface is None:
        return np.zeros(0), np.zeros(0)
    middle = np.abs(surface.x) <= _chord(surface)
    return surface.x[middle], time_profile(surface)[middle]


def dynamic_angle(record: Record) -> Value:
    """Angle of the free surface in the middle half of the drum, mean over parts of the time; spread over them."""
    surface = record.free_surface
    if surface is None:
        return Value(float("nan"), "deg")
    half_width = 0.5 * surface.x.max()
    moments = [part for part in np.array_split(np.arange(surface.time.size), WINDOWS) if part.size]
    angles = [slope_angle_deg(surface.x, time_profile(_during(surface, part)), half_width) for part in moments]
    return mean_value(angles, "deg")


def slope(record: Record) -> Value:
    """Least-squares slope of the time-averaged free surface over the middle 60 % of the drum."""
    surface = record.free_surface
    return Value(float("nan") if surface is None else _slope(surface, _chord(surface)), "deg")


def slope_core(record: Record) -> Value:
    """Least-squares slope of the time-averaged free surface over |x| ≤ 10 mm."""
    surface = record.free_surface
    return Value(float("nan") if surface is None else _slope(surface, CORE), "deg")


def _slope(surface: FreeSurface, half_width: float) -> float:
    return slope_angle_deg(surface.x, time_profile(surface), half_width)


def _chord(surface: FreeSurface) -> float:
    return CHORD * float(surface.x.max())


def _during(surface: FreeSurface, moments: npt.NDArray[np.int64]) -> FreeSurface:
    return dataclasses.replace(surface, time=surface.time[moments], height=surface.height[moments])


SHAPE, FLOW = Telltale.SHAPE, Telltale.FLOW
OBSERVABLES = (
    of_record("dynamic_angle_deg", "deg", dynamic_angle, SHAPE, FLOW, group=FREE_SURFACE, possible=TILT),
    of_record("slope_deg", "deg", slope, SHAPE, FLOW, group=FREE_SURFACE, possible=TILT),
    of_record("slope_core_deg", "deg", slope_core, SHAPE, FLOW, group=FREE_SURFACE, possible=TILT),
)
