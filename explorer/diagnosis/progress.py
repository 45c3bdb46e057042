"""Progress of a diagnosis, counted in the pours that the present part of the loop still needs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from doe.declared.pours import Ended
from explorer.background.progress import ProgressEvent, ProgressWriter, TriedRun


class PourProgress:
    """Tells which part of the loop runs, how many pours it still needs, and what a part has found."""

    def __init__(self, file: Path, say: Callable[[str], None], terminal: bool) -> None:
        self._writer = ProgressWriter(file, say, terminal)
        self._done, self._part, self._part_began = 0, "", 0.0

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return self._writer.elapsed

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
