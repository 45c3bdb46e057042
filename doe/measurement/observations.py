"""Observations of one condition, from its table, scanned piles and photographs or from a run, under the same names.

Raw data take precedence and are read by the functions that read our runs: pile observables come from scanned piles or,
without them, from photographs; the slopes in a drum come from the listed surface profile. The table's values of these
observables serve only as a cross-check.

A reading of one replicate of the data, or of one run, is a number or the values of a curve at the places that the data
list. Where the data include the surface profile of a drum, its slopes are taken over the listed places, in data and
runs alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from doe.errors import MeasurementError
from doe.measurement.long_form import read_long_form
from doe.measurement.measurement import Condition, CrossCheck, Observation
from doe.measurement.piles import pile_values, read_piles
from solver import Record, Scene, named, observe_named, slope_angle_deg

Array = npt.NDArray[np.float64]
Readings = dict[str, float | Array]
Values = dict[str, tuple[Array | None, Array]]
Origin = Literal["table", "piles", "photographs", "profile"]

PROFILE = "surface_profile_m"
CORE = 10.0e-3
"""Half width [m], ends excluded, of the range over which ``slope_core_deg`` is taken."""
SLOPES = {"slope_deg": np.inf, "slope_core_deg": float(np.nextafter(CORE, 0.0))}
"""Slopes of the profile: name → largest |x| [m] of the places used."""


def read_observations(
    name: str,
    table_path: Path,
    pile_paths: Mapping[int, Path],
    photographed: Values,
    scene: Scene,
    uncertainty: Mapping[str, float],
) -> tuple[int, tuple[Observation, ...], tuple[CrossCheck, ...], tuple[str, ...]]:
    """Return the number of replicates, observations, cross-checks and ignored items of the condition ``name``.

    ``photographed``: the readings of its photographs.
    """
    table = read_long_form(table_path)
    ignored = [f"{table_path.name}: {unknown}: no such observable" for unknown in table.unknown]
    scanned = max(table.replicates, *pile_paths, 0)
    replicates = max(scanned, *(values.size for _, values in photographed.values()), 0)
    for replicate in range(table.replicates + 1, scanned + 1):
        if replicate not in pile_paths:
            raise MeasurementError(
                f"{pile_paths[scanned]}: replicate {replicate} of {scanned} is missing; allowed: numbered from 1 "
                "without gaps"
            )
    stated = _padded(table.values, replicates)
    piles: Values = {}
    if pile_paths and len(scene.bodies) == 1:
        listed = {key: x for key, (x, _) in stated.items()}
        piles = pile_values(read_piles(pile_paths, scene), scene, replicates, listed)
    elif pile_paths:
        ignored.append(f"piles of {name}: a scan does not say which component a body is; one component is read")
    photographs = _padded({key: value for key, value in photographed.items() if key not in piles}, replicates)
    profile = _slopes(stated)
    checks = [
        _cross_check(name, observable, values, stated[observable][1])
        for observable, (_, values) in (piles | photographs | profile).items()
        if observable in stated
    ]
    observations = []
    raw: tuple[tuple[Origin, Values], ...] = (
        ("piles", piles),
        ("photographs", photographs),
        ("profile", profile),
    )
    for origin, values_by_name in raw:
        for observable, (x, values) in values_by_name.items():
            observation = _observation(observable, x, values, uncertainty, origin)
            if _has_spread(observation):
                observations.append(observation)
            else:
                some = any(_measured(observation.values))
                lack = "one replicate and no [uncertainty]" if some else "no replicate has a value"
                ignored.append(f"{name}: {observable} from {origin}: {lack}")
    taken = {observation.observable for observation in observations}
    for observable, (x, values) in stated.items():
        if observable in taken:
            continue
        observation = _observation(observable, x, values, uncertainty, "table")
        if _has_spread(observation):
            observations.append(observation)
        elif observable not in piles | photographs | profile:
            raise MeasurementError(
                f"{table_path}: {observable}: one replicate has no scatter; allowed: two or more replicates, or "
                f"{observable} in [uncertainty]"
            )
    ordered = tuple(sorted(observations, key=lambda observation: observation.observable))
    return replicates, ordered, tuple(checks), tuple(ignored)


def readings_of_data(condition: Condition, replicate: int) -> Readings:
    """Return the readings of one replicate of the data, numbered from 1; NaN where nothing was measured."""
    return {
        observation.observable: float(row) if np.ndim(row) == 0 else row
        for observation in condition.observations
        for row in [observation.values[replicate - 1]]
    }


def readings_of_record(condition: Condition, record: Record) -> Readings:
    """Return the same readings from a run, whatever its outcome; NaN where one cannot be read."""
    places = {observation.observable: observation.x for observation in condition.observations}
    readings: Readings = observe_named(record, places)
    x = places.get(PROFILE)
    if x is not None:
        for name in SLOPES.keys() & readings.keys():
            readings[name] = slope_of_profile(name, x, np.asarray(readings[PROFILE]))
    return readings


def slope_of_profile(name: str, x: Array, height: Array) -> float:
    """Return the slope [°] called ``name`` of the surface ``height`` [m] at ``x`` [m], both of shape (k,).

    NaN for fewer than three places.
    """
    return slope_angle_deg(x, height, SLOPES[name])


def _padded(given: Mapping[str, tuple[Array | None, Array]], replicates: int) -> Values:
    """Values, with rows of NaN for the replicates missing from ``given``."""
    return {
        name: (
            x,
            np.pad(values, [(0, replicates - len(values))] + [(0, 0)] * (values.ndim - 1), constant_values=np.nan),
        )
        for name, (x, values) in given.items()
    }


def _slopes(stated: Values) -> Values:
    if PROFILE not in stated:
        return {}
    x, heights = stated[PROFILE]
    assert x is not None
    return {name: (None, np.array([slope_of_profile(name, x, height) for height in heights])) for name in SLOPES}


def _observation(
    observable: str, x: Array | None, values: Array, uncertainty: Mapping[str, float], origin: Origin
) -> Observation:
    known = named(observable)
    assert known is not None
    return Observation(observable, known.unit, x, values, uncertainty.get(observable), origin)


def _has_spread(observation: Observation) -> bool:
    """True if at least two replicates have a value, or one has and its uncertainty is stated."""
    return sum(_measured(observation.values)) >= (2 if observation.uncertainty is None else 1)


def _measured(values: Array) -> Iterator[bool]:
    return (bool(np.isfinite(row).any()) for row in values)


def _cross_check(condition: str, observable: str, ours: Array, theirs: Array) -> CrossCheck:
    both = np.isfinite(ours) & np.isfinite(theirs)
    known = named(observable)
    assert known is not None
    if not both.any():
        return CrossCheck(condition, observable, known.unit, float("nan"), float("nan"), float("nan"))
    rms = float(np.sqrt(np.mean((ours[both] - theirs[both]) ** 2)))
    return CrossCheck(condition, observable, known.unit, float(ours[both].mean()), float(theirs[both].mean()), rms)
