"""Numbers that describe the whole top surface of a pile, read from a height map, whatever its origin.

A simulated pile, a scan and (for the rings alone) a table of heights over the radius are read by the same functions.
The map is centred on the rig's axis. Its extent and its rings follow from the charge and the bodies before anything is
poured (:func:`frame_of`), so that a number has the same meaning in every pour of a set-up.

    ring_height_<k>_m        mean height of ring k of ``RINGS``                              (needs the rings only)
    ring_volume_m3           volume under the surface within the rings                       (needs the rings only)
    covered_area_m2          area where the height exceeds ``BARE`` of a body's thickness
    height_q90_m, height_q99_m    quantiles of the heights over the covered area
    height_share_<k>         share of the covered area whose height is between edge k and k + 1 of ``EDGES``, in
                             thicknesses of a body; the last share, which the others fix, is left out
    ring_roughness_<k>_m     standard deviation of the heights in a pair of rings about each ring's mean
    slope, curvature_per_m   mean |∇h| and mean |Δh| of the core, r < base radius of the frame
    skew_x_m, skew_y_m       mean of x and of y over the volume: which way the pile leans
    inner_skew_x_m …         the same for the core alone
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.observables.surface import HeightMap

Array = npt.NDArray[np.float64]

RINGS = 10
REACH = 2.0
"""Outer radius of the last ring, in base radii of the frame."""
ANGLE_DEG, PACKING = 25.0, 0.6
"""Slope and solid fraction of the cone whose base radius is the frame's: any pile of loose grains is of this order."""
BARE = 0.25
"""Height below which the plate counts as bare, in thicknesses of a body."""
EDGES = (BARE, 0.75, 1.0, 1.25, 1.75, 2.25, 3.0, 4.0, 5.0, 6.5, 8.0, math.inf)
"""Edges of the classes of heights, in thicknesses: fine where bodies lie singly, because that tells their size."""
PAIRS = RINGS // 2


@dataclass(frozen=True)
class Frame:
    """Scales of a set-up, known before anything is poured."""

    radius: float
    """Base radius [m] of a cone of ``ANGLE_DEG`` and ``PACKING`` that holds the charge."""
    thickness: float
    """Least outer dimension of the bodies [m], mean over the mass."""

    @property
    def ring_width(self) -> float:
        """[m]"""
        return REACH * self.radius / RINGS

    @property
    def half_width(self) -> float:
        """Half width of a height map that holds all rings [m]."""
        return REACH * self.radius

    @property
    def places(self) -> Array:
        """Middle radii of the rings [m], shape (``RINGS``,)."""
        return np.asarray((np.arange(RINGS) + 0.5) * self.ring_width, dtype=np.float64)


def frame_of(solid_volume: float, thickness: float) -> Frame:
    """The frame of a charge of ``solid_volume`` [m³] in bodies of ``thickness`` [m]: V = π R³ tan α / 3."""
    volume = solid_volume / PACKING
    return Frame((3.0 * volume / (math.pi * math.tan(math.radians(ANGLE_DEG)))) ** (1.0 / 3.0), thickness)


PROFILE_NAMES = (*(f"ring_height_{k + 1}_m" for k in range(RINGS)), "ring_volume_m3")
"""Numbers that the rings give."""
BULK_NAMES = ("covered_area_m2", "height_q90_m", "height_q99_m")
HISTOGRAM_NAMES = tuple(f"height_share_{k + 1}" for k in range(len(EDGES) - 2))
TEXTURE_NAMES = (*(f"ring_roughness_{k + 1}_m" for k in range(PAIRS)), "slope", "curvature_per_m")
ASYMMETRY_NAMES = ("skew_x_m", "skew_y_m", "inner_skew_x_m", "inner_skew_y_m")
SURFACE_NAMES = (*PROFILE_NAMES, *BULK_NAMES, *HISTOGRAM_NAMES, *TEXTURE_NAMES, *ASYMMETRY_NAMES)
"""Numbers that a height map gives."""


def profile_features(heights: Array, frame: Frame) -> dict[str, float]:
    """``PROFILE_NAMES`` of the mean heights [m] of the rings, shape (``RINGS``,)."""
    edges = np.arange(RINGS + 1) * frame.ring_width
    volume = float((np.pi * np.diff(edges**2) * heights).sum())
    return dict(zip(PROFILE_NAMES, (*heights.tolist(), volume), strict=True))


def surface_features(surface: HeightMap, frame: Frame) -> dict[str, float]:
    """``SURFACE_NAMES`` of a height map of ``frame.half_width``, without holes (:func:`without_holes`)."""
    height, pixel = surface.height, surface.pixel
    ring = (surface.radius / frame.ring_width).astype(np.int64)
    known = ring < RINGS
    area = np.maximum(np.bincount(ring[known], minlength=RINGS), 1)
    mean = np.bincount(ring[known], weights=height[known], minlength=RINGS) / area
    away = (height[known] - mean[ring[known]]) ** 2
    pairs = np.minimum(ring[known] // 2, PAIRS - 1)
    rough = np.sqrt(
        np.bincount(pairs, weights=away, minlength=PAIRS) / np.maximum(np.bincount(pairs, minlength=PAIRS), 1)
    )
    covered = height[known & (height > BARE * frame.thickness)]
    shares, high, top = np.zeros(len(EDGES) - 1), 0.0, 0.0
    if covered.size:
        shares = np.histogram(covered / frame.thickness, bins=EDGES)[0] / covered.size
        high, top = np.quantile(covered, (0.9, 0.99))
    core = surface.radius < frame.radius
    slope_x, slope_y = np.gradient(height, pixel)
    curvature = _laplacian(height, pixel)
    axis = (np.arange(height.shape[0]) + 0.5 - height.shape[0] / 2) * pixel
    values = (
        covered.size * pixel**2,
        high,
        top,
        *shares[:-1],
        *rough,
        float(np.hypot(slope_x, slope_y)[core].mean()),
        float(np.abs(curvature)[core].mean()),
        *_centre(np.where(known, height, 0.0), axis),
        *_centre(np.where(core, height, 0.0), axis),
    )
    names = (*BULK_NAMES, *HISTOGRAM_NAMES, *TEXTURE_NAMES, *ASYMMETRY_NAMES)
    return profile_features(mean, frame) | dict(zip(names, map(float, values), strict=True))


def without_holes(surface: HeightMap) -> HeightMap:
    """``surface`` with NaN replaced by the lowest of the nearest known heights along ±x and ±y; 0 where there is none.

    A place that a scanner does not see is mostly in the shadow of something higher, and level with the lowest
    surface around it.
    """
    height = surface.height
    missing = np.isnan(height)
    if not missing.any():
        return surface
    around = np.stack([np.rot90(_last_known(np.rot90(height, turns)), -turns) for turns in range(4)])
    lowest = around.min(axis=0)
    filled = np.where(np.isfinite(lowest), lowest, 0.0)
    return HeightMap(np.where(missing, filled, height), surface.radius, surface.pixel)


def _last_known(height: Array) -> Array:
    """Last height, up to each pixel along the first axis, that is not NaN; infinite where there is none."""
    rows = np.arange(height.shape[0])[:, None]
    last = np.maximum.accumulate(np.where(np.isnan(height), -1, rows), axis=0)
    known = np.take_along_axis(height, np.maximum(last, 0), axis=0)
    return np.where(last >= 0, known, np.inf)


def _laplacian(height: Array, pixel: float) -> Array:
    """Δh [1/m], zero on the border."""
    curvature = np.zeros_like(height)
    inside = height[1:-1, 1:-1]
    around = height[2:, 1:-1] + height[:-2, 1:-1] + height[1:-1, 2:] + height[1:-1, :-2]
    curvature[1:-1, 1:-1] = (around - 4.0 * inside) / pixel**2
    return curvature


def _centre(height: Array, axis: Array) -> tuple[float, float]:
    """Mean of x and of y [m] over the volume; (0, 0) where there is none."""
    total = float(height.sum())
    if total <= 0.0:
        return 0.0, 0.0
    return float(height.sum(axis=1) @ axis) / total, float(height.sum(axis=0) @ axis) / total
