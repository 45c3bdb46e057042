"""Progress of a study: one line per event for a person, one JSON object per event for the page.

``progress.jsonl``: {"time", "stage", "done", "planned", "eta_s", "line", "stages", "run"}; done and planned count runs
of the whole study, ``line`` is what a stage found, once it has ended, ``stages`` maps every stage to its [done,
planned], and ``run`` is the run that ended (`told_run`), null for any other event.
"""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from doe.declared.pours import Ended
from doe.runs import Run

EVERY = 2.0
"""Seconds between two lines of progress where there is no terminal."""


class Progress:
    """Counts runs, estimates the time left from the rate of finished runs, and tells both readers."""

    def __init__(
        self,
        file: Path,
        planned: dict[str, int],
        say: Callable[[str], None],
        terminal: bool,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._file, self._planned, self._say, self._terminal = file, dict(planned), say, terminal
        self._clock = clock
        self._done = dict.fromkeys(planned, 0)
        self._started = clock()
        self._said = 0.0
        self._fresh, self._working = 0, 0.0
        self._last: float | None = None

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return self._clock() - self._started

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
        self._tell(stage, None, told_run(run))

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

    def _tell(self, stage: str, line: str | None, run: dict[str, Any] | None = None) -> None:
        done, planned, eta = sum(self._done.values()), sum(self._planned.values()), self.eta_s()
        event: dict[str, Any] = {"time": self.elapsed, "stage": stage, "done": done, "planned": planned, "eta_s": eta}
        stages = {name: [self._done.get(name, 0), count] for name, count in self._planned.items()}
        event |= {"line": line, "stages": stages, "run": run}
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(event, ensure_ascii=False) + "\n")
        left = "" if eta is None else f", about {eta / 60:.0f} min left" if eta > 90 else f", about {eta:.0f} s left"
        if line is not None:
            self._say(("\r\033[K" if self._terminal else "") + f"[{self.elapsed:6.0f} s] {stage}: {line}")
        elif self._terminal:
            print(f"\r\033[K{stage}: {done} of {planned} runs{left}", end="", flush=True)
        elif self._clock() - self._said > EVERY * 10:
            self._said = self._clock()
            self._say(f"[{self.elapsed:6.0f} s] {stage}: {done} of {planned} runs{left}")


def told_run(run: Run | Ended) -> dict[str, Any]:
    """What the page is told of a run, or of a pour of a diagnosis, that has ended."""
    return {
        "label": run.label,
        "replicate": run.replicate,
        "attempt": run.attempt,
        "seed": run.seed,
        "outcome": run.outcome,
        "message": run.message,
        "valid": run.valid,
    }


@contextmanager
def told_of_pauses(went_on: Callable[[], None]) -> Iterator[None]:
    """Call ``went_on`` whenever this process goes on after a pause (SIGCONT); main thread only."""
    before = signal.signal(signal.SIGCONT, lambda number, frame: went_on())
    try:
        yield
    finally:
        signal.signal(signal.SIGCONT, before)
