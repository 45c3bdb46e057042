"""Features that describe the whole pile of a condition, computed by the same functions from data and from runs.

    group      features                                                      needs
    scalars    the summaries of the condition (``summaries.py``)             any data
    profile    mean heights of rings                                         a scan, or heights listed over the radius
    surface    heights of the covered area, texture, direction of leaning    a scan

A run is processed as the data were. Heights are taken in cells as wide as the scans' resolution; the mean of the cells
within a quarter of a body's thickness is one pixel of the height map. Unlike the highest point of a pixel, a mean is
not shifted by resolution or noise. Where only heights over the radius are listed, a run's rings are computed from its
heights at the listed radii. Texture and classes of heights are omitted where a scan is too coarse to show single
bodies, and features that depend on the axis where the scan's axis is unknown.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.measurement.measurement import Condition
from doe.measurement.piles import PileSurface
from doe.measurement.scans import UpperSurface
from doe.measurement.sight import PERFECT, Sight, found_sight, seen_through
from doe.measurement.summaries import summaries_of_data, summaries_of_record, summary_names
from solver import (
    ASYMMETRY_NAMES,
    BULK_NAMES,
    HISTOGRAM_NAMES,
    PROFILE_NAMES,
    TEXTURE_NAMES,
    Frame,
    HeightMap,
    Record,
    Scene,
    coarsened,
    frame_of,
    observe_named,
    pour_rig,
    poured_mass,
    profile_features,
    surface_features,
    without_holes,
)

Array = npt.NDArray[np.float64]

SCALARS, PROFILE, SCAN = "scalars", "profile", "scan"
OFFERS = (SCALARS, PROFILE, SCAN)
"""What a measurement may offer, in ascending order; each includes those before it."""
LISTED = "height_profile_m"
PIXELS, CELLS = 4.0, 3
"""Pixels of a height map per thickness of a body, and cells per pixel side where no scan limits the resolution."""
FINE = 0.25
"""Coarsest resolution at which a scan shows single bodies, as a share of the smallest member sphere's diameter."""
ROUNDING = 1e-12
"""Relative rounding error allowed in a quotient of two lengths."""
PER_RING = 20
"""Number of radii per ring at which listed heights are averaged."""


@dataclass(frozen=True)
class FeatureSet:
    """Names of the features of one condition: scalars, then the profile, then the remaining features of a scan."""

    scalars: tuple[str, ...]
    profile: tuple[str, ...]
    surface: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """All of them."""
        return self.scalars + self.profile + self.surface

    def offered(self, offer: str) -> int:
        """Number of leading features that data of the kind ``offer`` provide."""
        parts = (self.scalars, self.profile, self.surface)
        return sum(len(part) for part in parts[: OFFERS.index(offer) + 1])


def offer_of(condition: Condition) -> str:
    """The most that the data of ``condition`` offer."""
    if condition.surfaces:
        return SCAN
    return PROFILE if _listed_places(condition) is not None else SCALARS


def feature_set(condition: Condition) -> FeatureSet:
    """Return the features of a run of ``condition``: all that its data may offer; with scalars alone, also those that a
    scan would offer. For a rig that leaves no heap, only the scalars.
    """
    scalars = summary_names(condition)
    if not pour_rig(condition.scene).leaves_heap:
        return FeatureSet(scalars, (), ())
    surface: tuple[str, ...] = BULK_NAMES
    if resolution(condition) <= FINE * 2.0 * smallest_radius(condition.scene):
        surface += HISTOGRAM_NAMES + TEXTURE_NAMES
    if all(one.axis is not None for one in condition.surfaces.values()):
        surface += ASYMMETRY_NAMES
    # The name states how a number is read, so that a store never confuses two ways of reading it.
    cell, times = cells_of(condition)
    seen_as = f"@{times} x {1e3 * cell:.4g} mm" if resolution(condition) > 0.0 else ""
    places = _listed_places(condition)
    listed_as = seen_as if places is None or condition.surfaces else f"@{zlib.crc32(places.tobytes()):08x}"
    return FeatureSet(
        scalars, tuple(f"{name}{listed_as}" for name in PROFILE_NAMES), tuple(f"{name}{seen_as}" for name in surface)
    )


def features_of_record(condition: Condition, record: Record, sight: Sight = PERFECT) -> Array:
    """Return the values of ``feature_set(condition).names`` for a run of the condition's set-up; NaN where unreadable.

    ``sight``: camera direction and noise with which the surface is seen.

    The scales are those of the declared scene, whichever effects acted in the run.
    """
    names, scalars = feature_set(condition), summaries_of_record(condition, record)
    if not names.profile:
        return scalars
    frame = frame_of_scene(condition.scene)
    seen = dict(surface_features(_seen(PileSurface(record.pile.spheres), condition, sight), frame))
    places = _listed_places(condition)
    if places is not None and not condition.surfaces:
        heights = np.asarray(observe_named(record, {LISTED: places})[LISTED])
        seen |= profile_features(ring_heights(places, heights, frame), frame)
    return np.concatenate([scalars, _chosen(seen, names)])


def features_of_data(condition: Condition) -> Array:
    """Return the features that the data offer, as named in ``feature_set(condition)``; NaN where missing.

    Shape (replicates, n).
    """
    names, scalars = feature_set(condition), summaries_of_data(condition)
    offer = offer_of(condition)
    if offer == SCALARS or not names.profile:
        return scalars
    frame = frame_of_scene(condition.scene)
    missing = dict.fromkeys(map(_plain, names.profile + names.surface), float("nan"))
    rows = []
    for replicate in range(1, condition.replicates + 1):
        seen: Mapping[str, float] = {}
        if replicate in condition.surfaces:
            seen = surface_features(seen_surface(condition, replicate), frame)
        elif offer == PROFILE:
            observation = condition.offered[LISTED]
            heights = np.asarray(observation.values[replicate - 1], dtype=np.float64)
            if observation.x is not None and np.isfinite(heights).all():
                seen = profile_features(ring_heights(observation.x, heights, frame), frame)
        rows.append(_chosen(missing | dict(seen), names))
    return np.concatenate([scalars, np.array(rows)], axis=1)[:, : names.offered(offer)]


def sight_of(condition: Condition) -> Sight:
    """Return the sight of the scans of ``condition``: the camera direction that their shadows imply, and the noise."""
    half_width, (cell, _) = frame_of_scene(condition.scene).half_width, cells_of(condition)
    maps = [surface.height_map(half_width, cell) for surface in condition.surfaces.values()]
    noise = max((surface.noise for surface in condition.surfaces.values()), default=0.0)
    return found_sight(maps, noise)


def seen_surface(condition: Condition, replicate: int) -> HeightMap:
    """Return the upper surface of a replicate in the pixels of its condition, with holes filled."""
    return _seen(condition.surfaces[replicate], condition)


def frame_of_scene(scene: Scene) -> Frame:
    """Return the scales of the declared ``scene``: its charge, and its bodies' mean thickness, weighted by mass."""
    shares = np.array([body.mass_fraction for body in scene.bodies])
    density = float(shares.sum() / (shares / [body.density for body in scene.bodies]).sum())
    extents = [
        (body.clump.centres + body.clump.radii[:, None]).max(axis=0)
        - (body.clump.centres - body.clump.radii[:, None]).min(axis=0)
        for body in scene.bodies
    ]
    thickness = float(np.average([extent.min() for extent in extents], weights=shares))
    return frame_of(poured_mass(scene) / density, thickness)


def smallest_radius(scene: Scene) -> float:
    """Radius of the smallest member sphere of the declared bodies [m]."""
    return min(float(body.clump.radii.min()) for body in scene.bodies)


def resolution(condition: Condition) -> float:
    """Resolution of the condition's coarsest scan [m]; 0 without one."""
    return max((one.grid for one in condition.surfaces.values()), default=0.0)


def cells_of(condition: Condition) -> tuple[float, int]:
    """Return the width of the cells of the height maps of ``condition`` [m], and the number of cells per pixel side."""
    pixel, coarsest = frame_of_scene(condition.scene).thickness / PIXELS, resolution(condition)
    if coarsest == 0.0:
        return pixel / CELLS, CELLS
    return coarsest, max(1, int(pixel / coarsest + 1e-6))


def ring_heights(places: Array, heights: Array, frame: Frame) -> Array:
    """Return the mean heights [m] of the rings of ``frame`` from ``heights`` [m] listed at radii ``places`` [m].

    Heights are interpolated linearly and weighted by area. Inside the first radius the first height applies; beyond the
    last radius the height is zero.
    """
    inner = np.arange(len(frame.places))[:, None] * frame.ring_width
    radius = inner + (np.arange(PER_RING) + 0.5) / PER_RING * frame.ring_width
    found = np.interp(radius, places, heights, right=0.0)
    return np.asarray((found * radius).sum(axis=1) / radius.sum(axis=1), dtype=np.float64)


def _seen(surface: UpperSurface, condition: Condition, sight: Sight = PERFECT) -> HeightMap:
    cell, times = cells_of(condition)
    pixel = times * cell
    # Slightly less than a whole number of pixels: otherwise rounding up to cells would sometimes give one too many.
    half_width = (1.0 - ROUNDING) * pixel * np.ceil(frame_of_scene(condition.scene).half_width / pixel)
    return coarsened(without_holes(seen_through(surface.height_map(half_width, cell), sight)), times)


def coarse_map(surface: UpperSurface, condition: Condition) -> HeightMap:
    """Return the surface of a pile of ``condition`` in pixels one body thickness wide, for display."""
    seen, times = _seen(surface, condition), int(PIXELS)
    edge = len(seen.height) % (2 * times) // 2
    inner = slice(edge, len(seen.height) - edge)
    cropped = HeightMap(seen.height[inner, inner], seen.radius[inner, inner], seen.pixel)
    return coarsened(cropped, times)


def _listed_places(condition: Condition) -> Array | None:
    observation = condition.offered.get(LISTED)
    return None if observation is None else observation.x


def _plain(name: str) -> str:
    return name.partition("@")[0]


def _chosen(seen: Mapping[str, float], names: FeatureSet) -> Array:
    return np.array([seen[_plain(name)] for name in (*names.profile, *names.surface)])
