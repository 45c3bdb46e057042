"""What a condition's observables are in one replicate of the data, and in one run: two sources, one vocabulary.

A reading is a number, or the values of a curve at the places that the data list. The slopes of a drum's free surface
are taken over the listed places, in data and runs alike, where the data have the profile.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from doe.measurement.measurement import Condition
from solver import Record, observe_named, slope_angle_deg

Array = npt.NDArray[np.float64]
Readings = dict[str, float | Array]

PROFILE = "surface_profile_m"
CORE = 10.0e-3
"""Half width [m] within which, ends excluded, ``slope_core_deg`` is taken."""
SLOPES = {"slope_deg": np.inf, "slope_core_deg": float(np.nextafter(CORE, 0.0))}
"""Slopes of the profile: name → largest |x| [m] of the places that count."""


def readings_of_data(condition: Condition, replicate: int) -> Readings:
    """Readings of one replicate of the data, numbered from 1; NaN where nothing was measured."""
    return {
        observation.observable: float(row) if np.ndim(row) == 0 else row
        for observation in condition.observations
        for row in [observation.values[replicate - 1]]
    }


def readings_of_record(condition: Condition, record: Record) -> Readings:
    """The same readings of a run, whatever its outcome; NaN where one cannot be read."""
    places = {observation.observable: observation.x for observation in condition.observations}
    readings: Readings = observe_named(record, places)
    x = places.get(PROFILE)
    if x is not None:
        for name in SLOPES.keys() & readings.keys():
            readings[name] = slope_of_profile(name, x, np.asarray(readings[PROFILE]))
    return readings


def slope_of_profile(name: str, x: Array, height: Array) -> float:
    """Slope [°] called ``name`` of the surface ``height`` [m] at ``x`` [m], (k,) each; NaN below three places."""
    return slope_angle_deg(x, height, SLOPES[name])
