"""A laboratory's CSV file → rows in SI, with one clear line for whatever is wrong.

First the names of the columns, then one row per reading; cells and numbers as `doe.table_file` reads them. ``#`` starts
a comment: a reading behind it is left out and stays visible. Rows are counted as a spreadsheet does, the first line of
the file being row 1.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from doe.laboratory.columns import Column, Layout
from doe.table_file import read_table as read_cells

MOST_BYTES = 50_000_000
NAME = re.compile(r"[A-Za-z0-9_-]{1,60}")
"""What a component may be called: its name becomes part of a parameter's path."""
REPLICATE, NOTE = "replicate", "note"


class LaboratoryError(ValueError):
    """Readings that nothing can be computed from; one line naming file, row, column and what is allowed."""


@dataclass(frozen=True)
class Row:
    """One reading: its row in the file, whose it is, and the numbers by column (SI)."""

    line: int
    of: tuple[str, ...]
    replicate: str
    values: dict[str, float]


@dataclass(frozen=True)
class Table:
    """All readings of a file, in its order."""

    file: str
    rows: tuple[Row, ...]

    def groups(self) -> dict[tuple[str, ...], tuple[Row, ...]]:
        """Rows by whose they are; a pair means the same in either order."""
        found: dict[tuple[str, ...], list[Row]] = {}
        for row in self.rows:
            turned = row.of[::-1]
            found.setdefault(turned if turned in found else row.of, []).append(row)
        return {of: tuple(rows) for of, rows in found.items()}

    def wrong(self, row: Row, column: str, text: str) -> LaboratoryError:
        """An error about one cell."""
        return LaboratoryError(f"{self.file}, row {row.line}, column {column}: {text}")


def read_table(path: Path, layout: Layout) -> Table:
    """The readings in ``path``; LaboratoryError in one line naming file, row and column."""
    found = read_cells(path, MOST_BYTES, LaboratoryError, ", row {}", comments=True)
    if not found.rows:
        raise LaboratoryError(f"{path}: no rows; allowed: {_columns_text(layout)}, and readings below")
    (line, header), *readings = found.rows
    columns = _columns(f"{path}, row {line}", header, layout)
    rows = []
    for line, cells in readings:
        where = f"{path}, row {line}"
        if len(cells) != len(header):
            raise LaboratoryError(
                f"{where}: {len(cells)} cells; allowed: {len(header)}, one per column (between commas, decimals with a "
                "point)"
            )
        rows.append(_row(where, line, dict(zip(header, cells, strict=True)), columns, layout, found.number))
    if not rows:
        raise LaboratoryError(f"{path}: no readings below the names of the columns")
    table = Table(str(path), tuple(rows))
    if not layout.curves:
        _check_single(table)
    return table


def _columns(where: str, header: list[str], layout: Layout) -> dict[str, Column]:
    """Columns of numbers by their name in the file."""
    twice = next((name for name in header if header.count(name) > 1), None)
    if twice is not None:
        raise LaboratoryError(f"{where}, column {twice}: stands twice; allowed: once")
    found: dict[str, Column] = {}
    for name in header:
        if name in (*layout.keys, REPLICATE, NOTE):
            continue
        column = next((column for column in layout.columns if name in column.names), None)
        if column is None:
            raise LaboratoryError(f"{where}, column {name!r}: {_why_unknown(name, layout)}")
        if any(other.stem == column.stem for other in found.values()):
            raise LaboratoryError(f"{where}, column {name}: {column.stem} stands twice; allowed: in one unit")
        found[name] = column
    for key in (*layout.keys, REPLICATE):
        if key not in header:
            raise LaboratoryError(f"{where}: column {key} is missing; allowed: {_columns_text(layout)}")
    for column in layout.columns:
        if column.needed and column not in found.values():
            raise LaboratoryError(f"{where}: column {column.names[0]} is missing (or {', '.join(column.names[1:])})")
    return found


def _why_unknown(name: str, layout: Layout) -> str:
    """A name that only its unit keeps from being a column gets the units that are allowed."""
    stems = [c for c in layout.columns if name == c.stem or name.startswith(f"{c.stem}_")]
    if stems:
        nearest = max(stems, key=lambda column: len(column.stem))
        return f"wrong or missing unit; allowed: {', '.join(nearest.names)}"
    return f"unknown; allowed: {_columns_text(layout)}"


def _columns_text(layout: Layout) -> str:
    numbers = [column.names[0] if column.needed else f"[{column.names[0]}]" for column in layout.columns]
    return ",".join([*layout.keys, REPLICATE, *numbers])


def _row(
    where: str,
    line: int,
    cells: dict[str, str],
    columns: dict[str, Column],
    layout: Layout,
    number: Callable[[str], float],
) -> Row:
    for key in (*layout.keys, REPLICATE):
        if not NAME.fullmatch(cells[key]):
            raise LaboratoryError(f"{where}, column {key}: {cells[key]!r}; allowed: letters, digits, _ and -")
    values = {
        column.stem: _value(where, name, cells[name], column, number)
        for name, column in columns.items()
        if cells[name] or not column.blank
    }
    return Row(line, tuple(cells[key] for key in layout.keys), cells[REPLICATE], values)


def _value(where: str, name: str, text: str, column: Column, number: Callable[[str], float]) -> float:
    value = number(text) * column.factor(name)
    if not (math.isfinite(value) and column.allowed(value)):
        raise LaboratoryError(f"{where}, column {name}: {text!r}; allowed: {column.range_text(name)}")
    return value


def _check_single(table: Table) -> None:
    for rows in table.groups().values():
        seen: dict[str, int] = {}
        for row in rows:
            if row.replicate in seen:
                raise table.wrong(
                    row, REPLICATE, f"{row.replicate!r} of {'-'.join(row.of)} stands in row {seen[row.replicate]} too"
                )
            seen[row.replicate] = row.line
