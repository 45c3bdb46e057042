"""How far a long command is: the events that it tells, how it counts its runs for them, and what is made of them.

`explorer.background.reporter` carries them: to ``progress.jsonl`` for the page, and to standard output for CI.
"""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING, Literal

from doe.record import Record
from solver import TABLE

if TYPE_CHECKING:
    from doe.declared.pours import Ended
    from doe.pour_runner import Pours
    from doe.run_records import Run
    from explorer.background.reporter import Reporter

PROGRESS = "progress.jsonl"
"""In the output folder of the command."""
MOST_TRIED = 2000
"""Failed runs and their replacements that are remembered."""
EventKind = Literal["start", "pour", "stage", "end"]
Ending = Literal["finished", "failed", "interrupted"]
FIRST = "beginning"
"""Stage of what is told before the first run."""


@dataclass(frozen=True)
class TriedRun(Record):
    """A run, or a pour of a diagnosis, that has ended."""

    __pydantic_config__ = TABLE

    stage: str
    label: str
    replicate: int
    attempt: int
    """0 for the first seed of a replicate; each further one replaces a run that was not valid."""
    seed: int
    outcome: str
    """How it ended: at_rest, measured, no_heap, jammed, obstructed, time_limit, lost_body, non_finite, …"""
    message: str
    valid: bool
    """Whether what was read off it counts."""
    wall_s: float = 0.0
    """What it cost [s]."""
    reused: bool = False
    """Whether it was found in the store."""

    @staticmethod
    def of(stage: str, run: Run | Ended) -> TriedRun:
        """What is told of a run."""
        return TriedRun(
            stage,
            run.title,
            run.replicate,
            run.attempt,
            run.seed,
            str(run.outcome),
            run.message,
            run.valid,
            run.wall_s,
            run.reused,
        )


@dataclass(frozen=True, kw_only=True)
class ProgressEvent(Record):
    """One event of a long command: a line of ``--json`` and of ``progress.jsonl``. A key without a value is null."""

    __pydantic_config__ = TABLE

    event: EventKind = "stage"
    """start: the command is at work; pour: one has ended; stage: a stage has found something; end: the command is over,
    always the last line."""
    run_id: str = ""
    """Of this start of the command."""
    command: str = ""
    """calibrate, diagnose, repeat, simulate or validate-diagnosis."""
    at: str = ""
    """Date and time, ISO 8601, UTC."""
    time: float = 0.0
    """Seconds since the start."""
    stage: str
    """The stage that runs; before the first pour "compiling the solver"."""
    done: int
    """Pours that have ended, of the whole command where ``stages`` is there, else of the stage; of validate-diagnosis
    data sets that are judged."""
    planned: int
    """Of how many, as far as is known now."""
    eta_s: float | None = None
    """Seconds left; null: not known."""
    line: str | None = None
    """What the stage found, in words."""
    stages: dict[str, tuple[int, int]] | None = None
    """Stage → pours done and planned."""
    run: TriedRun | None = None
    """The pour that ended."""
    scene: Path | None = None
    """Material file that gives a pour that diverged again, with its seed."""
    outcome: Ending | None = None
    """How the command ended."""
    result: Path | None = None
    """The file with the result, once the command has finished."""
    error: str | None = None
    """Why it failed, in a line."""


class Bar:
    """A bar in the last line of a terminal, or below a notebook's cell; what is printed meanwhile stands above it."""

    def __init__(self, file: IO[str] | None = None) -> None:
        # Imported where it is used: the page reads progress, and has no terminal.
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        console = Console(file=file)
        # On one screen lines go above the bar; what goes into a file or a pipe must not end on the screen.
        one_screen = sys.stdout.isatty()
        shown = console.is_terminal or console.is_jupyter
        columns = TextColumn("{task.description}"), BarColumn()
        # Drawn when there is something new, without a thread of its own: Taichi's kernels are kept at once only where
        # there is one thread (`solver.backend.keep_compiled`).
        self._progress = Progress(
            *columns,
            console=console,
            transient=True,
            disable=not shown,
            redirect_stdout=one_screen,
            auto_refresh=False,
        )
        self._task = self._progress.add_task("", total=None)

    def show(self, state: str, done: float, planned: float) -> None:
        """``done`` of ``planned``; as long as nothing is planned the bar only moves."""
        self._progress.start()
        self._progress.update(self._task, description=state, completed=done, total=planned or None, refresh=True)

    def close(self) -> None:
        """Take it away."""
        self._progress.stop()


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
        """The study has begun; the first run shows itself only after the solver is compiled."""
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
    """Progress of a diagnosis: which part of its loop runs, and how many pours that still needs."""

    def __init__(self, reporter: Reporter) -> None:
        self._reporter = reporter
        self._done, self._part, self._part_began = 0, "", 0.0

    def compiling(self) -> None:
        """The diagnosis has begun; the first pour shows itself only after the solver is compiled."""
        self._tell("compiling the solver", 0, event="start")

    def pour(self, part: str, left: int, ended: Ended) -> None:
        """A pour of ``part`` has ended so; ``left`` are still to come."""
        if part != self._part:
            self._part, self._part_began, self._done = part, self._reporter.elapsed, 0
        self._done += 1
        # From the first pour's end on: what came before it is compilation.
        eta = left * (self._reporter.elapsed - self._part_began) / (self._done - 1) if self._done > 1 else None
        self._tell(part, left, eta, run=TriedRun.of(part, ended), event="pour")

    def stage(self, line: str) -> None:
        """A part has ended with this finding."""
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
    """Progress within one pour, for a person: it lasts ``whole`` [s] of simulated time at most."""

    def __init__(self, reporter: Reporter, whole: float) -> None:
        self._reporter, self._whole = reporter, whole
        self._first: tuple[float, float] | None = None

    def sample(self, time: float) -> None:
        """The pour has come to ``time`` [s]."""
        elapsed = self._reporter.elapsed
        if self._first is None:  # what came before it is compilation
            self._first = time, elapsed
        since, then = self._first
        left = (self._whole - time) * (elapsed - then) / (time - since) if time > since else None
        self._reporter.show(f"{time:.2f} s of at most {self._whole:g} s simulated{time_left(left)}", time, self._whole)


class SetProgress(PourProgress):
    """Progress of a validation campaign: its pours, and its data sets, from which the time left follows."""

    def judged(self, done: int, planned: int, judged_now: int, line: str) -> None:
        """``done`` of ``planned`` data sets are there, ``judged_now`` of them by this run of the command."""
        eta = (planned - done) * self._reporter.elapsed / judged_now
        told = ProgressEvent(stage="data sets", done=done, planned=planned, eta_s=eta, line=line)
        self._reporter.tell(told, "", f"{line}; {done} of {planned} data sets{time_left(eta)}")

    def watched(self, pours: Pours) -> Pours:
        """``pours`` of which those that diverge are told."""
        return self._reporter.watched(pours)


def time_left(eta_s: float | None) -> str:
    """Such as ", about 12 min left"; empty where it is not known."""
    if eta_s is None:
        return ""
    return f", about {eta_s / 60:.0f} min left" if eta_s > 90 else f", about {eta_s:.0f} s left"


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
