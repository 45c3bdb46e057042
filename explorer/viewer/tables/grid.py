"""What the pages with a table to edit have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from explorer.errors import CommandError
from explorer.viewer.actions import Action, Post
from explorer.viewer.tables.table_server import LOST, REPLY, done_by

Column = dict[str, object]
"""A column definition of AG Grid."""
WRITTEN: Column = {"editable": True, "cellStyle": {"background": "rgba(31,110,165,0.08)"}}
"""Options of a column that a person fills in: blue, as the texts on the pages say."""
LONGEST_TEXT = 200


def column(head: str, field: str, **more: object) -> Column:
    """A column that can be sorted and filtered, with a header that wraps."""
    usual = {"sortable": True, "filter": "agTextColumnFilter", "cellDataType": "text", "flex": 1}
    return {"headerName": head, "field": field, "wrapHeaderText": True, "autoHeaderHeight": True} | usual | more


def with_unit(name: str, unit: str | None) -> str:
    """The header of a column: its name, followed by its unit if it has one."""
    return f"{name} [{unit}]" if unit else name


def entered_text(value: object, where: str) -> str:
    """What a person entered, on one line. Raises CommandError if it is too long."""
    text = " ".join(str("" if value is None else value).split())
    if len(text) > LONGEST_TEXT:
        raise CommandError(f"{where}: {len(text)} characters; allowed: up to {LONGEST_TEXT}")
    return text


def rows_in_order(sent: Sequence[object], number: int, whose: str) -> list[Mapping[str, object]]:
    """The ``number`` rows that a browser ``sent`` in any order, sorted by their ``id``: 0, 1, …

    Raises CommandError if the rows are not the expected ones; ``whose`` names these, such as "the runs of the study".
    """
    found = {str(row.get("id")): row for row in sent if isinstance(row, Mapping)}
    if set(found) != {str(k) for k in range(number)}:
        raise CommandError(f"these are not {whose}; open the table again")
    return [found[str(k)] for k in range(number)]


def table_heading(title: str, how: str) -> None:
    """Show the title, and what a person can do here."""
    from nicegui import ui

    ui.label(title).classes("text-h6").props("role=heading aria-level=1")
    ui.label(how)


def table_to_edit(
    columns: Sequence[Column],
    rows: Sequence[dict[str, str]],
    entered: Callable[[Sequence[Any]], tuple[Action, str]],
    post: Post,
    height: str = "calc(100vh - 12rem)",
) -> None:
    """A table with *Save*: ``entered`` turns the rows from the browser into an action, and a message for its success.

    A CommandError from either ``entered`` or the action is shown below the table. ``height``: CSS height of the table.
    """
    from nicegui import ui

    grid = ui.aggrid(
        {
            "columnDefs": list(columns),
            "rowData": list(rows),
            "stopEditingWhenCellsLoseFocus": True,
            "enterNavigatesVerticallyAfterEdit": True,
        }
    ).style(f"height: {height}")
    told = ui.label("").props("role=status")

    async def save() -> None:
        try:
            act, saved = entered(await grid.get_client_data(timeout=REPLY))
        except (CommandError, TimeoutError) as error:
            told.text = str(error) or LOST
            return
        told.text = await done_by(post, act) or saved

    ui.button("Save", on_click=save).props("no-caps")
