"""How far a command in the background is: what it writes into ``progress.jsonl``, and what is made of it.

One :class:`ProgressEvent` per line. The command tells a person at the same time, on its standard output.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from doe.record import Record

if TYPE_CHECKING:
    from doe.declared.pours import Ended
    from doe.runs import Run

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
            stage, run.label, run.replicate, run.attempt, run.seed, str(run.outcome), run.message, run.valid
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
        terminal: whether a line may be written over.
        clock: seconds.
    """

    def __init__(
        self, file: Path, say: Callable[[str], None], terminal: bool, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        self._file, self._say, self._terminal, self._clock = file, say, terminal, clock
        self._started, self._said = clock(), 0.0

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return self._clock() - self._started

    def tell(self, event: ProgressEvent, state: str, finding: str | None) -> None:
        """Tell ``event``; in words: ``finding`` where there is one, else ``state``, which is not said each time."""
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(event.to_dict(), ensure_ascii=False) + "\n")
        if finding is not None:
            self._say(("\r\033[K" if self._terminal else "") + f"[{self.elapsed:6.0f} s] {finding}")
        elif self._terminal:
            print(f"\r\033[K{state}", end="", flush=True)
        elif self.elapsed - self._said > EVERY:
            self._said = self.elapsed
            self._say(f"[{self.elapsed:6.0f} s] {state}")


@dataclass(frozen=True)
class StageProgress:
    """Runs of one stage, and what it found, if it has said so."""

    name: str
    done: int = 0
    planned: int = 0
    finding: str | None = None


@dataclass(frozen=True)
class Failure:
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


def failures(tried: tuple[TriedRun, ...]) -> tuple[Failure, ...]:
    """Every failed run with the one that took its place, newest first."""
    by_place = {(run.stage, run.label, run.replicate, run.attempt): run for run in tried}
    return tuple(
        Failure(run, by_place.get((run.stage, run.label, run.replicate, run.attempt + 1)))
        for run in reversed(tried)
        if not run.valid
    )


def given_up(tried: tuple[TriedRun, ...], tries: int) -> tuple[TriedRun, ...]:
    """Replicates that are left without a valid run after ``tries`` seeds: the last run of each."""
    return tuple(run for run in tried if not run.valid and run.attempt + 1 >= tries)
