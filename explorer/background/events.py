"""The events that a long command reports, and what its readers derive: stages, failed runs, and their replacements.

`explorer.background.progress` makes the events, `explorer.background.reporter` writes them: to ``progress.jsonl`` for
the page, and to standard output for CI.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from doe.record import Record
from solver import TABLE

if TYPE_CHECKING:
    from doe.declared.pour_end import Ended
    from doe.run_records import Run

PROGRESS = "progress.jsonl"
"""File in the output folder of the command."""
MOST_TRIED = 2000
"""Failed runs and replacements that are remembered at most."""
EventKind = Literal["start", "pour", "stage", "end"]
Ending = Literal["finished", "failed", "interrupted"]
FIRST = "beginning"
"""Stage of what is reported before the first run."""


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
        """What is reported about a run."""
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


@dataclass(frozen=True)
class StageProgress:
    """Runs of one stage, and what it found, if reported."""

    name: str
    done: int = 0
    planned: int = 0
    finding: str | None = None


@dataclass(frozen=True)
class FailedRun:
    """A run without a pile, and its replacement: ``replaced_by`` is the run with the next seed tried, if any."""

    run: TriedRun
    replaced_by: TriedRun | None


def with_event(stages: tuple[StageProgress, ...], event: ProgressEvent) -> tuple[StageProgress, ...]:
    """``stages`` after one event."""
    stage, counts = event.stage or FIRST, event.stages
    known = {one.name: one for one in stages}
    if counts is None:  # a command that counts only the runs of its present stage
        told = event.planned > 0 or event.line is not None or stage in known
        counts = {stage: (event.done, event.planned)} if told else {}
    for name, (done, planned) in counts.items():
        known[name] = replace(known.get(name, StageProgress(name)), done=done, planned=planned)
    if event.line is not None and stage in known:
        said = known[stage].finding
        known[stage] = replace(known[stage], finding=event.line if said is None else f"{said}; {event.line}")
    return tuple(known.values())


def with_run(tried: tuple[TriedRun, ...], event: ProgressEvent) -> tuple[TriedRun, ...]:
    """``tried`` (runs that failed, or replaced one that did) after one event."""
    run = event.run
    if run is None or (run.valid and run.attempt == 0):
        return tried
    return (*tried, run)[-MOST_TRIED:]


def failures(tried: tuple[TriedRun, ...]) -> tuple[FailedRun, ...]:
    """Every failed run with its replacement, newest first."""
    by_place = {(run.stage, run.label, run.replicate, run.attempt): run for run in tried}
    return tuple(
        FailedRun(run, by_place.get((run.stage, run.label, run.replicate, run.attempt + 1)))
        for run in reversed(tried)
        if not run.valid
    )


def given_up(tried: tuple[TriedRun, ...], tries: int) -> tuple[TriedRun, ...]:
    """Replicates without a valid run after ``tries`` seeds: the last run of each."""
    return tuple(run for run in tried if not run.valid and run.attempt + 1 >= tries)
