"""Arrow keys that a slider takes for itself: the browser sends them as the page's command as well.

viser keeps a command's key from acting in a text field, but a slider's thumb is none. A browser tells a slider's new
value up to a tenth of a second after the key, so a command waits for that before it is carried out, or dropped.
"""

from __future__ import annotations

import math
import threading
import time
from typing import Any

import viser
from viser import _messages

from explorer.viewer.actions import Action, Post

WAIT = 0.2
"""How long an arrow key waits [s], and how near to it in time a slider's new value is the slider's own answer."""


class SliderHands:
    """Notes when a browser last moved a slider of ``server``."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._moved = -math.inf
        server._websock_server.register_handler(_messages.GuiUpdateMessage, self._note)

    def unless_on_a_slider(self, post: Post) -> Post:
        """``post`` for arrow keys: a moment later, or not at all if a slider was moved about then."""

        def later(action: Action) -> None:
            pressed = time.monotonic()

            def decide() -> None:
                if abs(self._moved - pressed) > WAIT:
                    post(action)

            timer = threading.Timer(WAIT, decide)
            timer.daemon = True
            timer.start()

        return later

    def _note(self, client_id: int, message: Any) -> None:
        value = message.updates.get("value")
        if isinstance(value, int | float) and not isinstance(value, bool):
            self._moved = time.monotonic()
