"""Where a replay stands: it plays at a speed, stops at the end, and steps from frame to frame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


class Timeline:
    """A moment within ``times`` [s], ascending, at least one."""

    def __init__(self, times: npt.NDArray[np.float64]) -> None:
        self.times = times
        self.time = float(times[0])
        self.playing = len(times) > 1
        self.speed = 1.0

    @property
    def first(self) -> float:
        """Time of the first frame [s]."""
        return float(self.times[0])

    @property
    def last(self) -> float:
        """Time of the last frame [s]."""
        return float(self.times[-1])

    def pass_by(self, wall: float) -> None:
        """Go on by ``wall`` seconds of the clock while playing; at the end, stop."""
        if self.playing:
            self.go_to(self.time + self.speed * wall)
            self.playing = self.time < self.last

    def go_to(self, time: float) -> None:
        """Stand at ``time`` [s], or at the end that it is beyond."""
        self.time = min(max(time, self.first), self.last)

    def toggle(self) -> None:
        """Play or pause; at the end, play from the beginning."""
        if not self.playing and self.time >= self.last:
            self.time = self.first
        self.playing = not self.playing

    def step(self, frames: int) -> None:
        """Pause, and go on by so many frames (back if negative)."""
        self.playing = False
        here = int(np.searchsorted(self.times, self.time + 1e-9, side="right")) - 1
        between = self.times[here] < self.time - 1e-9
        target = here + frames + (1 if frames < 0 and between else 0)
        self.time = float(self.times[min(max(target, 0), len(self.times) - 1)])
