"""The table that a simulation prints: one line per pour as it finishes, then the means."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from explorer.tables.text_table import table_line, text_table
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


def _number(number: float | None, form: str) -> str:
    return "-" if number is None or not math.isfinite(number) else format(number, form)
