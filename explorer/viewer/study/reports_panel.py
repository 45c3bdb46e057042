"""The reports of the project's finished studies and diagnoses, to read beside the scene or in a tab of their own."""

from __future__ import annotations

from html import escape
from pathlib import Path

from explorer.viewer.board.board_view import published_report
from explorer.viewer.panel import REPORTS, SELDOM, Now, PageContext, Panel
from explorer.viewer.study.result_chooser import title

NONE = "(no report yet)"
EMPTY = (
    "A report is written at the end of a calibration, of a diagnosis, of the analysis of a sheet and of an audit. It "
    "is one file that needs nothing else: verdict, figures, tables, and a paragraph of methods."
)


class ReportsPanel(Panel):
    """A list of reports, newest first; the chosen one in a frame."""

    name, tab, every = "reports", REPORTS, SELDOM

    def __init__(self, page: PageContext) -> None:
        gui = page.server.gui
        self._page = page
        self._list = gui.add_dropdown("Report", (NONE,), hint="Of this project, newest first.")
        self._frame = gui.add_html("")
        self._text = gui.add_markdown(EMPTY)
        self._folders: dict[str, Path] = {}
        self._shown: Path | None = None
        self._list.on_update(lambda event: page.post(self._show) if event.client_id is not None else None)

    def show(self, now: Now) -> None:
        """Offer the reports that there are now."""
        self._folders = {title(folder): folder for folder in self._page.project.reports}
        options = tuple(self._folders) or (NONE,)
        if tuple(self._list.options) != options:
            self._list.options = options
        self._show()

    def _show(self) -> None:
        folder = self._folders.get(str(self._list.value))
        if folder == self._shown:
            return
        self._shown = folder
        self._text.visible = folder is None
        if folder is None:
            self._frame.content = ""
            return
        address = published_report(self._page.pages, folder)
        self._frame.content = (
            f'<p style="padding:0 0.75em; font-size:13px"><a href="{address}" target="_blank" rel="noopener">'
            f'Open {escape(title(folder))} in a tab of its own</a></p><iframe title="Report" src="{address}" '
            f'style="width:100%; height:calc(100dvh - 245px); min-height:320px; border:0; background:white"></iframe>'
        )
