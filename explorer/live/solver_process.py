"""The solver process: from outside, its start, its end and the connections to it; inside, its main function. No viser.

It takes commands until it is told to close or its parent is gone. The parent imports this file too, so Taichi is
imported inside :func:`run` only.
"""

from __future__ import annotations

import multiprocessing
import queue
import signal
import traceback
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

from explorer.live.angle_reader import run as read_angles
from explorer.live.details import detail_reader, shared_details
from explorer.live.frames import FrameReader, shared_block
from explorer.live.messages import Close, Command, Failure, Report, Start
from explorer.priority import LIVE, give_way
from solver.pours.worker_pool import deaf_to_interrupts

if TYPE_CHECKING:
    from explorer.live.live_pour import LivePour

CLOSE_WAIT = 3.0
"""Seconds that the process has to end by itself."""
IDLE_WAIT = 0.5
"""Longest wait [s] for a command before the process checks whether its parent is still alive."""


class SolverProcess:
    """A solver process, started at once, and the process that reads angles for it.

    frames, details: what it publishes, in shared memory; readable also after its end.
    """

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        # Queue and connections belong to this process alone: a process that is killed may leave its queue locked.
        self._commands = context.Queue()
        self._reports, reporting = context.Pipe(duplex=False)
        frames, details = shared_block(context), shared_details(context)
        self.frames, self.details = FrameReader(frames), detail_reader(details)
        asking, answering = context.Pipe()
        self._solver = context.Process(
            target=run, args=(self._commands, reporting, frames, details, asking), name="explorer-solver", daemon=True
        )
        self._reader = context.Process(target=read_angles, args=(answering,), name="explorer-angles", daemon=True)
        with deaf_to_interrupts():
            for process in (self._reader, self._solver):
                process.start()
        # With these closed, every connection has one process at each end, which notices when the other one ends.
        for end in (asking, answering, reporting):
            end.close()

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._solver.is_alive()

    @property
    def process_id(self) -> int | None:
        """Process id in the system."""
        return self._solver.pid

    @property
    def exit_code(self) -> int | None:
        """Exit code of the process; None while it runs."""
        return self._solver.exitcode

    def send(self, *commands: Command) -> None:
        """Put ``commands`` into the queue of the process, in order."""
        for command in commands:
            self._commands.put(command)

    def heard(self) -> list[Report]:
        """What the process has reported since the last call."""
        reports: list[Report] = []
        try:
            while self._reports.poll():
                reports.append(self._reports.recv())
        except (EOFError, OSError):
            pass  # the other end of the connection is gone
        return reports

    def close(self) -> None:
        """Ask the process to end, and kill it if it does not."""
        if self.alive:
            self.send(Close())
            self._solver.join(CLOSE_WAIT)
        self.kill()

    def kill(self) -> None:
        """Kill the process now."""
        if self.alive:
            self._solver.kill()
        self._solver.join()
        self._reader.join()  # it ends because its connection is closed
        self._commands.cancel_join_thread()
        self._commands.close()
        self._reports.close()


def run(commands: Any, reports: Connection, frames: Any, details: Any, reading: Connection) -> None:
    """Main function of the process: commands in by a queue, reports out, frames and details by shared memory.

    ``reading`` is the connection to the process that reads angles. Reports do not use a queue, because its thread would
    wait for the interpreter while the solver computes.
    """
    # Ctrl-C in a terminal reaches the whole group; the parent decides when this process ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The page, and a browser beside it that draws without a graphics card, go first; otherwise the view lags behind.
    give_way(LIVE)
    try:
        _work(commands, reports, frames, details, reading)
    except BrokenPipeError:
        return  # nobody listens any longer
    except Exception as error:  # whatever it is, the user has to be told
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
    """Commands that have arrived; waits for one while there is nothing else to do."""
    wait = None if pour is None else pour.seconds_to_wait()
    found: list[Command] = []
    try:
        # Even the shortest wait yields the processor; a pour that is behind the clock has no time for that.
        found.append(commands.get(block=wait != 0.0, timeout=IDLE_WAIT if wait is None else wait))
        while True:
            found.append(commands.get_nowait())
    except queue.Empty:
        return found


def _parent_lives() -> bool:
    parent = multiprocessing.parent_process()
    return parent is None or parent.is_alive()
