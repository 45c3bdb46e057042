"""The numbers that describe the pile of a condition as a whole; of data and of runs by the same functions.

    scalars    the summaries of the condition (``summaries.py``): any data
    profile    rings of the mean height: a scan, or heights listed over the radius
    surface    heights of the covered area, texture, and where the pile leans: a scan

A run is seen as the data were. Both are seen in cells as wide as the scans' resolution, whose means over a quarter of a
body's thickness are the pixels of a height map: a mean is not shifted by resolution or noise, as the highest point of a
pixel is. Where only heights over the radius are listed, a run's rings are made of its heights at the listed places.
Texture and classes of heights are left out where a scan is too coarse to see bodies, what depends on the axis where a
scan does not know it.
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
"""What a measurement may offer; each holds the ones before."""
LISTED = "height_profile_m"
PIXELS, CELLS = 4.0, 3
"""Pixels of a height map along the thickness of a body, and cells along a pixel where no scan limits them."""
FINE = 0.25
"""Resolution up to which a scan shows single bodies, as a share of the diameter of the smallest member sphere."""
ROUNDING = 1e-12
"""Share of a length that a quotient of two may be off."""
PER_RING = 20
"""Radii in a ring over which listed heights are averaged."""


@dataclass(frozen=True)
class FeatureSet:
    """Names of the features of one condition: the scalars, then the profile's, then the other ones of a scan."""

    scalars: tuple[str, ...]
    profile: tuple[str, ...]
    surface: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """All of them."""
        return self.scalars + self.profile + self.surface

    def offered(self, offer: str) -> int:
        """How many of the first ones data of the kind ``offer`` give."""
        parts = (self.scalars, self.profile, self.surface)
        return sum(len(part) for part in parts[: OFFERS.index(offer) + 1])


def offer_of(condition: Condition) -> str:
    """The most that the data of ``condition`` offer."""
    if condition.surfaces:
        return SCAN
    return PROFILE if _listed_places(condition) is not None else SCALARS


def feature_set(condition: Condition) -> FeatureSet:
    """The features of a run of ``condition``: all that its data may offer, and where they have only scalars, what they
    would offer with a scan. Of a rig that leaves no heap, its scalars alone.
    """
    scalars = summary_names(condition)
    if not pour_rig(condition.scene).leaves_heap:
        return FeatureSet(scalars, (), ())
    surface: tuple[str, ...] = BULK_NAMES
    if resolution(condition) <= FINE * 2.0 * smallest_radius(condition.scene):
        surface += HISTOGRAM_NAMES + TEXTURE_NAMES
    if all(one.on_axis for one in condition.surfaces.values()):
        surface += ASYMMETRY_NAMES
    # A number that is read otherwise has another name, so that a store does not take one for the other.
    cell, times = cells_of(condition)
    seen_as = f"@{times} x {1e3 * cell:.4g} mm" if resolution(condition) > 0.0 else ""
    places = _listed_places(condition)
    listed_as = seen_as if places is None or condition.surfaces else f"@{zlib.crc32(places.tobytes()):08x}"
    return FeatureSet(
        scalars, tuple(f"{name}{listed_as}" for name in PROFILE_NAMES), tuple(f"{name}{seen_as}" for name in surface)
    )


def features_of_record(condition: Condition, record: Record, sight: Sight = PERFECT) -> Array:
    """Values of ``feature_set(condition).names`` of a run of the condition's set-up, NaN where one cannot be read.

    ``sight``: what its surface is seen through.

    Scales are those of the declared scene, whatever acted in the run.
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
    """Values of the features that the data offer, (replicates, n), by ``feature_set(condition)``; NaN where missing."""
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
    """What the scans of ``condition`` were seen through: the camera that their shadows tell of, and their noise."""
    half_width, (cell, _) = frame_of_scene(condition.scene).half_width, cells_of(condition)
    maps = [surface.height_map(half_width, cell) for surface in condition.surfaces.values()]
    noise = max((surface.noise for surface in condition.surfaces.values()), default=0.0)
    return found_sight(maps, noise)


def seen_surface(condition: Condition, replicate: int) -> HeightMap:
    """The upper surface of a replicate in the pixels of its condition, holes filled."""
    return _seen(condition.surfaces[replicate], condition)


def frame_of_scene(scene: Scene) -> Frame:
    """Scales of the declared ``scene``: its charge, and the thickness of its bodies by mass."""
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
    """Width of the cells in which piles of ``condition`` are seen [m], and cells along a pixel."""
    pixel, coarsest = frame_of_scene(condition.scene).thickness / PIXELS, resolution(condition)
    if coarsest == 0.0:
        return pixel / CELLS, CELLS
    return coarsest, max(1, int(pixel / coarsest + 1e-6))


def ring_heights(places: Array, heights: Array, frame: Frame) -> Array:
    """Mean heights [m] of the rings of ``frame`` from ``heights`` [m] listed at radii ``places`` [m], linear between.

    Weighted by the area; the first height holds down to the axis, beyond the last place there is nothing.
    """
    inner = np.arange(len(frame.places))[:, None] * frame.ring_width
    radius = inner + (np.arange(PER_RING) + 0.5) / PER_RING * frame.ring_width
    found = np.interp(radius, places, heights, right=0.0)
    return np.asarray((found * radius).sum(axis=1) / radius.sum(axis=1), dtype=np.float64)


def _seen(surface: UpperSurface, condition: Condition, sight: Sight = PERFECT) -> HeightMap:
    cell, times = cells_of(condition)
    pixel = times * cell
    # A trace less than a whole number of pixels: rounded up in cells, it would else be one cell too many now and then.
    half_width = (1.0 - ROUNDING) * pixel * np.ceil(frame_of_scene(condition.scene).half_width / pixel)
    return coarsened(without_holes(seen_through(surface.height_map(half_width, cell), sight)), times)


def coarse_map(surface: UpperSurface, condition: Condition) -> HeightMap:
    """The surface of a pile of ``condition`` in pixels a body's thickness wide, to be looked at."""
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
