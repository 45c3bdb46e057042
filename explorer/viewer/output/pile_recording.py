"""The piles of a finished diagnosis or study as a recording: made in the background, sent to the browser that asked."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from datetime import datetime
from html import escape
from pathlib import Path
from typing import Any

from explorer.background.command_output import command_output
from explorer.background.command_process import PROGRAM
from explorer.errors import CommandError
from explorer.viewer.actions import BackgroundWork, client_buttons
from explorer.viewer.output.send_file import refuse_large, send_file
from explorer.viewer.panel import PageContext
from explorer.viewer.view import small_html

RECORD, CANCEL = "Record the piles (.rrd)", "Cancel the recording"


class PileRecording:
    """A button, and a line while it pours. ``order``: command line of the finished result without ``--record``.

    The command pours in a process of its own, at low priority; its file stays in the folder of recordings.
    """

    def __init__(
        self, page: PageContext, order: Callable[[], tuple[Path, Sequence[str]]], program: Sequence[str] = PROGRAM
    ) -> None:
        self._folder, self._order, self._program = page.data / "recordings", order, program
        # A worker of its own: it may take minutes, and nothing else on the page is to wait for it.
        self._work = BackgroundWork(page.post)
        self._process: subprocess.Popen[str] | None = None
        self._cancelled = False
        self._buttons = client_buttons(
            page.server.gui,
            "Recording",
            {RECORD: self._record, CANCEL: self._cancel},
            page.post,
            hint="Measured pile and the piles before and after, pouring side by side, with outlines, angle, discharge "
            "and errors: one file for `explorer replay` or rerun. Pours both models, in the background: up to minutes.",
        )
        self._line = page.server.gui.add_html("", visible=False)
        self._now = ""

    def offer(self, able: bool) -> None:
        """Set whether there is an answer to record; a recording in progress can be cancelled even without one."""
        visible = able or bool(self._work.busy_with)
        if self._buttons.visible != visible:
            self._buttons.visible = visible

    def show(self) -> None:
        """Say whether a recording is being made."""
        busy = self._work.busy_with
        offered = (CANCEL,) if busy else (RECORD,)
        if tuple(self._buttons.options) != offered:
            self._buttons.options = offered
        said = small_html(escape(f"Busy {busy}: {self._now}")) if busy else ""
        if self._line.content != said:
            self._line.content, self._line.visible = said, bool(busy)

    def _hear(self, line: str) -> None:
        """Take a line in which the command says what it is doing."""
        self._now = line

    def _begun(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        if self._cancelled:  # before the process existed
            process.kill()

    def _cancel(self, client: Any) -> None:
        self._cancelled = True
        if self._process is not None:
            self._process.kill()

    def _record(self, client: Any) -> None:
        out, arguments = self._order()

        def made() -> Path:
            self._folder.mkdir(parents=True, exist_ok=True)
            path = self._folder / f"{out.name}-piles-{datetime.now():%Y%m%d-%H%M%S-%f}.rrd"
            whole = [*arguments, "--out", str(out), "--record", str(path)]
            try:
                command_output(whole, self._program, self._hear, self._begun)
            except CommandError:
                path.unlink(missing_ok=True)
                if self._cancelled:
                    raise CommandError("the recording of the piles was cancelled") from None
                raise
            return path

        def send(path: Path) -> None:
            refuse_large([path])
            send_file(client, path.name, path.read_bytes())

        self._now, self._cancelled, self._process = "the solver loads", False, None
        self._work.start("recording the piles", made, send)
