"""Buttons, bar and text of a command that runs in the background; what stands in the text is the panel's own."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import viser

from explorer.background.command_process import CommandStatus
from explorer.viewer.actions import Action, Post
from explorer.viewer.buttons import button_group

MARKDOWN_MARKS = re.compile(r"([\\`*_{}\[\]<>()#+!|~&])")

STATE_WORDS = {
    "running": "Running at low priority; the pour goes on.",
    "paused": "Paused: it stands still and keeps what it has.",
    "cancelled": "Cancelled.",
    "finished": "Finished.",
    "failed": "Failed.",
}


class ProcessView:
    """Buttons named ``title``, which post the ``acts`` of their names, a second row for ``more``; a bar and a text."""

    def __init__(
        self,
        server: viser.ViserServer,
        title: str,
        acts: Mapping[str, Action],
        post: Post,
        more: Mapping[str, Action] | None = None,
    ) -> None:
        rows = [(title, acts)] + ([("", more)] if more else [])
        self._buttons = [button_group(server.gui, name, row, post) for name, row in rows]
        self._bar = server.gui.add_progress_bar(0.0)
        self._text = server.gui.add_markdown("")

    def show(self, status: CommandStatus, text: str) -> None:
        """Bar and text; call it inside ``server.atomic()``."""
        percent = 100.0 * progress(status)
        if self._bar.value != percent:
            self._bar.value = percent  # type: ignore[misc]
        if self._bar.animated != (status.state == "running"):
            self._bar.animated = status.state == "running"
        if self._text.content != text:
            self._text.content = text


def progress(status: CommandStatus) -> float:
    """Share of the planned runs that are done, 0 … 1."""
    return min(1.0, max(0.0, status.done / status.planned)) if status.planned > 0 else 0.0


def time_left(eta_s: float | None) -> str:
    """Seconds as "2 min 05 s"; a dash where nobody knows."""
    if eta_s is None or not 0.0 <= eta_s < 1e6:
        return "–"
    minutes, seconds = divmod(round(eta_s), 60)
    return f"{minutes} min {seconds:02d} s" if minutes else f"{seconds} s"


def waiting_markdown(waiting: Sequence[str]) -> str:
    """A paragraph with the orders that wait, next one first; empty where none does."""
    return f"\n\nWaiting: {escaped('; '.join(waiting))}." if waiting else ""


def escaped(text: str) -> str:
    """``text`` as one line that markdown shows as it is."""
    return MARKDOWN_MARKS.sub(r"\\\1", " ".join(text.split()))
