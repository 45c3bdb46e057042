"""The sheet of a designed experiment, filled in on the page: results, and why a run is left out."""

from __future__ import annotations

import csv
import io
import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from explorer.design.factors_file import EXCLUDED
from explorer.design.filled_sheet import EMPTY_CELLS, Sheet, read_sheet, short
from explorer.errors import CommandError
from explorer.viewer.actions import Post
from explorer.viewer.laboratory.inputs import UploadSlot
from explorer.viewer.tables.table_server import TablePage, done_by
from solver.assets import asset_path

TITLE = "Sheet of runs"
SAVED_AS = "_filled"
"""Behind the name of a sheet, in that of what was filled in."""
LONGEST_REASON = 200
HOW = (
    "Enter the results in the blue columns; a click on a head sorts, the sign in it filters. A run with a reason under "
    "excluded is left out of the analysis, which says so. Save, and the sheet is chosen under Filled sheet → model and "
    "optimum."
)
SAVED = "Saved, and chosen under Filled sheet → model and optimum: {}."


@dataclass
class SheetInHand:
    """The sheet that is analysed; ``slot`` is where it is chosen, None on a page without that panel."""

    slot: UploadSlot | None = None

    @property
    def path(self) -> Path:
        """Of the sheet. Raises CommandError where there is none."""
        if self.slot is None:
            raise CommandError("no sheet is chosen")
        return asset_path("runs", self.slot.chosen)

    def take(self, name: str, content: bytes) -> None:
        """Choose a sheet that was made or filled in here."""
        if self.slot is not None:
            self.slot.take(name, content)


def sheet_page(sheet: SheetInHand, post: Post) -> TablePage:
    """The page on which the sheet in hand is filled in."""
    return TablePage("sheet", TITLE, lambda: _build(sheet, post))


def _build(in_hand: SheetInHand, post: Post) -> None:
    from nicegui import ui

    try:
        sheet = read_sheet(in_hand.path)
    except (CommandError, ValueError) as error:
        ui.label(str(error)).props("role=alert")
        return
    ui.label(f"{TITLE}: {sheet.path.name}").classes("text-h6").props("role=heading aria-level=1")
    ui.label(HOW)
    grid = ui.aggrid(
        {
            "columnDefs": column_definitions(sheet),
            "rowData": rows_of(sheet),
            "stopEditingWhenCellsLoseFocus": True,
            "enterNavigatesVerticallyAfterEdit": True,
        }
    ).style("height: calc(100vh - 12rem)")
    told = ui.label("").props("role=status")

    async def save() -> None:
        rows = await grid.get_client_data()
        try:
            name, content = filled_sheet(sheet, rows)
        except CommandError as error:
            told.text = str(error)
            return
        told.text = await done_by(post, lambda: in_hand.take(name, content)) or SAVED.format(name)

    ui.button("Save", on_click=save).props("no-caps")


def editable(sheet: Sheet) -> tuple[str, ...]:
    """Columns that a person fills in."""
    return (*sheet.responses, EXCLUDED)


def column_definitions(sheet: Sheet) -> list[dict[str, object]]:
    """Of AG Grid: one per column, that of exclusions last even where the sheet has none yet."""
    written = editable(sheet)
    units = {factor.name: factor.unit for factor in sheet.factors} | {
        k: unit for k, unit in sheet.units.items() if unit
    }
    return [
        {
            "headerName": f"{name} [{units[name]}]" if units.get(name) else name,
            "field": str(position),
            "editable": name in written,
            "filter": "agTextColumnFilter",
            "sortable": True,
            "cellDataType": "text",
            "wrapHeaderText": True,
            "autoHeaderHeight": True,
            "cellStyle": {"background": "rgba(31,110,165,0.08)"} if name in written else {},
            "flex": 2 if name == EXCLUDED else 1,
            "minWidth": 130,
        }
        for position, name in enumerate(_columns(sheet))
    ]


def rows_of(sheet: Sheet) -> list[dict[str, str]]:
    """The cells by the position of their column; ``line`` is the row's line in the file."""
    width = len(_columns(sheet))
    return [
        {"line": str(line)} | {str(k): cell for k, cell in enumerate((*cells, *[""] * (width - len(cells))))}
        for line, cells in zip(sheet.lines, sheet.cells, strict=True)
    ]


def filled_sheet(sheet: Sheet, rows: Sequence[Mapping[str, object]]) -> tuple[str, bytes]:
    """Name and content (CSV) of ``sheet`` with the cells that a person filled in, in its own order.

    Only columns that are his to fill in are taken from ``rows``, which a browser sent. Raises CommandError where a
    result is no number, or the rows are not those of the sheet.
    """
    sent = {str(row.get("line")): row for row in rows if isinstance(row, Mapping)}
    if sorted(sent) != sorted(map(str, sheet.lines)):
        raise CommandError(f"{sheet.path.name}: these are not its rows; open the table again")
    columns, written = _columns(sheet), editable(sheet)
    table = []
    for line, cells in zip(sheet.lines, sheet.cells, strict=True):
        row = [*cells, *[""] * (len(columns) - len(cells))]
        for name in written:
            place = columns.index(name)
            row[place] = _entered(sheet, line, name, sent[str(line)].get(str(place)), row[place])
        table.append(row)
    header = [f"{name} [{sheet.units[name]}]" if sheet.units.get(name) else name for name in columns]
    text = io.StringIO()
    text.writelines(f"{comment}\n" for _, comment in sheet.table.comments)
    csv.writer(text, delimiter=";" if sheet.table.decimal_comma else ",", lineterminator="\n").writerows(
        [header, *table]
    )
    stem = sheet.path.stem.removesuffix(SAVED_AS)
    content = text.getvalue().encode("utf-8-sig")  # by the mark spreadsheets know it
    _check(content)
    return f"{stem}{SAVED_AS}.csv", content


def _columns(sheet: Sheet) -> list[str]:
    """Names of the columns in their order, with that of exclusions; unnamed ones are kept."""
    names = [""] * len(sheet.table.rows[0][1])
    for name, position in sheet.columns.items():
        names[position] = name
    return names if EXCLUDED in names else [*names, EXCLUDED]


def _entered(sheet: Sheet, line: int, name: str, value: object, before: str) -> str:
    """A cell as it was entered; a number where the column holds numbers."""
    text = " ".join(str("" if value is None else value).split())
    if len(text) > LONGEST_REASON:
        raise CommandError(f"line {line}, {name}: {len(text)} characters; allowed: up to {LONGEST_REASON}")
    if name == EXCLUDED or text == before or text in EMPTY_CELLS or sheet.is_words(name):
        return text
    if math.isnan(sheet.table.number(text)):
        raise CommandError(f"line {line}, {name}: {short(text)} is not a number; allowed: a number, or nothing")
    return text


def _check(content: bytes) -> None:
    """Whether what is written is read again; raises CommandError where it is not."""
    with tempfile.TemporaryDirectory() as apart:
        path = Path(apart) / "sheet.csv"
        path.write_bytes(content)
        read_sheet(path)
