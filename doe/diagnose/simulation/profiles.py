"""Mean height over radius, for a picture of the pile: measured, and by a model's pours. Nothing is decided by it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from doe.measurement.measurement import Condition, Observation
from solver import Record, observe_named

FloatArray = npt.NDArray[np.float64]

PROFILE = "height_profile_m"


def measured_profile(condition: Condition) -> Observation | None:
    """The measured profiles: places x (k,) [m], values (replicates, k) [m]; None where the data offer none."""
    return condition.offered.get(PROFILE)


def profile_names(condition: Condition) -> tuple[str, ...]:
    """Names under which the k heights of a pour are kept; none where the data offer no profile."""
    profile = measured_profile(condition)
    return () if profile is None or profile.x is None else tuple(f"{PROFILE}({x:g})" for x in profile.x)


def profile_of_record(condition: Condition, record: Record) -> tuple[float, ...]:
    """Heights (k,) [m] of a run at the measured places; none where the data offer no profile."""
    profile = measured_profile(condition)
    if profile is None or profile.x is None:
        return ()
    return tuple(np.asarray(observe_named(record, {PROFILE: profile.x})[PROFILE]).tolist())
