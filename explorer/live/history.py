"""Moments of a pour to which the user can go back: all recent ones, fewer of the older ones.

Memory is bounded. When it is full, the moment is deleted whose neighbours leave the smallest gap relative to its age,
so the gaps grow in proportion to their age. A deleted moment is not lost: the pour repeats the same bits from the
moment before it, as long as no parameter was changed in between.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from explorer.live.angle_reader import PileAngles
from solver.pours.checkpoint import Kept
from solver.scenes.scene import Scene

ROOM = 128 * 2**20
"""Memory [B] for all moments; one takes 72 kB with 29 bodies of 30 spheres, 1.8 MB with 2000 spheres in a bed."""
MOST = 500
"""Maximum number of moments, however small."""
LEAST = 3
"""Minimum number of moments kept, however large."""
HAIR = 1e-9
"""Tolerance [s] for rounding in a sum of time steps."""


@dataclass(frozen=True)
class Moment:
    """A moment of a pour, and what was known about it."""

    kept: Kept
    scene: Scene
    """The scene as the user sees it, with the parameters in force."""
    angles: PileAngles
    """The angles read last."""
    retuned: bool
    """Whether parameters had been changed since the pour began."""

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.kept.time


class History:
    """Moments of one pour in order of time."""

    def __init__(self, room: int = ROOM, most: int = MOST) -> None:
        self._room, self._most = room, most
        self._moments: list[Moment] = []
        self._changes: list[float] = []

    @property
    def earliest(self) -> float:
        """Time [s] of the first moment; NaN while there is none."""
        return self._moments[0].time if self._moments else math.nan

    def since(self, time: float) -> float:
        """Time [s] from the last moment to ``time``; infinite while there is none."""
        return time - self._moments[-1].time + HAIR if self._moments else math.inf

    @property
    def times(self) -> list[float]:
        """Times [s] of the moments."""
        return [moment.time for moment in self._moments]

    def add(self, moment: Moment) -> None:
        """Keep ``moment``, which must not be earlier than the last one; it replaces one of the same time."""
        if self._moments and self._moments[-1].time >= moment.time - HAIR:
            self._moments.pop()
        self._moments.append(moment)
        while len(self._moments) > LEAST and self._full():
            del self._moments[thinnest(self.times)]

    def changed(self, time: float) -> None:
        """Note that a parameter was changed at ``time`` [s]: later states do not follow from earlier ones alone."""
        self._changes.append(time)

    def back_to(self, time: float, now: float) -> tuple[Moment, float] | None:
        """The last moment at or before ``time`` [s], or else the first one, and the time until which to repeat from it.

        That time is ``time``, or that of the next change of a parameter after the moment. Everything later than the
        moment is forgotten. None if nothing is kept from before ``now``.
        """
        before = [moment for moment in self._moments if moment.time <= time + HAIR]
        before = before or [moment for moment in self._moments[:1] if moment.time < now - HAIR]
        if not before:
            return None
        moment, self._moments = before[-1], before
        undone = [change for change in self._changes if change > moment.time + HAIR]
        self._changes = [change for change in self._changes if change <= moment.time + HAIR]
        return moment, min([time, *undone])

    def _full(self) -> bool:
        size = sum(moment.kept.nbytes for moment in self._moments)
        return len(self._moments) > self._most or size > self._room


def thinnest(times: list[float]) -> int:
    """Index of the one of ``times`` [s], neither first nor last, that leaves the smallest gap relative to its age."""
    now = times[-1]
    return min(range(1, len(times) - 1), key=lambda k: (times[k + 1] - times[k - 1]) / (now - times[k]))
