"""The results of ``explorer simulate`` as records: what ``--json`` prints and ``result.json`` holds.

SI units. A number that could not be measured is NaN, and null in a file.
"""

from __future__ import annotations

import datetime
import math
import platform
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from typing import TYPE_CHECKING

import numpy as np

import doe.record
from doe.provenance import About
from solver import PHYSICS, Record, Scene, Trace, parameters, value
from solver.observables import Value, observe

if TYPE_CHECKING:
    from solver.single_body import BenchResult

RUNTIME = ("taichi", "numpy")


@dataclass(frozen=True)
class ParameterValue(doe.record.Record):
    """A parameter of a scene in SI, or the name of a choice."""

    value: float | str
    unit: str


@dataclass(frozen=True)
class Observed(doe.record.Record):
    """What was read off one pile; ``spread``: within it."""

    value: float
    spread: float


@dataclass(frozen=True)
class ObservedOverRuns(doe.record.Record):
    """An observable of the first run, and over the ``n`` valid ones in which it could be measured."""

    value: float
    spread: float
    unit: str
    mean: float
    sd: float
    n: int


@dataclass(frozen=True)
class EnergyAccount(doe.record.Record):
    """Energy put in and dissipated, and the account's largest error as a fraction of what was put in."""

    put_in_J: float
    dissipated_J: float
    largest_error: float


@dataclass(frozen=True, kw_only=True)
class PourResult(doe.record.Record):
    """One pour."""

    seed: int
    outcome: str
    message: str
    dt: float
    steps: int
    wall_s: float
    energy: EnergyAccount
    observables: dict[str, Observed]


@dataclass(frozen=True, kw_only=True)
class SimulationResult(doe.record.Record):
    """Replicated pours of one scene.

    Attributes
    ----------
    outcome, message, seed, dt, steps
        Of the first seed.
    outcomes
        Outcome → number of replicates.
    observables
        By name.
    parameters
        By path.
    runs
        In the order of ``seeds``.
    wall_s
        Of all.
    """

    title: str
    outcome: str
    message: str
    outcomes: dict[str, int]
    observables: dict[str, ObservedOverRuns]
    parameters: dict[str, ParameterValue]
    seed: int
    seeds: tuple[int, ...]
    dt: float
    steps: int
    wall_s: float
    runs: tuple[PourResult, ...]
    versions: dict[str, str | None]


@dataclass(frozen=True)
class BenchQuantity(doe.record.Record):
    """A measured number; ``reference``: what was put in, ``error``: value/reference − 1."""

    value: float
    reference: float
    error: float
    spread: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class BenchTestResult(doe.record.Record):
    """A bench test of one ``body`` on a ``wall``.

    Attributes
    ----------
    quantities
        By name.
    series
        Name with unit → values: curves, all of one length.
    table
        The same of a study beside the test; empty where there is none.
    parameters
        By path.
    """

    title: str
    test: str
    body: str
    wall: str
    note: str
    quantities: dict[str, BenchQuantity]
    series: dict[str, tuple[float, ...]]
    table: dict[str, tuple[float, ...]]
    parameters: dict[str, ParameterValue]
    versions: dict[str, str | None]


def simulation_result(scene: Scene, records: Sequence[Record], wall_s: float) -> SimulationResult:
    """All about the ``records`` of one scene, in the order of their seeds; ``wall_s`` [s] for all of them."""
    observed = [observe(record) for record in records]
    first = records[0]
    return SimulationResult(
        title=scene.title,
        outcome=str(first.outcome),
        message=first.message,
        outcomes=dict(Counter(str(record.outcome) for record in records)),
        observables=_observables(records, observed),
        parameters=parameter_values(scene),
        seed=first.seed,
        seeds=tuple(record.seed for record in records),
        dt=first.dt,
        steps=first.steps,
        wall_s=wall_s,
        runs=tuple(_run(record, values) for record, values in zip(records, observed, strict=True)),
        versions=versions(),
    )


def bench_test_result(scene: Scene, result: BenchResult) -> BenchTestResult:
    """All about one bench test."""
    return BenchTestResult(
        title=scene.title,
        test=result.test,
        body=result.body,
        wall=result.wall,
        note=result.note,
        quantities={
            quantity.name: BenchQuantity(
                quantity.value,
                _or_nan(quantity.reference),
                _or_nan(quantity.error),
                _or_nan(quantity.spread),
                quantity.unit,
            )
            for quantity in result.quantities
        },
        series=dict(result.series),
        table=dict(result.table),
        parameters=parameter_values(scene),
        versions=versions(),
    )


def parameter_values(scene: Scene) -> dict[str, ParameterValue]:
    """Every parameter of ``scene``, by path."""
    return {path: ParameterValue(value(scene, path), entry.unit) for path, entry in parameters(scene).items()}


def versions() -> dict[str, str | None]:
    """Versions of this package, of its physics, of what calculates, and of Python; None for one not installed."""
    return {
        "repose-explorer": package_version("repose-explorer"),
        "physics": str(PHYSICS),
        **{name: package_version(name) for name in RUNTIME},
        "python": platform.python_version(),
    }


def made_today(author: str, notes: str) -> About:
    """Who asked for a result, today."""
    return About(author.strip(), datetime.date.today().isoformat(), notes.strip())


def package_version(distribution: str) -> str | None:
    """Installed version of a distribution, or None."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def _observables(records: Sequence[Record], observed: Sequence[dict[str, Value]]) -> dict[str, ObservedOverRuns]:
    valid = [values for record, values in zip(records, observed, strict=True) if record.outcome.valid]
    found = {}
    for name, first in observed[0].items():
        finite = [number for values in valid if math.isfinite(number := values[name].value)]
        mean = float(np.mean(finite)) if finite else math.nan
        sd = float(np.std(finite, ddof=1)) if len(finite) > 1 else math.nan
        found[name] = ObservedOverRuns(first.value, _or_nan(first.spread), first.unit, mean, sd, len(finite))
    return found


def _run(record: Record, values: dict[str, Value]) -> PourResult:
    return PourResult(
        seed=record.seed,
        outcome=str(record.outcome),
        message=record.message,
        dt=record.dt,
        steps=record.steps,
        wall_s=record.wall_s,
        energy=_energy(record.trace),
        observables={name: Observed(one.value, _or_nan(one.spread)) for name, one in values.items()},
    )


def _energy(trace: Trace) -> EnergyAccount:
    put_in = trace.supplied_energy + trace.wall_work
    return EnergyAccount(float(put_in[-1]), float(trace.dissipated_energy[-1]), float(np.abs(trace.energy_error).max()))


def _or_nan(number: float | None) -> float:
    return math.nan if number is None else number
