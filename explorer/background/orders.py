"""Commands of one kind in the background, such as studies: one runs at a time, the others wait in a queue.

The next order begins when the one before has ended, with a report or a failure. After a cancelled command the queue
waits for the next start, because whoever cancels wants quiet. It also waits after an order that cannot begin, and until
then the status says why.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from explorer.background.command_process import BackgroundError, CommandProcess, CommandStatus
from explorer.background.output_folder import finished

Order = TypeVar("Order")
MOST_WAITING = 5


class BackgroundOrders(Protocol):
    """What the page needs of commands of one kind, wherever they run."""

    @property
    def out(self) -> Path | None:
        """Output folder of the command started last; None before the first."""

    def clear_queue(self) -> None:
        """Forget the waiting orders."""

    def waiting(self) -> tuple[str, ...]:
        """The waiting orders, next one first, in words."""

    def pause(self) -> None:
        """Suspend the running command."""

    def go_on(self) -> None:
        """Let the paused command continue."""

    def cancel(self) -> None:
        """Stop the command; finished pours are kept."""

    def status(self) -> CommandStatus:
        """State, progress and partial results."""

    def finished(self) -> tuple[Path, ...]:
        """Output folders of finished commands, newest first."""


class OrderedCommands(ABC, Generic[Order]):
    """Orders for ``process``, each with an output folder in ``folder``; a finished one has the file ``result`` there.

    ``what``: the plural for the orders, such as "studies".
    """

    def __init__(self, process: CommandProcess, folder: Path, result: str, what: str) -> None:
        self._process, self._folder, self._result, self._what = process, folder, result, what
        self._line: deque[Order] = deque()
        self._follow_up = False
        self._refused = ""
        """Why the next order could not begin; kept until another command begins or the queue is cleared."""
        self.cancel, self.pause, self.go_on = process.cancel, process.pause, process.go_on

    @property
    def out(self) -> Path | None:
        """Output folder of the command started last."""
        return self._process.out

    def finished(self) -> tuple[Path, ...]:
        """Output folders of finished commands of this kind, newest first."""
        return finished(self._folder, self._result)

    def waiting(self) -> tuple[str, ...]:
        """The waiting orders, next one first, in words."""
        return tuple(map(self._in_words, self._line))

    def clear_queue(self) -> None:
        """Forget the waiting orders."""
        self._line.clear()
        self._refused = ""

    def close(self) -> None:
        """Cancel the running command and wait for its end."""
        self.clear_queue()
        self._process.close()

    def status(self) -> CommandStatus:
        """Status of the process; begins the next order if a command has ended since the last call."""
        status = self._process.status()
        if status.alive:
            self._follow_up = True
        elif self._follow_up:
            self._follow_up = False
            if self._line and status.state in ("finished", "failed"):
                try:
                    self._begin_next()
                except (ValueError, OSError) as error:
                    # No button was pressed that could report it, so the status does; the order keeps waiting.
                    self._refused = f"the next one cannot start: {error}; the queue waits for another start"
                status = self._process.status()
        return replace(status, state="failed", message=self._refused) if self._refused else status

    @abstractmethod
    def _begin(self, order: Order) -> None:
        """Start the command of ``order`` by :meth:`_start`."""

    @abstractmethod
    def _in_words(self, order: Order) -> str:
        """``order`` as it is listed while it waits."""

    def _add(self, order: Order) -> None:
        """Queue ``order``; begin at once if nothing runs. Raises BackgroundError if the queue is full."""
        if len(self._line) >= MOST_WAITING:
            raise BackgroundError(f"{MOST_WAITING} {self._what} are already waiting, the most that are kept")
        self._line.append(order)
        if not self.status().alive:
            self._begin_next()

    def _begin_next(self) -> None:
        """Begin the first order; if that fails, it keeps waiting."""
        self._begin(self._line[0])
        self._line.popleft()

    def _start(self, out: Path, arguments: list[str]) -> None:
        """Start a command; its end lets the next order begin, even if nobody asks for the status in between."""
        self._process.start(out, arguments)
        self._follow_up, self._refused = True, ""

    def _go_on_in(self, out: Path, arguments: list[str]) -> None:
        """Resume a command in its output folder; its end, too, lets the next order begin."""
        self._process.resume(out, arguments)
        self._follow_up, self._refused = True, ""
