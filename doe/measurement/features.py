"""The numbers that describe a pile of a condition as a whole, in blocks; each offered by some kinds of data only.

    scalars    the summaries of the condition (``summaries.py``)          any data
    profile    rings of the mean height                                   a scan, or a table of heights over the radius
    surface    the rest of ``solver.SURFACE_NAMES``                       a scan

Readings of a stored pour: the height map is drawn from the member spheres of the raw pour as a scanner sees it from
above, and read by the functions that read a scan.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.measurement.measurement import Condition
from doe.measurement.summaries import summaries_of_record, summary_names
from solver import (
    PROFILE_NAMES,
    SURFACE_NAMES,
    Frame,
    Record,
    Scene,
    frame_of,
    height_map,
    pour_rig,
    poured_mass,
    surface_features,
)

Array = npt.NDArray[np.float64]

PIXELS = 4.0
"""Pixels of a height map along the thickness of a body."""
SCALARS, PROFILE, SCAN = "scalars", "profile", "scan"
OFFERS = (SCALARS, PROFILE, SCAN)
"""What a measurement may offer; each holds the ones before."""


@dataclass(frozen=True)
class FeatureSet:
    """Names of the features of one condition, the scalars first, then the profile's, then the other ones of a scan."""

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


def feature_set(condition: Condition) -> FeatureSet:
    """The features of ``condition``; of a rig that leaves no heap, its scalars alone."""
    if not pour_rig(condition.scene).leaves_heap:
        return FeatureSet(summary_names(condition), (), ())
    surface = tuple(name for name in SURFACE_NAMES if name not in PROFILE_NAMES)
    return FeatureSet(summary_names(condition), PROFILE_NAMES, surface)


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


def features_of_record(condition: Condition, record: Record) -> Array:
    """Values of ``feature_set(condition).names`` of a run of the condition's set-up, NaN where one cannot be read.

    Scales are those of the declared scene, whatever acted in the run.
    """
    names, scalars = feature_set(condition), summaries_of_record(condition, record)
    if not names.profile:
        return scalars
    frame = frame_of_scene(condition.scene)
    pixel = frame.thickness / PIXELS
    seen: Mapping[str, float] = surface_features(
        height_map(record.pile.spheres, np.zeros(2), frame.half_width, pixel), frame
    )
    return np.concatenate([scalars, [seen[name] for name in (*names.profile, *names.surface)]])
