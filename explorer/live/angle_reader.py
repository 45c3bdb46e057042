"""The angle of repose of a pour that still moves: when to read it, what was read last, and the process that reads it.

A reading takes about 25 ms, during which the pour would stand still. While the pour runs, another process therefore
does the reading (piles in, angles out, until the connection closes). A pour that stands still is read here, so that
the angle is that of the pile on the screen.
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
"""Share of the poured mass that has to lie below the outlet: the first few bodies do not form a pile with an angle."""
SIMULATED_INTERVAL, WALL_INTERVAL = 0.1, 0.5
"""The angle is read again after this much simulated or wall time [s], whichever comes first."""
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
    """The view from which the left and right angles were read, with the lines of its flanks."""


def read_angles(pile: Pile) -> PileAngles:
    """The angles read off ``pile``."""
    reading = PileReading(pile)
    return PileAngles(
        {name: angle(reading) for name, angle in ANGLES.items()}, reading.front if reading.is_pile else None
    )


class AngleReader:
    """Reads the angles of one pour after another. Times are in seconds.

    line: connection to a process that reads while this one continues; without it, everything is read here.
    clock: present wall time.
    """

    def __init__(self, line: Connection | None, clock: Callable[[], float]) -> None:
        self._line, self._clock = line, clock
        self._unheard = 0
        self.forget()

    def forget(self, angles: PileAngles | None = None) -> None:
        """Start over, for another pour or an earlier moment of this one, at which ``angles`` had been read."""
        self.newest = angles or PileAngles()
        self._forgotten = self._unheard
        self._read_at = self._wall_due = self._wall_earliest = -math.inf

    def due(self, time: float) -> bool:
        """Whether the angle of simulated ``time`` should be read now."""
        wall = self._clock()
        moved_on = time >= self._read_at + SIMULATED_INTERVAL or wall >= self._wall_due
        return time > self._read_at and moved_on and wall >= self._wall_earliest and self._unheard == self._forgotten

    def read(self, pile: Pile, share_below: float, time: float) -> None:
        """Read ``pile``, if ``share_below`` (0 … 1, mass below the outlet per poured mass) is enough for a pile."""
        self._forgotten = self._unheard
        self._begin(time)
        if share_below >= LEAST_SHARE_BELOW:
            self.newest = read_angles(pile)
        self._end()

    def ask(self, pile: Pile, share_below: float, time: float) -> None:
        """Have the other process read ``pile``; :meth:`hear` takes the answer."""
        if self._line is None or share_below < LEAST_SHARE_BELOW:
            self.read(pile, share_below, time)
            return
        if self._unheard:  # the other process still reads a forgotten pile; this one will be due again
            return
        self._begin(time)
        try:
            self._line.send(pile)
            self._unheard += 1
        except OSError:
            self._hang_up()

    def hear(self) -> bool:
        """Take what the other process has read, if anything; True if that is new."""
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
        """The other process has ended: read everything here from now on."""
        self._line, self._unheard, self._forgotten, self._read_at = None, 0, 0, -math.inf


def run(line: Connection) -> None:
    """Main function of the reading process. It ends with the solver's process, which closes the connection."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    give_way(LIVE)
    try:
        while True:
            line.send(read_angles(line.recv()))
    except (EOFError, OSError):
        return
