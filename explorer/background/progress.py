"""How far a command in the background is: what it writes into ``progress.jsonl``, and what is made of it.

One :class:`ProgressEvent` per line. The command tells a person at the same time, on its standard output.
"""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from doe.record import Record

if TYPE_CHECKING:
    from doe.declared.pours import Ended
    from doe.run_records import Run

PROGRESS = "progress.jsonl"
"""In the output folder of the command."""
MOST_TRIED = 2000
"""Failed runs and their replacements that are remembered."""
FIRST = "beginning"
"""Stage of what is told before the first run."""
EVERY = 20.0
"""Seconds between two lines of progress where there is no terminal."""


@dataclass(frozen=True)
class TriedRun(Record):
    """A run, or a pour of a diagnosis, that has ended."""

    stage: str
    label: str
    replicate: int
    attempt: int
    seed: int
    outcome: str
    message: str
    valid: bool

    @staticmethod
    def of(stage: str, run: Run | Ended) -> TriedRun:
        """What is told of a run."""
        return TriedRun(
            stage, run.title, run.replicate, run.attempt, run.seed, str(run.outcome), run.message, run.valid
        )


@dataclass(frozen=True, kw_only=True)
class ProgressEvent(Record):
    """Something that happened; ``line`` is what a stage found, once it has ended, ``run`` the run that ended.

    ``done`` and ``planned`` count runs of the whole command, and ``stages`` maps each stage to its own; None: they
    are those of ``stage``.
    """

    time: float = 0.0
    """Seconds since the start."""
    stage: str
    done: int
    planned: int
    eta_s: float | None = None
    """Seconds left; None: not known."""
    line: str | None = None
    stages: dict[str, tuple[int, int]] | None = None
    run: TriedRun | None = None


class ProgressWriter:
    """Tells both readers: events go into a file for the page, lines to a person.

    Args:
        file: a line per event is added to it.
        say: takes a line for a person.
        terminal: whether there is one, for a bar.
        clock: seconds.
    """

    def __init__(
        self, file: Path, say: Callable[[str], None], terminal: bool, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._file, self._say, self._clock = file, say, clock
        self._started, self._said = clock(), 0.0
        self._bar = Bar() if terminal else None

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return self._clock() - self._started

    def tell(self, event: ProgressEvent, state: str, finding: str | None) -> None:
        """Tell ``event``; in words: ``finding`` where there is one, else ``state``, which is not said each time."""
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(event.to_dict(), ensure_ascii=False) + "\n")
        if self._bar is not None:
            self._bar.show(state, event.done, event.planned)
        if finding is not None:
            self._say(f"[{self.elapsed:6.0f} s] {finding}")
        elif self._bar is None and self.elapsed - self._said > EVERY:
            self._said = self.elapsed
            self._say(f"[{self.elapsed:6.0f} s] {state}")

    def close(self) -> None:
        """Take the bar of a terminal away."""
        if self._bar is not None:
            self._bar.close()


class Bar:
    """A bar in the last line of a terminal, or below a notebook's cell; what is printed meanwhile stands above it."""

    def __init__(self) -> None:
        # Imported where it is used: the page reads progress, and has no terminal.
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        console = Console()
        shown = console.is_terminal or console.is_jupyter
        columns = TextColumn("{task.description}"), BarColumn()
        self._progress = Progress(*columns, console=console, transient=True, disable=not shown)
        self._task = self._progress.add_task("", total=None)

    def show(self, state: str, done: int, planned: int) -> None:
        """``done`` of ``planned``; as long as nothing is planned the bar only moves."""
        self._progress.start()
        self._progress.update(self._task, description=state, completed=done, total=planned or None)

    def close(self) -> None:
        """Take it away."""
        self._progress.stop()


class RunProgress:
    """Progress of a study: counts the runs of all its stages, and estimates the time left from their rate."""

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

    def close(self) -> None:
        """It is over, however it ended."""
        self._writer.close()

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


class PourProgress:
    """Progress of a diagnosis: which part of its loop runs, and how many pours that still needs."""

    def __init__(self, file: Path, say: Callable[[str], None], terminal: bool) -> None:
        self._writer = ProgressWriter(file, say, terminal)
        self._done, self._part, self._part_began = 0, "", 0.0

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return self._writer.elapsed

    def close(self) -> None:
        """It is over, however it ended."""
        self._writer.close()

    def compiling(self) -> None:
        """The diagnosis has begun; the first pour shows itself only after the solver is compiled."""
        self._tell("compiling the solver", 0, None, None)

    def pour(self, part: str, left: int, ended: Ended) -> None:
        """A pour of ``part`` has ended so; ``left`` are still to come."""
        if part != self._part:
            self._part, self._part_began, self._done = part, self.elapsed, 0
        self._done += 1
        eta = left * (self.elapsed - self._part_began) / self._done if self._done > 1 else None
        self._tell(part, left, eta, None, None if ended.valid else TriedRun.of(part, ended))

    def stage(self, line: str) -> None:
        """A part has ended with this finding."""
        self._tell(self._part, 0, None, line)

    def _tell(self, part: str, left: int, eta: float | None, line: str | None, run: TriedRun | None = None) -> None:
        event = ProgressEvent(
            time=self.elapsed,
            stage=part,
            done=self._done,
            planned=self._done + left,
            eta_s=eta,
            line=line,
            run=run,
        )
        about = "" if eta is None else f", about {eta:.0f} s"
        self._writer.tell(event, f"{part}: {left} pours left{about}", line)


@contextmanager
def told_of_pauses(went_on: Callable[[], None]) -> Iterator[None]:
    """Call ``went_on`` whenever this process goes on after a pause (SIGCONT); main thread only."""
    before = signal.signal(signal.SIGCONT, lambda number, frame: went_on())
    try:
        yield
    finally:
        signal.signal(signal.SIGCONT, before)


@dataclass(frozen=True)
class StageProgress:
    """Runs of one stage, and what it found, if it has said so."""

    name: str
    done: int = 0
    planned: int = 0
    finding: str | None = None


@dataclass(frozen=True)
class FailedRun:
    """A run without a pile and what became of its replicate: ``replaced_by`` is the next seed tried, if any."""

    run: TriedRun
    replaced_by: TriedRun | None


def with_event(stages: tuple[StageProgress, ...], event: ProgressEvent) -> tuple[StageProgress, ...]:
    """``stages`` after one event."""
    stage, counts = event.stage or FIRST, event.stages
    known = {one.name: one for one in stages}
    if counts is None:  # a command that counts the runs of its present stage only
        told = event.planned > 0 or event.line is not None or stage in known
        counts = {stage: (event.done, event.planned)} if told else {}
    for name, (done, planned) in counts.items():
        known[name] = replace(known.get(name, StageProgress(name)), done=done, planned=planned)
    if event.line is not None and stage in known:
        said = known[stage].finding
        known[stage] = replace(known[stage], finding=event.line if said is None else f"{said}; {event.line}")
    return tuple(known.values())


def with_run(tried: tuple[TriedRun, ...], event: ProgressEvent) -> tuple[TriedRun, ...]:
    """``tried``, runs that failed or replaced one that did, after one event."""
    run = event.run
    if run is None or (run.valid and run.attempt == 0):
        return tried
    return (*tried, run)[-MOST_TRIED:]


def failures(tried: tuple[TriedRun, ...]) -> tuple[FailedRun, ...]:
    """Every failed run with the one that took its place, newest first."""
    by_place = {(run.stage, run.label, run.replicate, run.attempt): run for run in tried}
    return tuple(
        FailedRun(run, by_place.get((run.stage, run.label, run.replicate, run.attempt + 1)))
        for run in reversed(tried)
        if not run.valid
    )


def given_up(tried: tuple[TriedRun, ...], tries: int) -> tuple[TriedRun, ...]:
    """Replicates that are left without a valid run after ``tries`` seeds: the last run of each."""
    return tuple(run for run in tried if not run.valid and run.attempt + 1 >= tries)
