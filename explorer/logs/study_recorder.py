"""Recordings of a study: the verification pours, one file per seed."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from explorer.logs.pour_recorder import PourRecorder, recorder_of
from solver import Record

if TYPE_CHECKING:
    from solver.pours.pour import Pour

RECORDED_STAGE = "verification"


class StudyRecorder:
    """Observer of a study's pours that records those of the verification into ``folder``."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self._stack = ExitStack()
        self._recorders: dict[int, PourRecorder] = {}

    def sample(self, stage: str, seed: int, pour: Pour) -> None:
        """Log the present state of a pour."""
        if stage != RECORDED_STAGE:
            return
        if seed not in self._recorders:
            path = self._folder / f"{RECORDED_STAGE}_{seed}.rrd"
            self._recorders[seed] = self._stack.enter_context(recorder_of(path, [seed]))
        self._recorders[seed].sample(0, pour)

    def finish(self, stage: str, seed: int, record: Record) -> None:
        """Log the outcome of a pour and close its file."""
        if stage == RECORDED_STAGE:
            self._recorders[seed].finish(0, record)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()
