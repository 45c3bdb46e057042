"""The result of replicated pours as plain data: what ``simulate --json`` prints and ``result.json`` holds.

    outcome, message, seed, dt, steps    of the first seed
    observables     name → value and spread (within the pile) of the first seed, unit, and mean, sd, n over
                    the valid replicates (at rest, or measured) in which it could be measured
    outcomes        outcome → number of replicates
    runs            per seed: outcome, message, dt, steps, wall_s, energy, and name → value and spread;
                    energy: put in and dissipated [J], and the account's largest error as a fraction of what was put in
    parameters      path → value in SI, unit
    seeds, wall_s (of all), title, versions

A number that could not be measured is null.
"""

from __future__ import annotations

import datetime
import math
import platform
from collections import Counter
from collections.abc import Sequence
from importlib import metadata
from typing import Any

import numpy as np

from doe.provenance import About
from solver import PHYSICS, Record, Scene, Trace, parameters, value
from solver.observables import Value, observe

RUNTIME = ("taichi", "numpy")


def result_of(scene: Scene, records: Sequence[Record], wall_s: float) -> dict[str, Any]:
    """All about the ``records`` of one scene, in the order of their seeds; ``wall_s`` [s] for all of them."""
    observed = [observe(record) for record in records]
    first = records[0]
    return {
        "title": scene.title,
        "outcome": str(first.outcome),
        "message": first.message,
        "outcomes": dict(Counter(str(record.outcome) for record in records)),
        "observables": _observables(records, observed),
        "parameters": parameter_values(scene),
        "seed": first.seed,
        "seeds": [record.seed for record in records],
        "dt": first.dt,
        "steps": first.steps,
        "wall_s": wall_s,
        "runs": [_run(record, values) for record, values in zip(records, observed, strict=True)],
        "versions": versions(),
    }


def parameter_values(scene: Scene) -> dict[str, dict[str, Any]]:
    """Every parameter of ``scene``: path → value in SI (or the name of a choice), unit."""
    return {path: {"value": value(scene, path), "unit": entry.unit} for path, entry in parameters(scene).items()}


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


def _observables(records: Sequence[Record], observed: Sequence[dict[str, Value]]) -> dict[str, dict[str, Any]]:
    valid = [values for record, values in zip(records, observed, strict=True) if record.outcome.valid]
    return {
        name: _value(first) | {"unit": first.unit} | _over_replicates([values[name].value for values in valid])
        for name, first in observed[0].items()
    }


def _over_replicates(numbers: Sequence[float]) -> dict[str, Any]:
    finite = [number for number in numbers if math.isfinite(number)]
    return {
        "mean": float(np.mean(finite)) if finite else None,
        "sd": float(np.std(finite, ddof=1)) if len(finite) > 1 else None,
        "n": len(finite),
    }


def _run(record: Record, values: dict[str, Value]) -> dict[str, Any]:
    return {
        "seed": record.seed,
        "outcome": str(record.outcome),
        "message": record.message,
        "dt": record.dt,
        "steps": record.steps,
        "wall_s": record.wall_s,
        "energy": _energy(record.trace),
        "observables": {name: _value(observed) for name, observed in values.items()},
    }


def _energy(trace: Trace) -> dict[str, float | None]:
    put_in = trace.supplied_energy + trace.wall_work
    return {
        "put_in_J": finite_or_none(put_in[-1]),
        "dissipated_J": finite_or_none(trace.dissipated_energy[-1]),
        "largest_error": finite_or_none(np.abs(trace.energy_error).max()),
    }


def _value(observed: Value) -> dict[str, float | None]:
    return {"value": finite_or_none(observed.value), "spread": finite_or_none(observed.spread)}


def finite_or_none(number: float | None) -> float | None:
    """A number as JSON has it: None for NaN and infinity."""
    return None if number is None or not math.isfinite(number) else float(number)
