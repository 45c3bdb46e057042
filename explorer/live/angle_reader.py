"""The angle of repose of a pour that still moves: when to read it, and what it read last."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from solver.observables.outline import Outline
from solver.observables.pile import angle_of_repose, angle_of_repose_left, angle_of_repose_right
from solver.observables.reading import PileReading
from solver.observables.value import Value
from solver.record import Pile

LEAST_SHARE_BELOW = 0.25
"""Share of the poured mass that has to lie below the outlet: the first few bodies are no pile that has an angle."""
SIMULATED_INTERVAL, WALL_INTERVAL = 0.1, 0.5
"""The angle is read anew after this long of simulated or of wall time [s], whichever comes first."""
WALL_SHARE = 0.15
"""Largest share of the wall time that reading may take; a big pile is read less often."""

ANGLES: Mapping[str, Callable[[PileReading], Value]] = {
    "angle_of_repose_deg": angle_of_repose,
    "angle_of_repose_left_deg": angle_of_repose_left,
    "angle_of_repose_right_deg": angle_of_repose_right,
}


class AngleReader:
    """Reads the angles of one pour. Times in seconds; ``wall`` is the present moment on the caller's clock."""

    def __init__(self) -> None:
        self.observables: Mapping[str, Value] = {}
        """The angles that were read last, by name; empty before there was a pile."""
        self.outline: Outline | None = None
        """The view that the left and the right angle were read from, with the lines of its flanks."""
        self._read_at = -math.inf
        self._wall_due = self._wall_earliest = -math.inf

    def due(self, time: float, wall: float) -> bool:
        """Whether the angle of simulated ``time`` should be read now."""
        moved_on = time >= self._read_at + SIMULATED_INTERVAL or wall >= self._wall_due
        return time > self._read_at and moved_on and wall >= self._wall_earliest

    def read(self, pile: Pile, share_below: float, time: float, clock: Callable[[], float]) -> None:
        """Read ``pile``, if ``share_below`` (0 … 1, mass below the outlet per poured mass) makes it one."""
        before = clock()
        if share_below >= LEAST_SHARE_BELOW:
            reading = PileReading(pile)
            self.observables = {name: angle(reading) for name, angle in ANGLES.items()}
            self.outline = reading.front if reading.is_pile else None
        now = clock()
        self._read_at, self._wall_due = time, now + WALL_INTERVAL
        self._wall_earliest = now + (now - before) / WALL_SHARE
