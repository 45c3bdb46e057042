"""Progress of a diagnosis: the same two readers as that of a study (`explorer.study.progress`), counted in pours."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from doe.declared.pours import Ended
from explorer.study.progress import told_run

EVERY = 20.0
"""Seconds between two lines of progress where there is no terminal."""


class PourProgress:
    """Tells which part of the loop runs, how many pours it still needs, and what a part has found."""

    def __init__(self, file: Path, say: Callable[[str], None], terminal: bool) -> None:
        self._file, self._say, self._terminal = file, say, terminal
        self._started = time.perf_counter()
        self._said, self._done, self._part, self._part_began = 0.0, 0, "", 0.0

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._started

    def compiling(self) -> None:
        """The diagnosis has begun; the first pour shows itself only after the solver is compiled."""
        self._tell("compiling the solver", 0, None, None)

    def pour(self, part: str, left: int, ended: Ended) -> None:
        """A pour of ``part`` has ended so; ``left`` are still to come."""
        if part != self._part:
            self._part, self._part_began, self._done = part, self.elapsed, 0
        self._done += 1
        eta = left * (self.elapsed - self._part_began) / self._done if self._done > 1 else None
        self._tell(part, left, eta, None, ended)

    def stage(self, line: str) -> None:
        """A part has ended with this finding."""
        self._tell(self._part, 0, None, line)

    def _tell(self, part: str, left: int, eta: float | None, line: str | None, ended: Ended | None = None) -> None:
        event: dict[str, Any] = {
            "time": self.elapsed,
            "stage": part,
            "done": self._done,
            "planned": self._done + left,
            "eta_s": eta,
            "line": line,
        }
        if ended is not None and not ended.valid:
            event["run"] = told_run(ended)
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(event, ensure_ascii=False) + "\n")
        about = "" if eta is None else f", about {eta:.0f} s"
        if line is not None:
            self._say(("\r\033[K" if self._terminal else "") + f"[{self.elapsed:6.0f} s] {line}")
        elif self._terminal:
            print(f"\r\033[K{part}: {left} pours left{about}", end="", flush=True)
        elif self.elapsed - self._said > EVERY:
            self._said = self.elapsed
            self._say(f"[{self.elapsed:6.0f} s] {part}: {left} pours left{about}")
