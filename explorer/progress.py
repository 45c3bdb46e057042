"""Progress of a study: one line per event for a person, one JSON object per event for the page.

``progress.jsonl``: {"time", "stage", "done", "planned", "eta_s", "line"}; done and planned count runs of the whole
study, ``line`` is what a stage found, once it has ended.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

from doe.runner import Run

EVERY = 2.0
"""Seconds between two lines of progress where there is no terminal."""


class Progress:
    """Counts runs, estimates the time left from the rate of finished runs, and tells both readers."""

    def __init__(self, file: Path, planned: dict[str, int], say: Callable[[str], None], terminal: bool) -> None:
        self._file, self._planned, self._say, self._terminal = file, dict(planned), say, terminal
        self._done = dict.fromkeys(planned, 0)
        self._started = time.perf_counter()
        self._said = 0.0
        self._fresh = 0
        self._fresh_since: float | None = None

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._started

    def compiling(self) -> None:
        """The study has begun; the first run shows itself only after the solver is compiled."""
        self._tell("compiling the solver", None)

    def run(self, stage: str, run: Run, remaining: int) -> None:
        """A run has ended; ``remaining`` replicates of its stage are still to come."""
        self._done[stage] = self._done.get(stage, 0) + 1
        self._planned[stage] = self._done[stage] + remaining
        if not run.reused:
            if self._fresh_since is None:
                self._fresh_since = time.perf_counter() - run.wall_s
            self._fresh += 1
        self._tell(stage, None)

    def stage(self, stage: str, line: str) -> None:
        """A stage has ended with this finding."""
        self._tell(stage, line)

    def eta_s(self) -> float | None:
        """Seconds left at the rate so far; None before the first run that was really made."""
        if self._fresh_since is None or not self._fresh:
            return None
        rate = self._fresh / max(1e-9, time.perf_counter() - self._fresh_since)
        return (sum(self._planned.values()) - sum(self._done.values())) / rate

    def _tell(self, stage: str, line: str | None) -> None:
        done, planned, eta = sum(self._done.values()), sum(self._planned.values()), self.eta_s()
        event = {"time": self.elapsed, "stage": stage, "done": done, "planned": planned, "eta_s": eta, "line": line}
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(event, ensure_ascii=False) + "\n")
        left = "" if eta is None else f", about {eta / 60:.0f} min left" if eta > 90 else f", about {eta:.0f} s left"
        if line is not None:
            self._say(("\r\033[K" if self._terminal else "") + f"[{self.elapsed:6.0f} s] {stage}: {line}")
        elif self._terminal:
            print(f"\r\033[K{stage}: {done} of {planned} runs{left}", end="", flush=True)
        elif time.perf_counter() - self._said > EVERY * 10:
            self._said = time.perf_counter()
            self._say(f"[{self.elapsed:6.0f} s] {stage}: {done} of {planned} runs{left}")
