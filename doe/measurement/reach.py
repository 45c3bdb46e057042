"""What a measured data set can and cannot identify, before anything is simulated.

Counting: every summary of a fitted condition is one equation, every free parameter one unknown. With no more equations
than unknowns, the model fits the data whichever effect it lacks. Resolution of a summary: the standard error s/√n of
its mean over n replicates, and the 95 % half-width t₀.₉₇₅(n − 1) s/√n (Student 1908); for a single value, 1.96 times
its stated uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from doe.measurement.measurement import Condition, Measurement
from doe.measurement.summaries import summaries, summaries_of_data, summary_uncertainties
from doe.record import Record
from solver import EFFECTS, Telltale, named

DISCHARGE = ("discharge_", "discharged_mass_kg", "residual_mass_kg")
"""Prefixes of the names of observables of the flow out of a container."""
Z_95 = float(stats.norm.ppf(0.975))
"""Half-width of the central 95 % of a normal distribution, in standard deviations."""


@dataclass(frozen=True)
class SummaryResolution(Record):
    """How precisely a condition's replicates determine the mean of one summary."""

    summary: str
    unit: str
    replicates: int
    """Number of replicates that have a value."""
    mean: float
    sd: float
    standard_error: float
    half_width: float


@dataclass(frozen=True)
class ConditionReach(Record):
    """The summaries of one condition."""

    condition: str
    role: str
    replicates: int
    mean_of: int
    """Number of pours of which each replicate is the mean."""
    resolutions: tuple[SummaryResolution, ...]


@dataclass(frozen=True)
class Reach(Record):
    """What the data can identify."""

    conditions: tuple[ConditionReach, ...]
    equations: int
    """Summaries of the fitted conditions that have a spread."""
    unknowns: int
    """Free parameters."""
    measured: int
    """Number of these that were measured independently."""
    has_discharge: bool
    has_asymmetry: bool
    has_holdout: bool
    hidden_effects: tuple[str, ...]
    """Effects that no summary of a fitted condition could reveal."""
    warnings: tuple[str, ...]


def reach_of(measurement: Measurement) -> Reach:
    """Return what ``measurement`` can identify; nothing is simulated or fitted."""
    conditions = tuple(_condition_reach(condition) for condition in measurement.conditions)
    fitted = {part for condition in measurement.fit for summary in summaries(condition) for part in summary.parts}
    seen = {telltale for name in fitted if (known := named(name)) is not None for telltale in known.telltales}
    equations = sum(
        resolution.standard_error > 0.0
        for condition in conditions
        if condition.role == "fit"
        for resolution in condition.resolutions
    )
    reach = Reach(
        conditions=conditions,
        equations=equations,
        unknowns=len(measurement.parameters),
        measured=sum(parameter.mean is not None for parameter in measurement.parameters),
        has_discharge=any(name.startswith(DISCHARGE) for name in fitted),
        has_asymmetry=Telltale.ASYMMETRY in seen,
        has_holdout=bool(measurement.holdout),
        hidden_effects=tuple(name for name, kind in EFFECTS.items() if not seen.intersection(kind.telltales)),
        warnings=(),
    )
    return Reach(**{**vars(reach), "warnings": _warnings(reach)})


def _condition_reach(condition: Condition) -> ConditionReach:
    values, stated = summaries_of_data(condition), summary_uncertainties(condition)
    resolutions = tuple(
        _resolution(summary.name, summary.unit, values[:, k], float(stated[k]))
        for k, summary in enumerate(summaries(condition))
    )
    return ConditionReach(condition.name, condition.role, condition.replicates, condition.mean_of, resolutions)


def _resolution(name: str, unit: str, values: np.typing.NDArray[np.float64], stated: float) -> SummaryResolution:
    measured = values[np.isfinite(values)]
    n = measured.size
    mean = float(measured.mean()) if n else float("nan")
    if n >= 2:
        sd = float(measured.std(ddof=1))
        # Stated beside replicates it is of an instrument that errs equally in all: more pours do not make it smaller.
        error, instrument = sd / np.sqrt(n), stated if np.isfinite(stated) else 0.0
        both, half = np.hypot(error, instrument), np.hypot(stats.t.ppf(0.975, n - 1) * error, Z_95 * instrument)
        return SummaryResolution(name, unit, n, mean, sd, float(both), float(half))
    stated = stated if n else float("nan")
    return SummaryResolution(name, unit, n, mean, stated, stated, Z_95 * stated)


def _warnings(reach: Reach) -> tuple[str, ...]:
    found = []
    n, k = reach.equations, reach.unknowns
    if n <= 1 and k == reach.measured:
        found.append(
            "one number to fit: it can show that something is missing beside the measured parameters, not what"
        )
    elif n <= 1:
        found.append("one number to fit: any free parameter fits it exactly, so nothing that is missing can show")
    elif n <= k:
        found.append(f"{n} summaries against {k} free parameters: the model can fit what it lacks; nothing can show")
    elif n < 2 * k:
        found.append(f"{n} summaries against {k} free parameters: little is left to judge the fit by")
    for condition in reach.conditions:
        if condition.mean_of > 1:
            found.append(f"{condition.condition}: only means of pours: their scatter is taken from simulated pours")
        elif condition.replicates == 1:
            found.append(f"{condition.condition}: one replicate: its noise rests on the stated uncertainties alone")
        elif condition.replicates < 4:
            found.append(f"{condition.condition}: {condition.replicates} replicates fix no scatter; four or more do")
    if not reach.has_holdout:
        found.append("no holdout condition: an error on data that were not fitted cannot be given")
    if not reach.has_discharge:
        found.append("no discharge data in a fitted condition: what only shows in the flow stays unseen")
    if not reach.has_asymmetry:
        found.append("no left or right, no centroid in a fitted condition: a tilt or an offset stays unseen")
    return tuple(found)
