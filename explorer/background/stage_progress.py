"""How far a command in the background is, stage by stage, and which of its runs gave nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

MOST_TRIED = 2000
"""Failed runs and their replacements that are remembered."""
FIRST = "beginning"
"""Stage of what is told before the first run."""


@dataclass(frozen=True)
class StageProgress:
    """Runs of one stage, and what it found, if it has said so."""

    name: str
    done: int = 0
    planned: int = 0
    finding: str | None = None


@dataclass(frozen=True)
class TriedRun:
    """A run that failed, or that replaced one that did."""

    stage: str
    label: str
    replicate: int
    attempt: int
    seed: int
    outcome: str
    message: str
    valid: bool


@dataclass(frozen=True)
class Failure:
    """A run without a pile and what became of its replicate: ``replaced_by`` is the next seed tried, if any."""

    run: TriedRun
    replaced_by: TriedRun | None


def with_event(stages: tuple[StageProgress, ...], event: Mapping[str, Any]) -> tuple[StageProgress, ...]:
    """``stages`` after one event of ``progress.jsonl``; raises ValueError or TypeError for what is no such event."""
    stage, line, counts = str(event["stage"]) or FIRST, event["line"], event.get("stages")
    known = {one.name: one for one in stages}
    if counts is None:  # a command that counts the runs of its present stage only
        told = int(event["planned"]) > 0 or line is not None or stage in known
        counts = {stage: [event["done"], event["planned"]]} if told else {}
    for name, (done, planned) in dict(counts).items():
        before = known.get(str(name), StageProgress(str(name)))
        known[str(name)] = replace(before, done=int(done), planned=int(planned))
    if line is not None and stage in known:
        said = known[stage].finding
        known[stage] = replace(known[stage], finding=str(line) if said is None else f"{said}; {line}")
    return tuple(known.values())


def with_run(tried: tuple[TriedRun, ...], event: Mapping[str, Any]) -> tuple[TriedRun, ...]:
    """``tried`` after one event; raises ValueError, KeyError or TypeError for what is no such event."""
    run = event.get("run")
    if run is None or (run["valid"] and int(run["attempt"]) == 0):
        return tried
    found = TriedRun(
        str(event["stage"]),
        str(run["label"]),
        int(run["replicate"]),
        int(run["attempt"]),
        int(run["seed"]),
        str(run["outcome"]),
        str(run["message"]),
        bool(run["valid"]),
    )
    return (*tried, found)[-MOST_TRIED:]


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
