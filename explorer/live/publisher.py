"""What a live pour shows: frames, and details of its contacts while somebody looks at them, by shared memory."""

from __future__ import annotations

import math

from explorer.live.details import DetailWriter
from explorer.live.frames import FrameWriter
from explorer.live.messages import Watch
from solver.pours.pour import Pour
from solver.pours.record import Outcome

FRAME_INTERVAL = 1.0 / 60.0
"""Wall time [s] between published frames."""
DETAIL_INTERVAL = 0.1
"""Wall time [s] between details, while they are looked at."""


class Publisher:
    """Publishes one pour after the other; ``wall`` is the present moment [s] on the caller's clock.

    The last finite state stays on the screen when that of a pour is no longer finite.
    """

    def __init__(self, frames: FrameWriter, details: DetailWriter) -> None:
        self._frames, self._details = frames, details
        self._watch = Watch(wanted=False)
        self._framed = self._detailed = -math.inf

    def watch(self, order: Watch) -> None:
        """What is looked at from now on."""
        self._watch = order

    def publish(self, pour: Pour, generation: int, wall: float) -> None:
        """Publish the present state."""
        self._frame(pour, generation, wall)
        self._detail(pour, generation, wall)

    def publish_due(self, pour: Pour, generation: int, wall: float) -> None:
        """Publish what has not been for its interval."""
        if wall - self._framed >= FRAME_INTERVAL:
            self._frame(pour, generation, wall)
        if wall - self._detailed >= DETAIL_INTERVAL:
            self._detail(pour, generation, wall)

    def _frame(self, pour: Pour, generation: int, wall: float) -> None:
        self._framed = wall
        if pour.outcome != Outcome.NON_FINITE:
            self._frames.publish(pour.bodies(), generation, pour.time, pour.surface_poses())

    def _detail(self, pour: Pour, generation: int, wall: float) -> None:
        self._detailed = wall
        if self._watch.wanted and pour.outcome != Outcome.NON_FINITE:
            bodies, contacts = pour.bodies(), pour.contacts()
            self._details.publish(generation, pour.time, bodies, pour.supply.times, contacts, self._watch.body)
