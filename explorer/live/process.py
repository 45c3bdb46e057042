"""The solver process: takes commands until it is told to close or its parent is gone.

The parent imports this file, so Taichi is imported inside :func:`run` only.
"""

from __future__ import annotations

import multiprocessing
import queue
import signal
import traceback
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

from explorer.live.messages import Close, Command, Failure, Start
from explorer.priority import LIVE, give_way

if TYPE_CHECKING:
    from explorer.live.live_pour import LivePour

IDLE_WAIT = 0.5
"""Longest wait [s] for a command before the process looks whether its parent still lives."""


def run(commands: Any, reports: Connection, frames: Any, details: Any, reading: Connection) -> None:
    """Main function of the process: commands in by a queue, reports out, frames and details by shared memory.

    ``reading`` is the line to the process that reads angles. Reports have no queue, whose thread would wait for the
    interpreter while the solver computes.
    """
    # Ctrl-C in a terminal reaches the whole group; the parent decides when this process ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The page, and a browser beside it that draws without a graphics card, go first: else what is seen lags behind.
    give_way(LIVE)
    try:
        _work(commands, reports, frames, details, reading)
    except BrokenPipeError:
        return  # nobody listens any more
    except Exception as error:  # whatever it is, the person at the screen has to hear of it
        traceback.print_exc()
        reports.send(Failure(f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"))


def _work(commands: Any, reports: Connection, frames: Any, details: Any, reading: Connection) -> None:
    from explorer.live.details import DetailWriter
    from explorer.live.frames import FrameWriter
    from explorer.live.live_pour import LivePour, Publisher
    from solver import backend

    backend.init(threads=1)
    pour: LivePour | None = None
    while True:
        for command in _waiting(commands, pour):
            if isinstance(command, Close):
                return
            if pour is not None:
                pour.obey(command)
            elif isinstance(command, Start):
                screen = Publisher(FrameWriter(frames), DetailWriter(details))
                pour = LivePour(command, screen, reports.send, reading)
        if not _parent_lives():
            return
        if pour is not None and pour.seconds_to_wait() == 0.0:
            pour.advance()


def _waiting(commands: Any, pour: LivePour | None) -> list[Command]:
    """Commands that have come in; waits for one while there is nothing else to do."""
    wait = None if pour is None else pour.seconds_to_wait()
    found: list[Command] = []
    try:
        # Even the shortest wait hands the processor over; a pour that is behind the clock has no time for it.
        found.append(commands.get(block=wait != 0.0, timeout=IDLE_WAIT if wait is None else wait))
        while True:
            found.append(commands.get_nowait())
    except queue.Empty:
        return found


def _parent_lives() -> bool:
    parent = multiprocessing.parent_process()
    return parent is None or parent.is_alive()
