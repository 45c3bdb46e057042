"""The sheet of a designed experiment, for entering results, and the reason where a run is left out."""

from __future__ import annotations

import csv
import io
import math
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from explorer.design.factors_file import EXCLUDED
from explorer.design.filled_sheet import EMPTY_CELLS, Sheet, read_sheet, short
from explorer.errors import CommandError
from explorer.viewer.actions import Action, Post
from explorer.viewer.laboratory.inputs import UploadSlot
from explorer.viewer.tables.grid import WRITTEN, Column, column, entered_text, table_heading, table_to_edit, with_unit
from explorer.viewer.tables.table_server import TablePage
from solver.assets import asset_path

TITLE = "Sheet of runs"
SAVED_AS = "_filled"
"""Suffix that the name of a filled-in sheet gets."""
KEPT_NAME = re.compile(rf"({SAVED_AS})?(-[0-9a-f]{{12}})?$")
"""What was appended to the name of a sheet when it was kept."""
MOST_CELLS = 20_000
"""More cells do not fit into one message from a browser."""
HOW = (
    "Enter the results in the blue columns; a click on a head sorts, the sign in it filters. A run with a reason under "
    "excluded is left out of the analysis, which says so. Save, and the sheet is chosen under Filled sheet → model and "
    "optimum."
)
SAVED = "Saved, and chosen under Filled sheet → model and optimum: {}."


@dataclass
class SheetInHand:
    """The sheet to analyse; ``slot`` is where a person chooses it, None on a page without that panel."""

    slot: UploadSlot | None = None

    @property
    def path(self) -> Path:
        """Path of the sheet. Raises CommandError if there is none."""
        if self.slot is None:
            raise CommandError("no sheet is chosen")
        return asset_path("runs", self.slot.chosen)

    def take(self, name: str, content: bytes) -> None:
        """Choose a sheet that was made or filled in here."""
        if self.slot is not None:
            self.slot.take(name, content)


def sheet_page(sheet: SheetInHand, post: Post) -> TablePage:
    """The page for filling in the sheet in hand."""
    return TablePage("sheet", TITLE, lambda: _build(sheet, post))


def _build(in_hand: SheetInHand, post: Post) -> None:
    from nicegui import ui

    try:
        sheet = read_sheet(in_hand.path)
        if (cells := len(sheet.cells) * len(_columns(sheet))) > MOST_CELLS:
            raise CommandError(f"{sheet.path.name}: {cells} cells; allowed here: {MOST_CELLS}; fill in the file itself")
    except ValueError as error:
        ui.label(str(error)).props("role=alert")
        return

    def entered(rows: Sequence[Any]) -> tuple[Action, str]:
        name, content = filled_sheet(sheet, rows)
        return lambda: in_hand.take(name, content), SAVED.format(name)

    table_heading(f"{TITLE}: {sheet.path.name}", HOW)
    table_to_edit(column_definitions(sheet), rows_of(sheet), entered, post)


def editable(sheet: Sheet) -> tuple[str, ...]:
    """Columns that a person fills in."""
    return (*sheet.responses, EXCLUDED)


def column_definitions(sheet: Sheet) -> list[Column]:
    """AG Grid definitions, one per column; a sheet without a column for exclusions gets one at the end."""
    written = editable(sheet)
    units = {factor.name: factor.unit for factor in sheet.factors} | {
        k: unit for k, unit in sheet.units.items() if unit
    }
    return [
        column(with_unit(name, units.get(name)), str(position), minWidth=130)
        | (WRITTEN if name in written else {})
        | ({"flex": 2} if name == EXCLUDED else {})
        for position, name in enumerate(_columns(sheet))
    ]


def rows_of(sheet: Sheet) -> list[dict[str, str]]:
    """Rows of cells, keyed by the position of their column; ``line`` is the row's line in the file."""
    width = len(_columns(sheet))
    return [
        {"line": str(line)} | {str(k): cell for k, cell in enumerate((*cells, *[""] * (width - len(cells))))}
        for line, cells in zip(sheet.lines, sheet.cells, strict=True)
    ]


def filled_sheet(sheet: Sheet, rows: Sequence[Mapping[str, object]]) -> tuple[str, bytes]:
    """Name and content (CSV) of ``sheet`` with the cells that a person filled in, in the order of the sheet.

    ``rows`` come from a browser; only the editable columns are taken from them. Raises CommandError if a result is not
    a number, or if the rows are not those of the sheet.
    """
    sent = {str(row.get("line")): row for row in rows if isinstance(row, Mapping)}
    if sorted(sent) != sorted(map(str, sheet.lines)):
        raise CommandError(f"{sheet.path.name}: these are not its rows; open the table again")
    columns, written = _columns(sheet), editable(sheet)
    table = [[*cells, *[""] * (len(columns) - len(cells))] for cells in sheet.cells]
    for name in written:
        place = columns.index(name)
        before = [row[place] for row in table]
        now = [
            _entered(line, name, sent[str(line)].get(str(place)), cell)
            for line, cell in zip(sheet.lines, before, strict=True)
        ]
        if name != EXCLUDED and not _mixed(sheet, before):
            _check_column(sheet, name, now)
        for row, cell in zip(table, now, strict=True):
            row[place] = cell
    header = [with_unit(name, sheet.units.get(name)) for name in columns]
    text = io.StringIO()
    text.writelines(f"{comment}\n" for _, comment in sheet.table.comments)
    csv.writer(text, delimiter=";" if sheet.table.decimal_comma else ",", lineterminator="\n").writerows(
        [header, *table]
    )
    stem = KEPT_NAME.sub("", sheet.path.stem)
    content = text.getvalue().encode("utf-8-sig")  # spreadsheets recognise the encoding by its mark
    _check(content, [tuple(row) for row in table])
    return f"{stem}{SAVED_AS}.csv", content


def _columns(sheet: Sheet) -> list[str]:
    """Names of the columns in order, including the one for exclusions; columns without a name are kept."""
    names = [""] * len(sheet.table.rows[0][1])
    for name, position in sheet.columns.items():
        names[position] = name
    return names if EXCLUDED in names else [*names, EXCLUDED]


def _entered(line: int, name: str, value: object, before: str) -> str:
    """A cell as entered, on one line; a cell that nobody changed stays exactly as it was."""
    text = str("" if value is None else value)
    if text == before:
        return before
    return entered_text(text, f"line {line}, {name}")


def _numbers(sheet: Sheet, cells: Sequence[str]) -> list[bool]:
    """For each cell that is not empty, whether it is a number."""
    return [not math.isnan(sheet.table.number(cell)) for cell in cells if cell not in EMPTY_CELLS]


def _mixed(sheet: Sheet, cells: Sequence[str]) -> bool:
    return len(set(_numbers(sheet, cells))) == 2


def _check_column(sheet: Sheet, name: str, cells: Sequence[str]) -> None:
    """Refuse a word among numbers; a column may consist of words only."""
    if not _mixed(sheet, cells):
        return
    for line, cell in zip(sheet.lines, cells, strict=True):
        if cell not in EMPTY_CELLS and math.isnan(sheet.table.number(cell)):
            raise CommandError(
                f"line {line}, {name}: {short(cell)} is not a number; allowed: a number, or an empty cell"
            )


def _check(content: bytes, table: Sequence[tuple[str, ...]]) -> None:
    """Raise CommandError if ``content`` does not read back as ``table``."""
    with tempfile.TemporaryDirectory() as apart:
        path = Path(apart) / "sheet.csv"
        path.write_bytes(content)
        again = read_sheet(path).cells
    if again != tuple(table):
        raise CommandError("a cell cannot be written as CSV; allowed: none that begins a row with #")
