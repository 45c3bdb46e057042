"""What the analysis of a bench test returns: plain records, and from rows one value per replicate, summed up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from doe.laboratory.hertz import HertzRange
from doe.laboratory.linear_range import LinearRange
from doe.laboratory.reading_error import ReadingError, propagated, reading_error
from doe.laboratory.replicates import ReplicateSummary, summarise
from doe.laboratory.tables import Reading, Table
from doe.record import Record

CONDITIONS = ("drop_height",)
"""Names of what is carried along for the twins, and no result."""


@dataclass(frozen=True)
class Derived(Record):
    """One quantity of one component or pair, from replicates; SI.

    file: that the readings stand in. parameter: where it belongs in a material file
    (``pair.seed.plate.static_friction``), empty if it is no parameter. reading: what the errors add that the readings
    declare, None where they declare none.
    """

    name: str
    unit: str
    of: tuple[str, ...]
    formula: str
    file: str
    replicates: tuple[str, ...]
    values: tuple[float, ...]
    summary: ReplicateSummary
    parameter: str = ""
    notes: tuple[str, ...] = ()
    reading: ReadingError | None = None


@dataclass(frozen=True)
class Estimate(Record):
    """A quantity from the means of several tests, with its 95 % interval; SI. ``df`` by Welch and Satterthwaite."""

    name: str
    unit: str
    of: tuple[str, ...]
    formula: str
    files: tuple[str, ...]
    value: float
    standard_error: float
    df: float
    low: float
    high: float
    parameter: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class CurveFit(Record):
    """One force–displacement curve [m, N], the part that counts, straight or Hertzian, and its modulus [Pa]."""

    quantity: str
    of: tuple[str, ...]
    replicate: str
    displacement: tuple[float, ...]
    force: tuple[float, ...]
    fit: LinearRange | HertzRange
    modulus: float


@dataclass(frozen=True)
class LabResult(Record):
    """Everything that one table of readings gave."""

    test: str
    file: str
    derived: tuple[Derived, ...]
    estimates: tuple[Estimate, ...] = ()
    curves: tuple[CurveFit, ...] = ()
    notes: tuple[str, ...] = ()


def derived(
    table: Table,
    name: str,
    unit: str,
    of: tuple[str, ...],
    formula: str,
    replicates: Sequence[str],
    values: Sequence[float],
    parameter: str = "",
    notes: tuple[str, ...] = (),
    errors: Sequence[float] = (),
) -> Derived:
    """A quantity with the summary of its ``values`` (SI), one per replicate; ``errors``: by their readings, or none."""
    names, numbers = tuple(replicates), tuple(values)
    summary = summarise(numbers)
    reading = reading_error(errors, summary)
    return Derived(name, unit, of, formula, table.file, names, numbers, summary, parameter, notes, reading)


def of_rows(
    table: Table,
    name: str,
    unit: str,
    of: tuple[str, ...],
    formula: str,
    rows: Sequence[Reading],
    value: Callable[[Reading], float],
    parameter: str = "",
    notes: tuple[str, ...] = (),
) -> Derived:
    """``value`` of each of the ``rows``, which are of one component or pair, and what their readings' errors add."""
    errors = [propagated((row,), lambda rows: value(rows[0])) for row in rows]
    names, values = [row.replicate for row in rows], list(map(value, rows))
    return derived(table, name, unit, of, formula, names, values, parameter, notes, errors)


def per_row(
    table: Table, name: str, unit: str, formula: str, value: Callable[[Reading], float], parameter: Callable[..., str]
) -> tuple[Derived, ...]:
    """``value`` of every row, one quantity per component or pair; ``parameter`` makes its path from the names."""
    return tuple(
        of_rows(table, name, unit, of, formula, rows, value, parameter(*of)) for of, rows in table.groups().items()
    )


def no_parameter(*of: str) -> str:
    """For what is measured and no part of the model."""
    return ""
