"""From callbacks to the page's loop.

viser calls back on many threads. A callback only leaves an action here; the one thread that owns session and
page carries it out, and shows the one line of whatever was refused, by us or by the machine.
"""

from __future__ import annotations

import queue
from collections.abc import Callable

Action = Callable[[], None]
Post = Callable[[Action], None]


class Actions:
    """A queue of actions."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Action] = queue.SimpleQueue()

    def post(self, action: Action) -> None:
        """Leave ``action`` for the loop; from any thread."""
        self._waiting.put(action)

    def carry_out(self) -> str | None:
        """Run all that waits. The line of the last input that was refused, "" if none was, None if nothing ran."""
        notice: str | None = None
        while True:
            try:
                action = self._waiting.get_nowait()
            except queue.Empty:
                return notice
            try:
                action()
                notice = notice or ""
            except ValueError as error:
                notice = str(error)
            except OSError as error:  # a full disk, a folder that may not be written to
                notice = f"{error.filename or 'file'}: {error.strerror or error}"
