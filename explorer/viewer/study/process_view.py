"""A command that runs in the background: buttons, bar and text, with its stages and its runs without a pile as tables.

What stands in the text is the panel's own; the tables are markdown.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import viser

from explorer.background.command_process import CommandStatus
from explorer.background.progress import FailedRun, StageProgress, failures
from explorer.outcomes import outcome_text
from explorer.viewer.actions import Action, Post, button_group

MARKDOWN_MARKS = re.compile(r"([\\`*_{}\[\]<>()#+!|~&])")

STATE_WORDS = {
    "running": "Running at low priority; the pour goes on.",
    "paused": "Paused: it stands still and keeps what it has.",
    "cancelled": "Cancelled.",
    "finished": "Finished.",
    "failed": "Failed.",
}

FAILURES_SHOWN = 6
DONE, AT_WORK, TO_COME = "done", "▶", "–"


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


def stages_markdown(
    status: CommandStatus, what: str, runs: str, notice: str = "", so_far: str = "", counted: str = ""
) -> str:
    """State, a row per stage, and failed runs; texts of the command are escaped.

    Args:
        status: how far it is.
        what: what a run of the command is called, such as "study".
        runs: heading of what is counted, such as "Runs".
        notice: the page's own last message, such as a refused click.
        so_far: what the stage at work would find if it ended now.
        counted: what the numbers done and planned and the time left are of, where it is less than the whole.
    """
    state = STATE_WORDS.get(status.state, f"No {what} runs.")
    if status.alive and status.planned:
        part = f"{counted}: " if counted else ""
        state += f" {part}{status.done} of {status.planned} {runs.lower()}, time left {time_left(status.eta_s)}."
    if status.alive and not status.done and status.stage:
        state += f" Now: {escaped(status.stage)}."
    parts = [state]
    parts += [escaped(text) for text in dict.fromkeys((notice, status.message)) if text]
    if status.stages:
        parts.append(_table(status, runs, so_far))
    lost = failures(status.tried)
    if lost:
        parts.append(failures_markdown(lost))
    return "\n\n".join(parts)


def _table(status: CommandStatus, runs: str, so_far: str) -> str:
    rows = "\n".join(_row(stage, status, so_far) for stage in status.stages)
    return f"| Stage | {runs} | | Found |\n|:--|--:|:-:|:--|\n{rows}"


def _row(stage: StageProgress, status: CommandStatus, so_far: str) -> str:
    over = stage.finding is not None or 0 < stage.planned <= stage.done
    at_work = status.alive and not over and stage.name == status.stage
    mark = DONE if over else AT_WORK if at_work else TO_COME
    count = f"{stage.done} of {stage.planned}" if stage.planned else TO_COME
    found = stage.finding or (f"so far: {so_far}" if at_work and so_far else "")
    return f"| {escaped(stage.name)} | {count} | {mark} | {escaped(found)} |"


def failures_markdown(lost: tuple[FailedRun, ...]) -> str:
    """The newest runs that gave no pile, and what took their places."""
    rows = "\n".join(
        f"| {escaped(one.run.stage)} | {escaped(one.run.label)} | {_outcome(one)} | {one.run.seed} | {_next(one)} |"
        for one in lost[:FAILURES_SHOWN]
    )
    head = f"**{len(lost)} without a valid result**" + (
        f", the newest {FAILURES_SHOWN}:" if len(lost) > FAILURES_SHOWN else ":"
    )
    return f"{head}\n\n| Stage | Setting | Outcome | Seed | Next seed |\n|:--|:--|:--|--:|:--|\n{rows}"


def _outcome(one: FailedRun) -> str:
    return escaped(outcome_text(one.run.outcome, one.run.message))


def _next(one: FailedRun) -> str:
    if one.replaced_by is None:
        return "none"
    return escaped(f"{one.replaced_by.seed}: {outcome_text(one.replaced_by.outcome)}")


def waiting_markdown(waiting: Sequence[str]) -> str:
    """A paragraph with the orders that wait, next one first; empty where none does."""
    return f"\n\nWaiting: {escaped('; '.join(waiting))}." if waiting else ""


def time_left(eta_s: float | None) -> str:
    """Seconds as "2 min 05 s"; a dash where nobody knows."""
    if eta_s is None or not 0.0 <= eta_s < 1e6:
        return "–"
    minutes, seconds = divmod(round(eta_s), 60)
    return f"{minutes} min {seconds:02d} s" if minutes else f"{seconds} s"


def escaped(text: str) -> str:
    """``text`` as one line that markdown shows as it is."""
    return MARKDOWN_MARKS.sub(r"\\\1", " ".join(text.split()))
