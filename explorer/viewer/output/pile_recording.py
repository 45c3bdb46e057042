"""The piles of a finished diagnosis or study as a recording: made in the background, sent to the browser that asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from html import escape
from pathlib import Path
from typing import Any

from explorer.background.command_output import command_output
from explorer.background.command_process import PROGRAM
from explorer.viewer.actions import BackgroundWork, client_buttons
from explorer.viewer.output.send_file import refuse_large, send_file
from explorer.viewer.panel import PageContext
from explorer.viewer.view import small_html

RECORD = "Record the piles (.rrd)"


class PileRecording:
    """A button, and a line while it pours. ``order``: command line of the finished result without ``--record``.

    The command pours in a process of its own, at low priority; its file stays in the folder of recordings.
    """

    def __init__(
        self, page: PageContext, order: Callable[[], tuple[Path, Sequence[str]]], program: Sequence[str] = PROGRAM
    ) -> None:
        self._folder, self._order, self._program = page.data / "recordings", order, program
        # Of its own: it may take minutes, and nothing else of the page waits for it.
        self._work = BackgroundWork(page.post)
        self._buttons = client_buttons(
            page.server.gui,
            "Recording",
            {RECORD: self._record},
            page.post,
            hint="Measured pile and the piles before and after, pouring side by side, with outlines, angle, discharge "
            "and errors: one file for `explorer replay` or rerun. Pours both models, in the background: up to minutes.",
        )
        self._line = page.server.gui.add_html("", visible=False)
        self._now = ""

    def show(self) -> None:
        """Say whether one is being made."""
        busy = self._work.busy_with
        said = small_html(escape(f"Busy {busy}: {self._now}")) if busy else ""
        if self._line.content != said:
            self._line.content, self._line.visible = said, bool(busy)

    def _hear(self, line: str) -> None:
        """What the command is at, in its own words."""
        self._now = line

    def _record(self, client: Any) -> None:
        out, arguments = self._order()

        def made() -> Path:
            self._folder.mkdir(parents=True, exist_ok=True)
            path = self._folder / f"{out.name}-piles-{datetime.now():%Y%m%d-%H%M%S-%f}.rrd"
            command_output([*arguments, "--out", str(out), "--record", str(path)], self._program, self._hear)
            return path

        def send(path: Path) -> None:
            refuse_large([path])
            send_file(client, path.name, path.read_bytes())

        self._now = "the solver loads"
        self._work.start("recording the piles", made, send)
