"""How a long command counts its runs for the events that it reports, and estimates the time left."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from explorer.background.events import EventKind, ProgressEvent, TriedRun

if TYPE_CHECKING:
    from doe.declared.pour_end import Ended
    from doe.pour_runner import Pours
    from doe.run_records import Run
    from explorer.background.reporter import Reporter


class RunProgress:
    """Progress of a study: counts the runs of all its stages, and estimates the time left from their rate."""

    def __init__(
        self, reporter: Reporter, planned: dict[str, int], clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._reporter, self._planned, self._clock = reporter, dict(planned), clock
        self._done = dict.fromkeys(planned, 0)
        self._fresh, self._working = 0, 0.0
        self._last: float | None = None

    def compiling(self) -> None:
        """The study has begun; its first run is reported only after the solver has been compiled."""
        self._tell("compiling the solver", event="start")

    def run(self, stage: str, run: Run, remaining: int) -> None:
        """A run has ended; ``remaining`` replicates of its stage are still to come."""
        self._done[stage] = self._done.get(stage, 0) + 1
        self._planned[stage] = self._done[stage] + remaining
        if not run.reused:
            now = self._clock()
            self._working += run.wall_s if self._last is None else now - self._last
            self._last = now
            self._fresh += 1
        self._tell(stage, run=TriedRun.of(stage, run), event="pour")

    def went_on(self) -> None:
        """The study was paused and continues: the time since the last run does not count for the rate."""
        if self._last is not None:
            self._last = self._clock()

    def stage(self, stage: str, line: str) -> None:
        """``stage`` has ended with the finding ``line``."""
        self._tell(stage, line)

    def eta_s(self) -> float | None:
        """Seconds left at the rate so far; None before the first run that was not reused."""
        if not self._fresh:
            return None
        rate = self._fresh / max(1e-9, self._working)
        return (sum(self._planned.values()) - sum(self._done.values())) / rate

    def _tell(
        self, stage: str, line: str | None = None, run: TriedRun | None = None, event: EventKind = "stage"
    ) -> None:
        done, planned, eta = sum(self._done.values()), sum(self._planned.values()), self.eta_s()
        told = ProgressEvent(
            event=event,
            stage=stage,
            done=done,
            planned=planned,
            eta_s=eta,
            line=line,
            stages={name: (self._done.get(name, 0), count) for name, count in self._planned.items()},
            run=run,
        )
        state = f"{stage}: {done} of {planned} runs{time_left(eta)}"
        self._reporter.tell(told, state, line and f"{stage}: {line}")


class PourProgress:
    """Progress of a diagnosis: which part of its loop is running, and how many pours that part still needs."""

    def __init__(self, reporter: Reporter) -> None:
        self._reporter = reporter
        self._done, self._part, self._part_began = 0, "", 0.0

    def compiling(self) -> None:
        """The diagnosis has begun; its first pour is reported only after the solver has been compiled."""
        self._tell("compiling the solver", 0, event="start")

    def pour(self, part: str, left: int, ended: Ended) -> None:
        """A pour of ``part`` has ended as ``ended`` says; ``left`` are still to come."""
        if part != self._part:
            self._part, self._part_began, self._done = part, self._reporter.elapsed, 0
        self._done += 1
        # Timed from the end of the first pour: the time before is compilation.
        eta = left * (self._reporter.elapsed - self._part_began) / (self._done - 1) if self._done > 1 else None
        self._tell(part, left, eta, run=TriedRun.of(part, ended), event="pour")

    def stage(self, line: str) -> None:
        """A part has ended with the finding ``line``."""
        self._tell(self._part, 0, line=line)

    def _tell(
        self,
        part: str,
        left: int,
        eta: float | None = None,
        line: str | None = None,
        run: TriedRun | None = None,
        event: EventKind = "stage",
    ) -> None:
        told = ProgressEvent(
            event=event,
            stage=part,
            done=self._done,
            planned=self._done + left,
            eta_s=eta,
            line=line,
            run=run,
        )
        self._reporter.tell(told, f"{part}: {left} pours left{time_left(eta)}", line)


class SimulatedTime:
    """Progress within one pour, for the user; the pour lasts at most ``whole`` [s] of simulated time."""

    def __init__(self, reporter: Reporter, whole: float) -> None:
        self._reporter, self._whole = reporter, whole
        self._first: tuple[float, float] | None = None

    def sample(self, time: float) -> None:
        """The pour has reached ``time`` [s]."""
        elapsed = self._reporter.elapsed
        if self._first is None:  # the time before is compilation
            self._first = time, elapsed
        since, then = self._first
        left = (self._whole - time) * (elapsed - then) / (time - since) if time > since else None
        self._reporter.show(f"{time:.2f} s of at most {self._whole:g} s simulated{time_left(left)}", time, self._whole)


class SetProgress(PourProgress):
    """Progress of a validation campaign: its pours, and its data sets, from which the time left follows."""

    def judged(self, done: int, planned: int, judged_now: int, line: str) -> None:
        """``done`` of ``planned`` data sets are judged, ``judged_now`` of them by this run of the command."""
        eta = (planned - done) * self._reporter.elapsed / judged_now
        told = ProgressEvent(stage="data sets", done=done, planned=planned, eta_s=eta, line=line)
        self._reporter.tell(told, "", f"{line}; {done} of {planned} data sets{time_left(eta)}")

    def watched(self, pours: Pours) -> Pours:
        """``pours``, with those that diverge reported."""
        return self._reporter.watched(pours)


def time_left(eta_s: float | None) -> str:
    """Text such as ", about 12 min left"; empty if the time is not known."""
    if eta_s is None:
        return ""
    return f", about {eta_s / 60:.0f} min left" if eta_s > 90 else f", about {eta_s:.0f} s left"


@contextmanager
def told_of_pauses(went_on: Callable[[], None]) -> Iterator[None]:
    """Call ``went_on`` whenever this process continues after a pause (SIGCONT); no effect outside its main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGCONT, lambda number, frame: went_on())
    try:
        yield
    finally:
        signal.signal(signal.SIGCONT, before)
