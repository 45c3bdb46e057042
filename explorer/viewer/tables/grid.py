"""A page that is one table to edit: what its pages have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from explorer.errors import CommandError
from explorer.viewer.actions import Action, Post
from explorer.viewer.tables.table_server import LOST, REPLY, done_by

Column = dict[str, object]
"""Of AG Grid."""
WRITTEN: Column = {"editable": True, "cellStyle": {"background": "rgba(31,110,165,0.08)"}}
"""Of a column that a person fills in: blue, as the pages say."""
LONGEST_TEXT = 200


def column(head: str, field: str, **more: object) -> Column:
    """A column that sorts and filters, its head on several lines."""
    usual = {"sortable": True, "filter": "agTextColumnFilter", "cellDataType": "text", "flex": 1}
    return {"headerName": head, "field": field, "wrapHeaderText": True, "autoHeaderHeight": True} | usual | more


def with_unit(name: str, unit: str | None) -> str:
    """The head of a column."""
    return f"{name} [{unit}]" if unit else name


def entered_text(value: object, where: str) -> str:
    """What a person entered, in one line. Raises CommandError for one that is too long."""
    text = " ".join(str("" if value is None else value).split())
    if len(text) > LONGEST_TEXT:
        raise CommandError(f"{where}: {len(text)} characters; allowed: up to {LONGEST_TEXT}")
    return text


def rows_in_order(sent: Sequence[object], number: int, whose: str) -> list[Mapping[str, object]]:
    """The ``number`` rows that a browser ``sent``, in whatever order it shows them, by their ``id``: 0, 1, …

    Raises CommandError for other rows than those ``whose`` says, such as "the runs of the study".
    """
    found = {str(row.get("id")): row for row in sent if isinstance(row, Mapping)}
    if set(found) != {str(k) for k in range(number)}:
        raise CommandError(f"these are not {whose}; open the table again")
    return [found[str(k)] for k in range(number)]


def table_heading(title: str, how: str) -> None:
    """Title, and what can be done here."""
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
    """A table with *Save*: ``entered`` makes of the rows that a browser sent what is to be done, and what is then told.

    A CommandError of either is told below the table. ``height``: of the table, as CSS has it.
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
