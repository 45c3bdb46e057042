"""How many steps to launch, and when to wait: short launches, and simulated time that does not outrun the clock."""

from __future__ import annotations

import math
from collections import deque

LAUNCH_WALL = 6e-3
"""Wall time [s] aimed at for one launch of steps: less than a frame, so that a slider acts at the next frame. Each
launch costs some tenths of a millisecond of its own."""
FRAME_WALL = 1.0 / 60.0
"""A launch never covers more simulated time than this times the speed: motion on the screen stays smooth."""
FIRST_STEPS = 20
"""Steps of a launch while their cost is unknown."""
MEMORY = 0.7
"""Weight of the past in the running mean of the cost of a step."""
FORGET_DEBT = 0.1
"""A pour that is further behind the clock than this [s] does not try to catch up."""
CAPPED = 0.9
"""A pour that stays below this share of the wanted speed counts as unable to keep it."""
CAPPED_WINDOW = 0.5
"""Wall time [s] before which a pour is not called capped."""
WINDOW = 1.0
"""Wall time [s] over which the real-time factor is measured."""


class Throttle:
    """Keeps a pour at up to ``speed`` seconds of simulated time per second. Times are in seconds throughout."""

    def __init__(self, speed: float) -> None:
        self.speed = speed
        self._cost = math.nan
        self._start_wall = self._start_time = 0.0
        self._history: deque[tuple[float, float]] = deque()

    def restart(self, wall: float, time: float) -> None:
        """Count from here: after a pause, a change of speed, a new pour."""
        self._start_wall, self._start_time = wall, time
        self._history.clear()
        self._history.append((wall, time))

    def steps(self, dt: float) -> int:
        """Steps of size ``dt`` in the next launch, at least one."""
        affordable = FIRST_STEPS if math.isnan(self._cost) else LAUNCH_WALL / self._cost
        smooth = max(1.0, self.speed * FRAME_WALL / dt)
        return max(1, int(min(affordable, smooth)))

    def launched(self, steps: int, took: float, wall: float, time: float) -> None:
        """Note that ``steps`` took ``took``; it is now ``wall`` on the clock and ``time`` in the simulation."""
        cost = took / steps
        self._cost = cost if math.isnan(self._cost) else MEMORY * self._cost + (1.0 - MEMORY) * cost
        self._history.append((wall, time))
        while len(self._history) > 2 and self._history[1][0] <= wall - WINDOW:
            self._history.popleft()
        if self.wait(wall, time) < -FORGET_DEBT:
            self._start_wall, self._start_time = wall, time

    def wait(self, wall: float, time: float) -> float:
        """Seconds until simulated ``time`` is due; negative when the pour is behind."""
        return self._start_wall + (time - self._start_time) / self.speed - wall

    @property
    def capped(self) -> bool:
        """Whether the wanted speed cannot be kept."""
        (wall, _), (last_wall, _) = self._history[0], self._history[-1]
        return last_wall - wall >= CAPPED_WINDOW and self.real_time_factor < CAPPED * self.speed

    @property
    def real_time_factor(self) -> float:
        """Simulated per wall time over the last ``WINDOW``; 0 before anything ran."""
        (wall, time), (last_wall, last_time) = self._history[0], self._history[-1]
        return (last_time - time) / (last_wall - wall) if last_wall > wall else 0.0
