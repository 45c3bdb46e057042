"""A command that runs in the background: the buttons that apply now, a progress bar, its state, and failed runs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import viser

from explorer.background.command_process import CommandStatus, PourPlace
from explorer.background.events import FailedRun, failures
from explorer.background.orders import BackgroundOrders
from explorer.outcomes import outcome_text
from explorer.viewer.actions import Action, Post, SharedBox, button_group

MARKDOWN_MARKS = re.compile(r"([\\`*_{}\[\]<>()#+!|~&])")

START, PAUSE, CONTINUE, CANCEL = "Start", "Pause", "Continue", "Cancel"
RESUME, RETRY, QUEUE, CLEAR = "Resume last", "Retry", "Queue", "Clear queue"
GOES_ON = f"Cancelled. What was poured is kept: *{RESUME}* goes on."
"""Text for a cancelled command that *Resume* would continue."""
OFFERED = {"running": (PAUSE, CANCEL, QUEUE), "paused": (CONTINUE, CANCEL, QUEUE)}
"""State → buttons while there is a command; otherwise one can be started, resumed or retried."""

STATE_WORDS = {
    "running": "Running at low priority; the pour goes on.",
    "paused": "Paused: it stands still and keeps what it has.",
    "cancelled": "Cancelled. What was poured is kept.",
    "finished": "Finished.",
    "failed": "Failed.",
}

FAILURES_SHOWN = 6
DONE, AT_WORK, TO_COME = "done", "▶", "–"


def orders(process: BackgroundOrders, start: Action, resume: Action, queue: Action) -> dict[str, Action]:
    """What the buttons of ``process`` do; ``start``, ``resume`` and ``queue`` read the choices in the panel."""
    return {
        START: start,
        PAUSE: process.pause,
        CONTINUE: process.go_on,
        CANCEL: process.cancel,
        RESUME: resume,
        QUEUE: queue,
        CLEAR: process.clear_queue,
    }


class ProcessView:
    """A group of buttons with a ``title``, each posting the action of its name in ``acts``, a bar and a text."""

    def __init__(self, server: viser.ViserServer, title: str, acts: Mapping[str, Action], post: Post) -> None:
        self._acts = dict(acts)
        self._buttons = button_group(server.gui, title, acts, post)
        self._bar = server.gui.add_progress_bar(0.0)
        self._text = server.gui.add_markdown("")

    def show(self, status: CommandStatus, text: str, waiting: Sequence[str] = (), resumable: bool = True) -> None:
        """Update all; call it inside ``server.atomic()``. ``resumable``: a command was stopped before its end."""
        again = (RETRY,) if status.state == "failed" or failures(status.tried) else ()
        idle = (START, *((RESUME,) if resumable else ()), *again)
        wanted = (*OFFERED.get(status.state, idle), *((CLEAR,) if waiting else ()))
        options = tuple(label for label in wanted if label in self._acts)
        if tuple(self._buttons.options) != options:
            self._buttons.options = options
        if self._bar.visible != status.alive:
            self._bar.visible = status.alive
        percent = 100.0 * progress(status)
        if self._bar.value != percent:
            self._bar.value = percent  # type: ignore[misc]
        if self._bar.animated != (status.state == "running"):
            self._bar.animated = status.state == "running"
        if self._text.content != text:
            self._text.content = text


class PlaceChoice:
    """A list of places where the next ``what`` can pour; there is no list if there is only one place."""

    def __init__(self, server: viser.ViserServer, place: PourPlace, what: str, post: Post) -> None:
        self._place, self._box = place, None
        if len(place.offered) == 1:
            return
        hint = f"Where the next {what} pours, also one that is resumed: on the workers of a Dask scheduler, or here."
        offered = server.gui.add_dropdown("Pour on", place.offered, initial_value=place.chosen, hint=hint)
        self._box = SharedBox(offered)
        self._box.listen(post, lambda sent: place.choose(str(sent)))

    def show(self) -> None:
        """Show the choice, which may have been made in another panel."""
        if self._box is not None and not self._box.held() and self._box.value != self._place.chosen:
            self._box.show(self._place.chosen)


def progress(status: CommandStatus) -> float:
    """Share of the planned runs that are done, 0 … 1."""
    return min(1.0, max(0.0, status.done / status.planned)) if status.planned > 0 else 0.0


def state_markdown(
    status: CommandStatus, what: str, runs: str, notice: str = "", counted: str = "", goes_on: bool = False
) -> str:
    """State, messages and failed runs; texts from the command are escaped.

    Args:
        status: how far it is.
        what: the name of one run of the command, such as "study"; empty: do not say that none is running.
        runs: the name of what is counted, such as "runs".
        notice: the page's own last message, such as a refused click.
        counted: the part that the numbers done and planned and the time left cover, if they do not cover the whole.
        goes_on: whether *Resume last* would continue this very command, if it was cancelled.
    """
    state = (
        GOES_ON
        if goes_on and status.state == "cancelled"
        else STATE_WORDS.get(status.state, f"No {what} is running." if what else "")
    )
    if status.alive and status.planned:
        part = f"{counted[0].upper()}{counted[1:]}: " if counted else ""
        state += f" {part}{status.done} of {status.planned} {runs}, time left {time_left(status.eta_s)}."
    if status.alive and status.stage:
        state += f" Now: {escaped(status.stage)}."
    parts = [state] if state else []
    parts += [escaped(text) for text in dict.fromkeys((notice, status.message)) if text]
    if lost := failures(status.tried):
        parts.append(failures_markdown(lost))
    return "\n\n".join(parts)


def failures_markdown(lost: tuple[FailedRun, ...]) -> str:
    """The newest runs that gave no pile, and what replaced them."""
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
    """A paragraph with the waiting orders, next one first; empty if there are none."""
    return f"\n\nWaiting: {escaped('; '.join(waiting))}." if waiting else ""


def time_left(eta_s: float | None) -> str:
    """Seconds as "2 min 05 s"; a dash if the time is unknown."""
    if eta_s is None or not 0.0 <= eta_s < 1e6:
        return "–"
    minutes, seconds = divmod(round(eta_s), 60)
    return f"{minutes} min {seconds:02d} s" if minutes else f"{seconds} s"


def escaped(text: str) -> str:
    """``text`` on one line, escaped so that Markdown shows it literally."""
    return MARKDOWN_MARKS.sub(r"\\\1", " ".join(text.split()))
