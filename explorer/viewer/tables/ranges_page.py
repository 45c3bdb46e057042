"""The ranges of all factors of the next study in one table."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from doe.table_file import CellTable
from explorer.errors import CommandError
from explorer.viewer.actions import Action, Post
from explorer.viewer.tables.grid import WRITTEN, column, table_heading, table_to_edit
from explorer.viewer.tables.table_server import TablePage

TITLE = "Ranges of the next study"
HOW = (
    "Change the blue columns; a click on a head sorts, the sign in it filters. Decimal points or commas. Save, and the "
    "next study starts from these ranges."
)
SAVED = "Saved: the next study starts from these ranges."
ENTERED = {"low": "Low", "high": "High", "measured": "Measured value"}
Range = tuple[float, float, float]
"""Low, high and measured value, in the displayed unit."""
NUMBERS = CellTable((), (), decimal_comma=True)
"""Reads a number with a decimal comma or a decimal point."""


@dataclass(frozen=True)
class RangeRow:
    """One factor: its short name, its parameter in words, its unit and its range."""

    name: str
    label: str
    unit: str
    range: Range


@dataclass(frozen=True)
class RangesInHand:
    """The ranges that the next study starts from; ``take`` receives changed ranges by the names of the factors."""

    rows: Callable[[], Sequence[RangeRow]]
    take: Callable[[Mapping[str, Range]], None]


def ranges_page(in_hand: RangesInHand, post: Post) -> TablePage:
    """The page for changing the ranges in hand."""
    return TablePage("ranges", TITLE, lambda: _build(in_hand, post))


def _build(in_hand: RangesInHand, post: Post) -> None:
    rows = in_hand.rows()
    columns = [column("Factor", "name"), column("Parameter", "label", flex=4), column("Unit", "unit")]
    columns += [column(head, name, **WRITTEN) for name, head in ENTERED.items()]

    def entered(sent: Sequence[object]) -> tuple[Action, str]:
        ranges = entered_ranges(rows, sent)
        return lambda: in_hand.take(ranges), SAVED

    table_heading(TITLE, HOW)
    table_to_edit(columns, [_cells(row) for row in rows], entered, post)


def _cells(row: RangeRow) -> dict[str, str]:
    values = zip(ENTERED, row.range, strict=True)
    return {"name": row.name, "label": row.label, "unit": row.unit} | {key: f"{value:.6g}" for key, value in values}


def entered_ranges(rows: Sequence[RangeRow], sent: Sequence[object]) -> dict[str, Range]:
    """The ranges that a browser ``sent`` for ``rows``. Raises CommandError for a cell that is not a number."""
    found = {str(row.get("name")): row for row in sent if isinstance(row, Mapping)}
    ranges: dict[str, Range] = {}
    for row in rows:
        cells = found.get(row.name)
        if cells is None:
            raise CommandError(f"{row.name}: is no longer in the table; open it again")
        low, high, measured = (_number(row.name, head, cells.get(key)) for key, head in ENTERED.items())
        ranges[row.name] = (low, high, measured)
    return ranges


def _number(factor: str, head: str, cell: object) -> float:
    value = NUMBERS.number("" if cell is None else str(cell).strip())
    if math.isnan(value):
        raise CommandError(f"{factor}, {head.lower()}: {str(cell)[:40]!r} is not a number")
    return value
