"""The head of the tab "Laboratory", whose panels do what `lab`, `measure`, `design`, `analyse` and `audit` do."""

from __future__ import annotations

from html import escape

from explorer.viewer.panel import LABORATORY, Now, PageContext, Panel
from explorer.viewer.view import small_html


class LaboratoryPanel(Panel):
    """What the tab is for, and the job being done in it."""

    name, tab = "laboratory", LABORATORY

    def __init__(self, page: PageContext) -> None:
        self._background = page.bench_work
        page.server.gui.add_markdown(
            "From readings, photographs and tables to parameters; single bodies on the solver."
        )
        self._state = page.server.gui.add_html("")

    def show(self, now: Now) -> None:
        """Show the job being done, or the page's last message."""
        busy = self._background.busy_with
        state = small_html(escape(f"Busy {busy}." if busy else now.notice))
        if self._state.content != state:
            self._state.content = state
