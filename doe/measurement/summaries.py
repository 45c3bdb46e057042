"""The vector by which data and runs are compared: at most twelve numbers per condition, chosen without looking at them.

The choice depends only on the names (and places) that the data offer:

1. the scalars of ``PREFERRED`` that are offered, in that order, up to ``MOST``; ``flank_asymmetry_deg`` is the left
   angle of repose minus the right one;
2. other scalars, sorted by name, except those that repeat information already present (single views and flanks where
   the mean over all views is offered, slopes of a profile that is offered);
3. while there are fewer than ``LEAST``: values of the curves, in the order of ``CURVES``, at up to eight places spread
   evenly over the listed ones.

The same code computes the vector of a replicate and of a run (`readings_of_data`, `readings_of_record`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.holdout import MeasuredReplicates
from doe.measurement.measurement import Condition
from doe.measurement.observations import PROFILE, SLOPES, Readings, readings_of_data, readings_of_record
from solver import Record

Array = npt.NDArray[np.float64]

MOST, LEAST = 12, 8
PLACES = 8
"""Largest number of places taken from a curve."""
ASYMMETRY = "flank_asymmetry_deg"
LEFT, RIGHT, MEAN = "angle_of_repose_left_deg", "angle_of_repose_right_deg", "angle_of_repose_deg"
PREFERRED = (
    MEAN,
    "apex_height_m",
    "centre_height_m",
    "footprint_r50_m",
    "footprint_r90_m",
    "stray_fraction",
    "centroid_x_m",
    "centroid_y_m",
    "discharge_t10_s",
    "discharge_t90_s",
    ASYMMETRY,
    "residual_mass_kg",
    "discharge_t50_s",
    "solid_fraction",
)
"""In order of preference. t50 comes late: at a steady rate it lies between t10 and t90."""
CURVES = (PROFILE, "height_profile_m", "discharged_mass_kg")


@dataclass(frozen=True)
class Summary:
    """One number of the vector: a scalar, the difference of two, or a curve's value at one of its places."""

    name: str
    unit: str
    parts: tuple[str, ...]
    """Observables that it is computed from; the second is subtracted from the first."""
    place: int | None = None
    """Index of the place on a curve; None for a scalar."""

    def of(self, readings: Readings) -> float:
        """Return its value."""
        values = [np.asarray(readings[part]) for part in self.parts]
        numbers = [float(value if self.place is None else value[self.place]) for value in values]
        return numbers[0] - sum(numbers[1:])


def summaries(condition: Condition) -> tuple[Summary, ...]:
    """Return the summaries of ``condition``, in the order of the vector."""
    scalars = {name: o.unit for name, o in condition.offered.items() if o.x is None}
    offered = {name: Summary(name, unit, (name,)) for name, unit in scalars.items()}
    if LEFT in scalars and RIGHT in scalars:
        offered[ASYMMETRY] = Summary(ASYMMETRY, "deg", (LEFT, RIGHT))
    others = [name for name in sorted(offered) if name not in PREFERRED and not _repeats(name, condition)]
    chosen = [offered[name] for name in (*PREFERRED, *others) if name in offered][:MOST]
    for name in CURVES:
        if name in condition.offered and len(chosen) < LEAST:
            chosen += _of_curve(condition, name, min(PLACES, MOST - len(chosen)))
    return tuple(chosen)


def summary_names(condition: Condition) -> tuple[str, ...]:
    """Return the names of the d summaries."""
    return tuple(summary.name for summary in summaries(condition))


def summaries_of_data(condition: Condition) -> Array:
    """Return the vectors of the replicates, shape (replicates, d); NaN where something was not measured."""
    chosen = summaries(condition)
    rows = [readings_of_data(condition, replicate) for replicate in range(1, condition.replicates + 1)]
    return np.array([[summary.of(row) for summary in chosen] for row in rows])


def summaries_of_record(condition: Condition, record: Record) -> Array:
    """Return the vector of a run of the condition's scene, shape (d,); NaN where something cannot be read."""
    readings = readings_of_record(condition, record)
    return np.array([summary.of(readings) for summary in summaries(condition)])


def summary_uncertainties(condition: Condition) -> Array:
    """Return the stated standard deviation of one value of each summary, shape (d,); NaN where none is stated."""
    stated = {name: o.uncertainty for name, o in condition.offered.items()}
    rows = [[stated[part] for part in summary.parts] for summary in summaries(condition)]
    return np.array([np.nan if None in row else float(np.linalg.norm(np.array(row, dtype=float))) for row in rows])


def _repeats(name: str, condition: Condition) -> bool:
    if name in (LEFT, RIGHT) or name.startswith(f"{MEAN}@"):
        return MEAN in condition.offered
    return name in SLOPES and PROFILE in condition.offered


def _of_curve(condition: Condition, name: str, most: int) -> list[Summary]:
    observation = condition.offered[name]
    assert observation.x is not None
    n = observation.x.size
    places = np.unique(np.linspace(0, n - 1, min(most, n)).round().astype(int)).tolist()
    return [Summary(f"{name}({observation.x[k]:g})", observation.unit, (name,), k) for k in places]


def replicates_of(condition: Condition) -> MeasuredReplicates:
    """Return the measured replicates of ``condition``."""
    return MeasuredReplicates(
        condition.name,
        summary_names(condition),
        complete_rows(condition),
        np.nan_to_num(summary_uncertainties(condition)),
        condition.mean_of,
    )


def complete_rows(condition: Condition) -> Array:
    """Return the measured replicates for which every summary could be read, shape (r, d)."""
    data = summaries_of_data(condition)
    return np.asarray(data[np.isfinite(data).all(axis=1)], dtype=np.float64)
