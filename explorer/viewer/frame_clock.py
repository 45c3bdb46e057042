"""An even clock for the page's loop."""

from __future__ import annotations

import threading
import time


class FrameClock:
    """Frames every ``interval`` [s], counted from when the last one was due: what waits too long does not add up."""

    def __init__(self, interval: float) -> None:
        self._interval, self._due = interval, time.monotonic()

    def wait(self, stop: threading.Event) -> None:
        """Wait until the next frame is due, or ``stop`` is set; not at all where it is due already."""
        self._due = max(self._due + self._interval, time.monotonic())
        stop.wait(self._due - time.monotonic())
