"""A condition's table in long form: replicate,observable,x,value[,unit] → one array per observable.

`doe.table_file` reads the cells and numbers; ``#`` starts a comment. Values are in SI units, angles in degrees, unless
a column ``unit`` names another unit. The x of a scalar is empty; for a curve it is the place. Missing rows are missing
data (NaN).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from doe.errors import MeasurementError
from doe.table_file import check_cells, read_table
from solver import ParameterError, all_names, named, parse_quantity

Array = npt.NDArray[np.float64]
MOST_BYTES = 50_000_000
COLUMNS = ["replicate", "observable", "x", "value"]
ANGLE = "angle_of_repose"
"""Common prefix of the names of all angles of repose, whatever they are read off. They may be negative: one flank can
slope the other way."""
UNIT_SUFFIXES = ("m", "cm", "mm", "um", "s", "ms", "kg", "g", "mg", "deg", "rad")
"""Suffixes by which a name is recognised as an observable in another unit."""


@dataclass(frozen=True)
class LongRow:
    """One number of the table, SI."""

    line: int
    replicate: int
    observable: str
    x: float | None
    value: float


@dataclass(frozen=True, eq=False)
class LongForm:
    """A table: the number of replicates, and for each observable its places (None for a scalar) and its values.

    Values have shape (r,) for a scalar and (r, k) for a curve.
    """

    replicates: int
    values: dict[str, tuple[Array | None, Array]]
    unknown: tuple[str, ...]
    """Names that are not observables, sorted."""


def read_long_form(path: Path) -> LongForm:
    """Read the table in ``path``; raises MeasurementError with one line naming file, line and what is allowed."""
    rows, unknown = [], set()
    for row in _rows(path):
        if isinstance(row, str):
            unknown.add(row)
        else:
            rows.append(row)
    if not rows:
        raise MeasurementError(f"{path}: no row with a known observable")
    numbers = sorted({row.replicate for row in rows})
    replicates = len(numbers)
    missing = next((k for k, number in enumerate(numbers, start=1) if number != k), None)
    if missing is not None:
        raise MeasurementError(
            f"{path}: replicate: {missing} of {numbers[-1]} is missing; allowed: numbered from 1 without gaps"
        )
    by_name: dict[str, list[LongRow]] = {}
    for row in rows:
        by_name.setdefault(row.observable, []).append(row)
    values = {name: _array(path, by_name[name], replicates) for name in sorted(by_name)}
    return LongForm(replicates, values, tuple(sorted(unknown)))


def _rows(path: Path) -> Iterator[LongRow | str]:
    """Yield the rows in order; for a row with an unknown observable, only its name."""
    table = read_table(path, MOST_BYTES, MeasurementError, ":{}", comments=True)
    if not table.rows:
        return
    (line, header), *rows = table.rows
    if header not in (COLUMNS, [*COLUMNS, "unit"]):
        raise MeasurementError(
            f"{path}:{line}: columns {','.join(header)}; allowed: {','.join(COLUMNS)}, and then optionally unit"
        )
    check_cells(table, lambda line, what: MeasurementError(f"{path}:{line}: {what}"))
    for line, cells in rows:
        yield _row(f"{path}:{line}", line, dict(zip(header, cells, strict=True)), table.number)


def _row(where: str, line: int, cells: dict[str, str], number: Callable[[str], float]) -> LongRow | str:
    name = cells["observable"]
    known = named(name)
    if known is None:
        _refuse_wrong_unit(where, name)
        return name
    if not cells["replicate"].isdecimal() or int(cells["replicate"]) < 1:
        raise MeasurementError(f"{where}: replicate: {cells['replicate']!r}; allowed: whole numbers from 1 on")
    if (known.x_unit is None) != (cells["x"] == ""):
        kind = (
            "an empty x (it is a scalar)"
            if known.x_unit is None
            else f"a coordinate x in {known.x_unit} (it is a curve)"
        )
        raise MeasurementError(f"{where}: {name}: x is {cells['x']!r}; allowed: {kind}")
    x = None if known.x_unit is None else _finite(where, "x", cells["x"], known.x_unit, number)
    return LongRow(line, int(cells["replicate"]), name, x, _value(where, cells, known.unit, number))


def _value(where: str, cells: dict[str, str], unit: str, number: Callable[[str], float]) -> float:
    value = _finite(where, "value", cells["value"], unit, number)
    if cells.get("unit", unit) not in (unit, ""):
        try:
            value *= parse_quantity(f"1{cells['unit']}", unit, "unit")
        except ParameterError as error:
            raise MeasurementError(f"{where}: {error}") from None
    if cells["observable"].startswith(ANGLE) and not -90.0 < value < 90.0:
        raise MeasurementError(f"{where}: value: {cells['value']!r}; allowed: above -90 deg and below 90 deg")
    return value


def _finite(where: str, column: str, text: str, unit: str, number: Callable[[str], float]) -> float:
    value = number(text)
    if math.isnan(value):
        raise MeasurementError(f"{where}: {column}: {text!r}; allowed: a finite number in {unit}")
    return value


def _refuse_wrong_unit(where: str, name: str) -> None:
    """Refuse a name that would be an observable but for its unit; other unknown names are accepted."""
    for right in all_names():
        known = named(right)
        if known is None or known.unit == "1":
            continue
        stem = right.rpartition("_")[0]
        if name == stem or name in {f"{stem}_{suffix}" for suffix in UNIT_SUFFIXES}:
            raise MeasurementError(f"{where}: observable: {name!r} has a wrong or missing unit; allowed: {right}")


def _array(path: Path, rows: list[LongRow], replicates: int) -> tuple[Array | None, Array]:
    places = sorted({row.x for row in rows if row.x is not None})
    column = {x: k for k, x in enumerate(places)}
    values = np.full((replicates, max(1, len(places))), np.nan)
    for row in rows:
        place = row.replicate - 1, 0 if row.x is None else column[row.x]
        if not np.isnan(values[place]):
            raise MeasurementError(f"{path}:{row.line}: {row.observable}: this value appears twice; allowed: once")
        values[place] = row.value
    return (np.array(places), values) if places else (None, values[:, 0])
