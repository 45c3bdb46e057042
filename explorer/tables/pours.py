"""What ``explorer simulate`` prints: a line per pour as it finishes, then the means; of a bench test, its quantities.

A bench test is kept as plain data: ``test``, ``body``, ``wall``, ``note``; ``quantities`` name → value, reference (what
was put in), error (value/reference − 1), spread, unit; ``series`` and ``table`` name → list of numbers; ``parameters``
path → value in SI, unit; ``versions``. A number that could not be measured is null.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from explorer.files.run_folder import json_text, parameters_text
from explorer.files.run_result import finite_or_none, parameter_values, versions
from explorer.tables.text_table import table_line, text_table
from solver import Record, Scene
from solver.observables import Value, observable_names, observe

if TYPE_CHECKING:
    from solver.single_body import BenchResult

COLUMNS = {
    "seed": -6,
    "outcome": 15,
    "time s": -7,
    "bodies": -6,
    "angle °": -7,
    "within °": -8,
    "apex mm": -7,
    "in rig g": -8,
    "wall s": -6,
}
"""Heading → width, negative for a column of numbers.

"angle" is the first observable of the rig, "within" its standard deviation over the views of one pile (the flanks, the
parts of the time), "in rig" the mass left in the container.
"""


class RunTable:
    """Prints through ``echo``; the heading comes with the first line."""

    def __init__(self, echo: Callable[[str], None]) -> None:
        self._echo = echo
        self._started = False

    def add(self, record: Record) -> None:
        """Print the line of one finished pour, and what its outcome means where it says more."""
        if not self._started:
            self._echo(table_line(list(COLUMNS), list(COLUMNS.values())))
            self._started = True
        seen = observe(record)
        angle, missing = seen[observable_names(record.scene)[0]], Value(math.nan, "")
        row = [
            str(record.seed),
            str(record.outcome),
            f"{record.steps * record.dt:.2f}",
            str(len(record.bodies.mass)),
            _number(angle.value, ".1f"),
            _number(angle.spread, ".1f"),
            _number(1e3 * seen.get("apex_height_m", missing).value, ".1f"),
            _number(1e3 * seen.get("residual_mass_kg", missing).value, ".2f"),
            f"{record.wall_s:.1f}",
        ]
        self._echo(table_line(row, list(COLUMNS.values())))
        if record.message:
            self._echo(f"        {record.message}")

    def summarise(self, result: dict[str, Any]) -> None:
        """Print the observables: of the pile, or of several replicates the means over those that are valid."""
        several = len(result["seeds"]) > 1
        keys = ("mean", "sd", "n") if several else ("value", "spread")
        rows = [
            (name, *(_number(entry[key], ".5g") for key in keys), entry["unit"])
            for name, entry in result["observables"].items()
        ]
        self._echo("")
        self._echo(text_table(("observable", *keys, "unit"), rows))
        if several:
            counted = ", ".join(f"{count} {outcome}" for outcome, count in result["outcomes"].items())
            self._echo(f"\n{len(result['seeds'])} pours: {counted}; means over those that are valid")
        self._echo(f"\n{energy_line([run['energy'] for run in result['runs']])}")


def energy_line(accounts: Sequence[dict[str, float | None]]) -> str:
    """Energy put in (mean), the share of it that was dissipated, and how far the worst account is off."""
    keys = ("put_in_J", "dissipated_J", "largest_error")
    put_in, dissipated, error = np.array([[account[key] for key in keys] for account in accounts], dtype=float).T
    return (
        f"energy put in: {_number(1e3 * put_in.mean(), '.4g')} mJ, "
        f"dissipated: {_number(100.0 * dissipated.sum() / put_in.sum(), '.4g')} %; "
        f"the account closes within {_number(100.0 * error.max(), '.2g')} %"
    )


def bench_data(scene: Scene, result: BenchResult) -> dict[str, Any]:
    """All about one bench test as plain data."""
    return {
        "title": scene.title,
        "test": result.test,
        "body": result.body,
        "wall": result.wall,
        "note": result.note,
        "quantities": {
            quantity.name: {
                "value": finite_or_none(quantity.value),
                "reference": finite_or_none(quantity.reference),
                "error": finite_or_none(quantity.error),
                "spread": finite_or_none(quantity.spread),
                "unit": quantity.unit,
            }
            for quantity in result.quantities
        },
        "series": {name: [finite_or_none(number) for number in numbers] for name, numbers in result.series},
        "table": {name: [finite_or_none(number) for number in numbers] for name, numbers in result.table},
        "parameters": parameter_values(scene),
        "versions": versions(),
    }


def bench_text(data: dict[str, Any]) -> str:
    """The same for people: quantities, then the table where there is one."""
    rows = [
        (
            name,
            _number(entry["value"], ".5g"),
            _number(entry["reference"], ".5g"),
            _percent(entry["error"]),
            entry["unit"],
        )
        for name, entry in data["quantities"].items()
    ]
    parts = [
        f"{data['test']}: {data['body']} on {data['wall']}",
        text_table(("quantity", "measured", "put in", "error %", "unit"), rows),
    ]
    if data["table"]:
        columns = data["table"]
        lines = [tuple(_number(number, ".5g") for number in row) for row in zip(*columns.values(), strict=True)]
        parts.append(text_table(tuple(columns), lines))
    return "\n\n".join([*parts, data["note"]] if data["note"] else parts)


def _percent(error: float | None) -> str:
    return "-" if error is None else f"{100.0 * error:+.3f}"


def write_bench(folder: Path, data: dict[str, Any]) -> None:
    """Write ``result.json`` and ``parameters.toml`` into an existing ``folder``."""
    (folder / "result.json").write_text(json_text(data) + "\n", encoding="utf-8")
    (folder / "parameters.toml").write_text(parameters_text(data["parameters"]), encoding="utf-8")


def _number(number: float | None, form: str) -> str:
    return "-" if number is None or not math.isfinite(number) else format(number, form)
