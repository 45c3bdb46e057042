"""Keeps a pour's newest checkpoint in a file, so that a run that is cut off can be gone on with. Loads the solver."""

from __future__ import annotations

from pathlib import Path

from explorer.files.output_file import write_whole_bytes
from solver.pours.checkpoint import checkpoint_bytes, checkpoint_of
from solver.pours.pour import Pour


class CheckpointWriter:
    """Writes ``path`` at every ``interval`` [s] of simulated time; the file is always a whole one."""

    def __init__(self, path: Path, interval: float) -> None:
        self._path, self._interval = path, interval
        self._written = 0.0

    def sample(self, _: int, pour: Pour) -> None:
        """To be called at the moments of decision of a pour."""
        if pour.time >= self._written + self._interval:
            self._written = pour.time
            write_whole_bytes(self._path, checkpoint_bytes(checkpoint_of(pour)))
