"""An answer on the page: the terminal's text, a picture, charts, the command line that repeats it, downloads."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import Any

import viser

from explorer.background.output_folder import new_folder
from explorer.errors import CommandError
from explorer.files.output_file import write_whole_bytes
from explorer.laboratory.command_results import CommandResult
from explorer.project.project import REPORT
from explorer.terminal.photograph import Rows
from explorer.viewer.actions import Post
from explorer.viewer.output.send_file import send_files
from explorer.viewer.study.plot_view import PlotView
from explorer.viewer.view import small_html

TIED = re.compile(r"(?<=\d) (?=\S)")
"""The space after a number, at which a narrow table must not break."""
LONGEST_ROW = 90
"""Longest line [characters] that is shown unchanged."""
NO_CHARTS = "Charts come with an answer that has any."


class AnswerView:
    """Shows one :class:`CommandResult` at a time; ``waiting`` (plain text) is shown before the first.

    If an answer has a report, it is kept in a new folder in ``reports``, where the room of reports finds it.
    """

    def __init__(
        self, server: viser.ViserServer, waiting: str, post: Post, charts: bool = False, reports: Path | None = None
    ) -> None:
        self._gui, self._versions, self._reports = server.gui, 0, reports
        self._answer: CommandResult | None = None
        self._text = server.gui.add_html(small_html(escape(waiting)))
        self._place = server.gui.add_folder(None)
        self._picture: Any = None
        self._plots = PlotView(server, "Chart of it", NO_CHARTS, post) if charts else None
        self._take = server.gui.add_button(
            "Download the files", disabled=True, hint="The files that the command line would write."
        )

        @self._take.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                client = event.client
                post(lambda: self._send(client))

    def show(self, answer: CommandResult) -> None:
        """Show ``answer`` in place of the previous one."""
        self._answer = answer
        self._versions += 1
        self._text.content = answer_html(answer, self._kept(answer))
        self._take.disabled = not answer.files
        if self._plots is not None:
            self._plots.offer(answer.plots, self._versions)
        if self._picture is not None:
            self._picture.remove()
            self._picture = None
        if answer.picture is not None:
            with self._place:
                self._picture = self._gui.add_image(answer.picture, label=None)

    def set_dark(self, dark: bool) -> None:
        """Draw the charts for a dark or a light page."""
        if self._plots is not None:
            self._plots.dark = dark

    def _kept(self, answer: CommandResult) -> str:
        """Keep the report of ``answer``; returns a message for the user, empty if there is no report."""
        made = [content for name, content in answer.files.items() if name.endswith(".html")]
        if self._reports is None or not made:
            return ""
        folder = new_folder(self._reports, answer.command.split()[1])
        folder.mkdir()
        write_whole_bytes(folder / REPORT, made[0])
        return f"Its report is in the room Reports: {folder.name}."

    def _send(self, client: Any) -> None:
        if self._answer is None:
            raise CommandError("there is no answer yet")
        send_files(client, self._answer.files)


def answer_html(answer: CommandResult, kept: str = "") -> str:
    """Tables that fit a narrow panel, or scrolled text in columns; and the command line, selected by one click.

    ``kept``: where its report is, in words.
    """
    box = "padding:0.4em; margin:0.3em 0; background:rgba(128,150,170,0.14)"
    text = f"<pre style='{box}; overflow-x:auto; max-height:26em; white-space:pre; user-select:text'>"
    text += "".join(map(_line_html, answer.text.splitlines())) + "</pre>"
    tables = "".join(_table_html(caption, rows) for caption, rows in answer.tables.items())
    return small_html(
        f"{tables or text}<p>{escape(answer.note)}</p>{escape(kept)} On the command line:"
        f"<code style='{box}; display:block; user-select:all; white-space:pre-wrap'>{escape(answer.command)}</code>"
    )


def _line_html(line: str) -> str:
    """A line of columns (separated by two spaces) stays as it is; other long lines are wrapped."""
    sentence = len(line) > LONGEST_ROW and "  " not in line.strip()
    style = " style='white-space:pre-wrap; overflow-wrap:anywhere'" if sentence else ""
    return f"<div{style}>{escape(line) or '&nbsp;'}</div>"


def _table_html(caption: str, rows: Rows) -> str:
    """A table of two columns; lines break between words, never inside a number."""
    cell = "padding:0.15em 0.6em 0.15em 0; text-align:left; vertical-align:top; overflow-wrap:normal"
    lines = "".join(
        f"<tr><th scope='row' style='{cell}; font-weight:normal; opacity:0.8'>{escape(name)}</th>"
        f"<td style='{cell}; font-variant-numeric:tabular-nums'>{TIED.sub(chr(0xA0), escape(said))}</td></tr>"
        for name, said in rows
    )
    head = f"<caption style='text-align:left; font-weight:bold; padding:0.3em 0'>{escape(caption)}</caption>"
    return f"<table style='width:100%; border-collapse:collapse; user-select:text'>{head}{lines}</table>"
