"""The angle of repose of a pour that still moves: when to read it, what was read last, and the process that reads it.

A reading takes some 25 ms, for which the pour would stand still: while it runs, another process reads (piles in, angles
out, until the line is cut). What stands still is read here, so that its angle is that of what is seen.
"""

from __future__ import annotations

import math
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from multiprocessing.connection import Connection

from explorer.priority import LIVE, give_way
from solver.observables.observable import Value
from solver.observables.pile import angle_of_repose, angle_of_repose_left, angle_of_repose_right
from solver.observables.reading import PileReading
from solver.observables.repose import Outline
from solver.pours.record import Pile

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


@dataclass(frozen=True)
class PileAngles:
    """The angles of repose read off a pile."""

    observables: Mapping[str, Value] = field(default_factory=dict)
    """The angles by name; empty before there was a pile."""
    outline: Outline | None = None
    """The view that the left and the right angle were read from, with the lines of its flanks."""


def read_angles(pile: Pile) -> PileAngles:
    """What ``pile`` is read as."""
    reading = PileReading(pile)
    return PileAngles(
        {name: angle(reading) for name, angle in ANGLES.items()}, reading.front if reading.is_pile else None
    )


class AngleReader:
    """Reads the angles of one pour after the other. Times are in seconds.

    line: to a process that reads while this one goes on; without it everything is read here.
    clock: the present moment of wall time.
    """

    def __init__(self, line: Connection | None, clock: Callable[[], float]) -> None:
        self._line, self._clock = line, clock
        self._unheard = 0
        self.forget()

    def forget(self, angles: PileAngles | None = None) -> None:
        """Begin anew: another pour, or an earlier moment of this one, of which ``angles`` had been read."""
        self.newest = angles or PileAngles()
        self._forgotten = self._unheard
        self._read_at = self._wall_due = self._wall_earliest = -math.inf

    def due(self, time: float) -> bool:
        """Whether the angle of simulated ``time`` should be read now."""
        wall = self._clock()
        moved_on = time >= self._read_at + SIMULATED_INTERVAL or wall >= self._wall_due
        return time > self._read_at and moved_on and wall >= self._wall_earliest and self._unheard == self._forgotten

    def read(self, pile: Pile, share_below: float, time: float) -> None:
        """Read ``pile``, if ``share_below`` (0 … 1, mass below the outlet per poured mass) makes it one."""
        self._forgotten = self._unheard
        self._begin(time)
        if share_below >= LEAST_SHARE_BELOW:
            self.newest = read_angles(pile)
        self._end()

    def ask(self, pile: Pile, share_below: float, time: float) -> None:
        """Have ``pile`` read at the other end of the line; :meth:`hear` takes the answer."""
        if self._line is None or share_below < LEAST_SHARE_BELOW:
            self.read(pile, share_below, time)
            return
        if self._unheard:  # still at a pile that is forgotten; this one will be due again
            return
        self._begin(time)
        try:
            self._line.send(pile)
            self._unheard += 1
        except OSError:
            self._hang_up()

    def hear(self) -> bool:
        """Take what the other process has read, if it has; True where that is news."""
        if self._line is None or not self._unheard:
            return False
        try:
            if not self._line.poll():
                return False
            answer = self._line.recv()
        except (OSError, EOFError):
            self._hang_up()
            return False
        self._unheard -= 1
        if self._forgotten:
            self._forgotten -= 1
            return False
        self.newest = answer
        self._end()
        return True

    def _begin(self, time: float) -> None:
        self._read_at, self._began = time, self._clock()

    def _end(self) -> None:
        now = self._clock()
        self._wall_due = now + WALL_INTERVAL
        self._wall_earliest = now + (now - self._began) / WALL_SHARE

    def _hang_up(self) -> None:
        """The other process has ended: everything is read here from now on."""
        self._line, self._unheard, self._forgotten, self._read_at = None, 0, 0, -math.inf


def run(line: Connection) -> None:
    """Main function of the process. It ends with the solver's process, whose end of the line closes with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    give_way(LIVE)
    try:
        while True:
            line.send(read_angles(line.recv()))
    except (EOFError, OSError):
        return
