"""A board on the page: a frame in a panel that shows what is published at the board's address."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from html import escape
from pathlib import Path

import viser

from explorer.background.command_process import CommandStatus
from explorer.project.project import REPORT
from explorer.viewer.board.board import Board, board_json
from explorer.viewer.shell.web_pages import JSON, WebPage, WebPages

HEIGHT = "calc(100dvh - 330px)"


def published_report(pages: WebPages, folder: Path | None) -> str:
    """Address of the report in ``folder``, which is served from now on; empty if there is none."""
    return "" if folder is None or not (folder / REPORT).is_file() else pages.publish_folder(folder) + REPORT


class BoardView:
    """Publishes boards at ``address`` (``/study/page.json``); they are made in a thread, one at a time."""

    def __init__(self, server: viser.ViserServer, pages: WebPages, address: str, title: str) -> None:
        self._pages, self._address = pages, address
        self._version: Hashable = None
        self._worker: threading.Thread | None = None
        pages.publish(address, WebPage(JSON, board_json(Board("", ""))))
        server.gui.add_html(
            f'<iframe title="{escape(title)}" src="/shell/board.html#{address}" '
            f'style="width:100%; height:{HEIGHT}; min-height:320px; border:0; border-radius:8px"></iframe>'
        )

    @property
    def busy(self) -> bool:
        """Whether a board is being made."""
        return self._worker is not None and self._worker.is_alive()

    def show(
        self,
        shown: Hashable,
        folder: Path | None,
        status: CommandStatus | None,
        make: Callable[[CommandStatus | None, str], Board],
    ) -> None:
        """Show the board of the result ``shown`` in ``folder``, made again if it or its command's progress has changed.

        ``status``: of the command that works on it, None for a result from elsewhere. ``make`` takes the status and the
        address of the report, empty if there is none.
        """
        alive = status is not None and status.alive
        progress = (status.state, status.stage, status.done) if status is not None and alive else None
        reported = None if folder is None or alive or not (folder / REPORT).is_file() else folder
        self.offer((shown, progress, reported), lambda: make(status, published_report(self._pages, reported)))

    def offer(self, version: Hashable, make: Callable[[], Board]) -> None:
        """Show what ``make`` gives, unless ``version`` is already shown; deferred while another is being made."""
        if version == self._version or self.busy:
            return
        self._version = version
        self._worker = threading.Thread(target=self._publish, args=(make,), daemon=True, name="explorer-board")
        self._worker.start()

    def _publish(self, make: Callable[[], Board]) -> None:
        try:
            board = make()
        except (AssertionError, LookupError, TypeError, ValueError) as error:
            # A folder named by the user may hold any JSON, also that of another version.
            board = Board("This result cannot be shown", f"{type(error).__name__}: {error}")
        self._pages.publish(self._address, WebPage(JSON, board_json(board)))
