"""The scene as it moves, as one HTML file that any browser plays without a server."""

from __future__ import annotations

import time
from typing import Any

import viser

from explorer.live.frames import Frame
from explorer.live.messages import Status

MOST_BYTES = 150e6
"""Of poses that are kept, before they are packed: half an hour of 80 bodies, 20 s of as many as a frame holds."""
BYTES_PER_BODY = 32
LONGEST_PAUSE = 0.5
"""A pause in the pour takes no longer than this [s] in the playback."""


class ScenePlayback:
    """Keeps what is sent to browsers from its making on; a recorder of the page."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._serializer: Any = server.get_scene_serializer()  # takes note of all that is sent until it is packed
        self._last = time.monotonic()
        self._number, self._bytes = -1, 0.0
        self._html: str | None = None

    def take(self, frame: Frame, status: Status) -> None:
        """Note how much time has passed since the frame before, in wall time as a person saw it."""
        if self._html is not None or frame.number == self._number:
            return
        now = time.monotonic()
        self._serializer.insert_sleep(min(now - self._last, LONGEST_PAUSE))
        self._last, self._number = now, frame.number
        self._bytes += BYTES_PER_BODY * len(frame.component)

    @property
    def full(self) -> bool:
        """Whether as much is kept as one file should hold."""
        return self._bytes > MOST_BYTES

    def close(self) -> None:
        """End the playback; :meth:`html` gives it out."""
        if self._html is None:
            self._html = self._serializer.as_html(dark_mode=True)

    def html(self) -> str:
        """The file; ends the playback."""
        self.close()
        return self._html or ""
