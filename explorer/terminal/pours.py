"""What ``explorer simulate`` prints: a line per pour as it ends, then the means; of a bench test, its quantities."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np

from explorer.files.run_result import BenchTestResult, EnergyAccount, SimulationResult
from explorer.terminal.text_table import table_line, text_table
from solver import Record
from solver.observables import Value, observable_names, observe

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

    def summarise(self, result: SimulationResult) -> None:
        """Print the observables: of the pile, or of several replicates the means over those that are valid."""
        several = len(result.seeds) > 1
        keys = ("mean", "sd", "n") if several else ("value", "spread")
        rows = [
            (name, *(_number(getattr(entry, key), ".5g") for key in keys), entry.unit)
            for name, entry in result.observables.items()
        ]
        self._echo("")
        self._echo(text_table(("observable", *keys, "unit"), rows))
        if several:
            counted = ", ".join(f"{count} {outcome}" for outcome, count in result.outcomes.items())
            self._echo(f"\n{len(result.seeds)} pours: {counted}; means over those that are valid")
        self._echo(f"\n{energy_line([run.energy for run in result.runs])}")


def energy_line(accounts: Sequence[EnergyAccount]) -> str:
    """Energy put in (mean), the share of it that was dissipated, and how far the worst account is off."""
    put_in, dissipated, error = np.array([dataclasses.astuple(account) for account in accounts]).T
    return (
        f"energy put in: {_number(1e3 * put_in.mean(), '.4g')} mJ, "
        f"dissipated: {_number(100.0 * dissipated.sum() / put_in.sum(), '.4g')} %; "
        f"the account closes within {_number(100.0 * error.max(), '.2g')} %"
    )


def bench_text(result: BenchTestResult) -> str:
    """The quantities of a bench test, then the table where there is one."""
    rows = [
        (name, _number(one.value, ".5g"), _number(one.reference, ".5g"), _percent(one.error), one.unit)
        for name, one in result.quantities.items()
    ]
    parts = [
        f"{result.test}: {result.body} on {result.wall}",
        text_table(("quantity", "measured", "put in", "error %", "unit"), rows),
    ]
    if result.table:
        lines = [tuple(_number(number, ".5g") for number in row) for row in zip(*result.table.values(), strict=True)]
        parts.append(text_table(tuple(result.table), lines))
    return "\n\n".join([*parts, result.note] if result.note else parts)


def _percent(error: float) -> str:
    return "-" if math.isnan(error) else f"{100.0 * error:+.3f}"


def _number(number: float | None, form: str) -> str:
    return "-" if number is None or not math.isfinite(number) else format(number, form)
