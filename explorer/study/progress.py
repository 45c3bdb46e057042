"""Progress of a study, counted in runs of all its stages, and the time that is left."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from doe.runs import Run
from explorer.background.progress import ProgressEvent, ProgressWriter, TriedRun


class Progress:
    """Counts runs and estimates the time left from the rate of finished runs."""

    def __init__(
        self,
        file: Path,
        planned: dict[str, int],
        say: Callable[[str], None],
        terminal: bool,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._writer, self._planned, self._clock = ProgressWriter(file, say, terminal, clock), dict(planned), clock
        self._done = dict.fromkeys(planned, 0)
        self._fresh, self._working = 0, 0.0
        self._last: float | None = None

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return self._writer.elapsed

    def compiling(self) -> None:
        """The study has begun; the first run shows itself only after the solver is compiled."""
        self._tell("compiling the solver", None)

    def run(self, stage: str, run: Run, remaining: int) -> None:
        """A run has ended; ``remaining`` replicates of its stage are still to come."""
        self._done[stage] = self._done.get(stage, 0) + 1
        self._planned[stage] = self._done[stage] + remaining
        if not run.reused:
            now = self._clock()
            self._working += run.wall_s if self._last is None else now - self._last
            self._last = now
            self._fresh += 1
        self._tell(stage, None, TriedRun.of(stage, run))

    def went_on(self) -> None:
        """The study was paused and goes on: the time since the last run says nothing about the rate."""
        if self._last is not None:
            self._last = self._clock()

    def stage(self, stage: str, line: str) -> None:
        """A stage has ended with this finding."""
        self._tell(stage, line)

    def eta_s(self) -> float | None:
        """Seconds left at the rate so far; None before the first run that was really made."""
        if not self._fresh:
            return None
        rate = self._fresh / max(1e-9, self._working)
        return (sum(self._planned.values()) - sum(self._done.values())) / rate

    def _tell(self, stage: str, line: str | None, run: TriedRun | None = None) -> None:
        done, planned, eta = sum(self._done.values()), sum(self._planned.values()), self.eta_s()
        event = ProgressEvent(
            time=self.elapsed,
            stage=stage,
            done=done,
            planned=planned,
            eta_s=eta,
            line=line,
            stages={name: (self._done.get(name, 0), count) for name, count in self._planned.items()},
            run=run,
        )
        left = "" if eta is None else f", about {eta / 60:.0f} min left" if eta > 90 else f", about {eta:.0f} s left"
        self._writer.tell(event, f"{stage}: {done} of {planned} runs{left}", line and f"{stage}: {line}")


@contextmanager
def told_of_pauses(went_on: Callable[[], None]) -> Iterator[None]:
    """Call ``went_on`` whenever this process goes on after a pause (SIGCONT); main thread only."""
    before = signal.signal(signal.SIGCONT, lambda number, frame: went_on())
    try:
        yield
    finally:
        signal.signal(signal.SIGCONT, before)
