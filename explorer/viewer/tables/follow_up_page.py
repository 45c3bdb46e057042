"""The values that a follow-up asks for, as tables: a row per quantity with a cell per pour, and single-body values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from doe.measurement.bodies import QUANTITIES
from explorer.diagnosis.follow_up_tables import (
    AskedBody,
    AskedNumber,
    FollowUpTables,
    read_follow_up,
    write_bodies,
    write_numbers,
)
from explorer.errors import CommandError
from explorer.units import observable_label
from explorer.viewer.actions import Action, Post
from explorer.viewer.tables.grid import (
    WRITTEN,
    Column,
    column,
    entered_text,
    rows_in_order,
    table_heading,
    table_to_edit,
)
from explorer.viewer.tables.table_server import TablePage
from solver import named

TITLE = "Follow-up"
HOW = (
    "Write what was measured into the blue columns, as a number in the unit of its row or with a unit of its own "
    "(24.7mm). What was not measured stays empty. Save, and the page counts what is filled in."
)
OF_POURS, OF_BODIES = "pours", "single bodies"
HOW_OF_BODIES = "The mean of each number, and the standard error of that mean, in the unit of its row."
NOTHING_ASKED = "The answer that is shown under Diagnose asks for no follow-up."
WRAPPED = {"wrapText": True, "autoHeight": True}
"""Column options for cells with long texts."""
SAVED = "Saved: {} of {} values are filled in."
ROWS = "the rows of the follow-up"


def follow_up_page(folder: Callable[[], Path | None], post: Post) -> TablePage:
    """The page for filling in the follow-up in ``folder()``, which is None if the answer shown asks for none."""
    return TablePage("follow-up", TITLE, lambda: _build(folder, post))


def _build(folder: Callable[[], Path | None], post: Post) -> None:
    from nicegui import ui

    asked = folder()
    try:
        if asked is None:
            raise CommandError(NOTHING_ASKED)
        tables = read_follow_up(asked)
    except ValueError as error:
        ui.label(str(error)).props("role=alert")
        return

    def pours(sent: Sequence[object]) -> tuple[Action, str]:
        numbers = filled_numbers(tables, sent)
        return lambda: write_numbers(tables.folder, numbers), _saved([one for row in numbers for one in row.values])

    def bodies(sent: Sequence[object]) -> tuple[Action, str]:
        measured = filled_bodies(tables, sent)
        cells = [cell for row in measured for cell in (row.mean, row.standard_error)]
        return lambda: write_bodies(tables.folder, measured), _saved(cells)

    if tables.bodies:
        table_heading(f"{TITLE}: {OF_BODIES}", HOW_OF_BODIES)
        table_to_edit(body_columns(), body_rows(tables), bodies, post, height=f"{6 + 7 * len(tables.bodies)}rem")
    if tables.numbers:
        table_heading(f"{TITLE}: {OF_POURS}", HOW)
        table_to_edit(number_columns(tables), number_rows(tables), pours, post)


def _saved(cells: Sequence[str]) -> str:
    return SAVED.format(sum(map(bool, cells)), len(cells))


def number_columns(tables: FollowUpTables) -> list[Column]:
    """Columns for quantity, place and unit, and a blue column per pour."""
    heads = [column("Quantity", "quantity", minWidth=200, flex=2, pinned="left")]
    if any(row.x for row in tables.numbers):
        heads.append(column("At", "at", minWidth=90))
    heads.append(column("Unit", "unit", minWidth=70))
    return heads + [column(f"Pour {k}", f"pour_{k}", minWidth=90, **WRITTEN) for k in range(1, tables.pours + 1)]


def number_rows(tables: FollowUpTables) -> list[dict[str, str]]:
    """A row per quantity and place; ``id`` is the number of the row."""
    rows = []
    for number, one in enumerate(tables.numbers):
        known = named(one.observable)
        at = f"{float(one.x):.6g} {known.x_unit}" if one.x and known is not None else one.x
        told = {"id": str(number), "quantity": observable_label(one.observable), "at": at}
        told["unit"] = known.unit if known is not None and known.unit != "1" else ""
        rows.append(told | {f"pour_{k}": value for k, value in enumerate(one.values, start=1)})
    return rows


def filled_numbers(tables: FollowUpTables, sent: Sequence[object]) -> list[AskedNumber]:
    """The numbers of ``tables`` with the values that a browser ``sent``. CommandError for rows of another table."""
    return [
        replace(
            row,
            values=tuple(
                entered_text(cells.get(f"pour_{k}"), f"pour {k}, {row.observable}") for k in range(1, tables.pours + 1)
            ),
        )
        for row, cells in zip(tables.numbers, rows_in_order(sent, len(tables.numbers), ROWS), strict=True)
    ]


def body_columns() -> list[Column]:
    """Columns for the body, the quantity, how to measure it and its unit, and two blue columns."""
    return [
        column("Body", "body", minWidth=100),
        column("Quantity", "quantity", minWidth=200, flex=2, **WRAPPED),
        column("How", "how", minWidth=200, flex=2, **WRAPPED),
        column("Unit", "unit", minWidth=70),
        column("Mean", "mean", minWidth=100, **WRITTEN),
        column("Standard error", "standard_error", minWidth=100, **WRITTEN),
    ]


def body_rows(tables: FollowUpTables) -> list[dict[str, str]]:
    """A row per number; ``id`` is the number of the row."""
    return [
        {
            "id": str(number),
            "body": one.body,
            "quantity": QUANTITIES[one.quantity].words,
            "how": QUANTITIES[one.quantity].how,
            "unit": one.unit.removeprefix("1"),
            "mean": one.mean,
            "standard_error": one.standard_error,
        }
        for number, one in enumerate(tables.bodies)
    ]


def filled_bodies(tables: FollowUpTables, sent: Sequence[object]) -> list[AskedBody]:
    """The same as :func:`filled_numbers`, for single bodies."""
    return [
        replace(row, **{key: entered_text(cells.get(key), f"{row.body}, {key}") for key in ("mean", "standard_error")})
        for row, cells in zip(tables.bodies, rows_in_order(sent, len(tables.bodies), ROWS), strict=True)
    ]
