"""Orders that wait while a command runs: the next one begins when the one before has come to its end.

An end is a report or a failure; a command that was cancelled leaves the line waiting for the next start, because who
cancels wants quiet.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Generic, TypeVar

from explorer.background.command_process import BackgroundError, CommandProcess, CommandStatus

MOST_WAITING = 5

Order = TypeVar("Order")


class WaitingLine(Generic[Order]):
    """Orders for ``process``, which ``begin`` starts; ``what``: the word for several of them, such as "studies"."""

    def __init__(self, process: CommandProcess, begin: Callable[[Order], None], what: str) -> None:
        self._process, self._begin, self._what = process, begin, what
        self._waiting: deque[Order] = deque()
        self._follow_up = False

    @property
    def waiting(self) -> tuple[Order, ...]:
        """The orders that wait, next one first."""
        return tuple(self._waiting)

    def add(self, order: Order) -> None:
        """Begin ``order`` after those before it, at once if nothing runs. Raises BackgroundError if it is full."""
        if len(self._waiting) >= MOST_WAITING:
            raise BackgroundError(f"{MOST_WAITING} {self._what} wait already; more are not kept")
        self._waiting.append(order)
        if not self.status().alive:
            self._begin_next()

    def clear(self) -> None:
        """Forget the orders that wait."""
        self._waiting.clear()

    def status(self) -> CommandStatus:
        """Status of the process; begins the next order where a command has ended since the last look."""
        status = self._process.status()
        if status.alive:
            self._follow_up = True
        elif self._follow_up:
            self._follow_up = False
            if self._waiting and status.state in ("finished", "failed"):
                try:
                    self._begin_next()
                except (ValueError, OSError) as error:
                    # Nobody pressed a button that could tell: the status does, and the order still waits.
                    return replace(status, state="failed", message=f"the next one cannot start: {error}")
                return self._process.status()
        return status

    def _begin_next(self) -> None:
        """Begin the first order; it waits on where that fails."""
        self._begin(self._waiting[0])
        self._waiting.popleft()

    def begun(self) -> None:
        """A command was started or resumed: its end lets the next order begin, even if nobody looks in between."""
        self._follow_up = True
