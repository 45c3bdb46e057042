"""Two finished studies side by side."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import viser

from doe.record import RecordError
from doe.studies.study_result import AnyStudy, StudyResult
from explorer.background.output_folder import ResultFile
from explorer.report.comparison import comparison
from explorer.report.content import Table
from explorer.viewer.actions import Post
from explorer.viewer.study.process_view import escaped
from explorer.viewer.study.result_chooser import ResultChooser, titles

NONE = "(choose a finished study)"
EMPTY = "Choose a second finished study: optimum, intervals and effects are then shown beside those of the one above."
THE_SAME = "This is the study above: choose another one."
NOT_YET = "The study above is not finished; a comparison needs two results."


class ComparisonPanel:
    """List of results to compare with the one that the page shows."""

    def __init__(self, server: viser.ViserServer, post: Post) -> None:
        self._file = ResultFile("result.json")
        self._chooser = ResultChooser(server, "Compare with", NONE, "result.json", post, self._draw)
        self._words = server.gui.add_markdown(EMPTY)
        self._result: AnyStudy | None = None
        self._folder: Path | None = None
        self._version: Hashable = None

    def offer(self, folders: Sequence[Path]) -> None:
        """Offer the present finished studies."""
        self._chooser.offer(folders)

    def show(self, result: AnyStudy | None, folder: Path | None, version: Hashable) -> None:
        """Follow the result that the page shows, which is in ``folder``."""
        shown = None if folder is None else folder.absolute()
        if (version, shown) != self._version:
            self._version, self._result, self._folder = (version, shown), result, shown
            self._draw()

    def _draw(self) -> None:
        folder = self._chooser.folder
        other = self._file.read(folder)
        if other is None or folder is None:
            text = EMPTY
        elif not isinstance(self._result, StudyResult) or self._folder is None:
            text = NOT_YET
        elif folder == self._folder:
            text = THE_SAME
        else:
            one, another = titles([self._folder, folder])
            text = comparison_markdown(self._result, other, (one, another))
        if self._words.content != text:
            self._words.content = text


def comparison_markdown(one: StudyResult, other: Mapping[str, Any], names: tuple[str, str]) -> str:
    """The tables, or one line if the other file is not a complete result."""
    try:
        tables = comparison(one, StudyResult.from_dict(other), names)
    except RecordError as error:
        # A folder named by the user may hold any JSON, also that of another version.
        return f"These two cannot be compared: {escaped(str(error))}"
    return "\n\n".join(table_markdown(table) for table in tables)


def table_markdown(table: Table) -> str:
    """A table with all its texts escaped."""
    lines = [table.header, tuple(":--" for _ in table.header), *table.rows]
    rows = [
        "| " + " | ".join(cell if k == 1 else escaped(cell) for cell in cells) + " |" for k, cells in enumerate(lines)
    ]
    return "\n".join(rows) + (f"\n\n{escaped(table.caption)}" if table.caption else "")
