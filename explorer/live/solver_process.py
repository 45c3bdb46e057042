"""The solver process from outside: its start, its end, and the lines to it. No viser, no Taichi."""

from __future__ import annotations

import multiprocessing

from explorer.live.angle_reader import run as read_angles
from explorer.live.details import detail_reader, shared_details
from explorer.live.frames import FrameReader, shared_block
from explorer.live.messages import Close, Command, Report
from explorer.live.process import run
from solver.pours.worker_pool import deaf_to_interrupts

CLOSE_WAIT = 3.0
"""Seconds that it has to end by itself."""


class SolverProcess:
    """A solver process, started at once, and beside it the one that reads angles for it.

    frames, details: what it shows, by shared memory; readable also after its end.
    """

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        # A queue and lines of its own: a process that is killed may leave its queue locked.
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
        # With these gone every line has one process at either end, which hears when the other one ends.
        for end in (asking, answering, reporting):
            end.close()

    @property
    def alive(self) -> bool:
        """Whether it runs."""
        return self._solver.is_alive()

    @property
    def process_id(self) -> int | None:
        """Its number in the system."""
        return self._solver.pid

    @property
    def exit_code(self) -> int | None:
        """How it ended; None while it runs."""
        return self._solver.exitcode

    def send(self, *commands: Command) -> None:
        """Put ``commands`` into its queue, in order."""
        for command in commands:
            self._commands.put(command)

    def heard(self) -> list[Report]:
        """What it has reported since the last call."""
        reports: list[Report] = []
        try:
            while self._reports.poll():
                reports.append(self._reports.recv())
        except (EOFError, OSError):
            pass  # its end of the line is gone
        return reports

    def close(self) -> None:
        """Ask it to end, and end it if it does not."""
        if self.alive:
            self.send(Close())
            self._solver.join(CLOSE_WAIT)
        self.kill()

    def kill(self) -> None:
        """End it now."""
        if self.alive:
            self._solver.kill()
        self._solver.join()
        self._reader.join()  # its line is cut
        self._commands.cancel_join_thread()
        self._commands.close()
        self._reports.close()
