"""The CSV files of a published study: text as printed, with file, line and column for whoever has to mend it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from doe.audit import Printed, printed, printed_or_none
from doe.errors import AuditError
from doe.table_file import read_table as read_cells

MOST_BYTES = 2_000_000
"""Bytes of one file; published tables hold thousands."""


@dataclass(frozen=True)
class Table:
    """A table as text: column → cells; ``lines`` are the line numbers of its rows."""

    name: str
    columns: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.lines)

    def texts(self, column: str) -> tuple[str, ...]:
        """Cells of a column; AuditError where there is none of that name."""
        if column not in self.columns:
            raise AuditError(f"{self.name}: no column {column!r}; it has {', '.join(self.columns)}")
        return self.columns[column]

    def numbers(self, column: str) -> tuple[Printed, ...]:
        """A column in which every cell is a number."""
        return tuple(self.number(column, row) for row in range(self.rows))

    def number(self, column: str, row: int) -> Printed:
        """One cell; AuditError names file, line and column where it is no number."""
        try:
            return printed(self.texts(column)[row])
        except AuditError as error:
            raise AuditError(f"{self.name}, line {self.lines[row]}, {column}: {error}") from None

    def number_or_none(self, column: str, row: int) -> Printed | None:
        """One cell, None where it is empty or the column is not there."""
        return self.number(column, row) if self.columns.get(column, ())[row : row + 1] not in ((), ("",)) else None


def places(table: Table, value: Printed) -> tuple[str, ...]:
    """Where the table prints ``value``, in words: "restitution of petiole–petiole"; a row is named by its words."""
    found = []
    for row in range(table.rows):
        cells = {column: texts[row] for column, texts in table.columns.items()}
        numbers = {column: printed_or_none(text) for column, text in cells.items()}
        name = "–".join(text for column, text in cells.items() if text and numbers[column] is None) or f"row {row + 1}"
        like = [c for c, number in numbers.items() if number and not number.bound and value.agrees(number.value)]
        found += [f"{column} of {name}" for column in like]
    return tuple(found)


def read_table(folder: Path, name: str) -> Table:
    """A CSV file of a study's folder. Raises AuditError for what is not one, OSError for what cannot be opened."""
    if Path(name).name != name or not name:
        raise AuditError(f"{name!r} is not the name of a file beside study.toml")
    path = folder / name
    table = read_cells(path, MOST_BYTES, AuditError)
    if len(table.rows) < 2:
        raise AuditError(f"{path}: a line of column names and at least one row are needed")
    (_, header), *rows = table.rows
    if len(set(header)) < len(header) or "" in header:
        raise AuditError(f"{path}: column names must be there and differ: {', '.join(header)}")
    for number, row in rows:
        if len(row) != len(header):
            raise AuditError(f"{path}, line {number}: {len(row)} cells; the table has {len(header)} columns")
    # Numbers as printed, but with a point: everything behind reads their digits. Words keep their commas.
    cells = zip(
        *([plain if printed_or_none(plain := table.plain(cell)) else cell for cell in row] for _, row in rows),
        strict=True,
    )
    columns = dict(zip(header, cells, strict=True))
    return Table(name, columns, tuple(number for number, _ in rows))
