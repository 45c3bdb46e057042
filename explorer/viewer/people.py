"""Who is at the page, and whose hand was on it last: several browsers share one pour.

viser tells a callback who moved a control, but a change comes back from the solver's process later; so every message of
a browser is noted as it arrives, and a change is signed by the browser that sent one last. The handlers are private
names of viser, which is why it is pinned and a test watches them.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import viser
from viser import _messages

from explorer.live.messages import Event

ACTED_WITHIN = 2.0
"""A change that comes back within this time [s] of a browser's message is taken for that browser's."""
ACTS = (_messages.GuiUpdateMessage, _messages.CommandTriggerMessage)
"""Messages by which a person acts."""


class People:
    """Browsers, numbered from 1 in the order in which they came; a number is never given twice."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._last, self._at = 0, -math.inf
        for kind in ACTS:
            server._websock_server.register_handler(kind, self._acted)

        @server.on_client_connect
        def _(client: viser.ClientHandle) -> None:
            if self.present > 1:
                client.add_notification(
                    f"You are browser {number(client.client_id)}",
                    f"{self.present} browsers are at this page, with the same pour.",
                    auto_close_seconds=8.0,
                )

    @property
    def present(self) -> int:
        """How many browsers are at the page."""
        return len(self._server.get_clients())

    def signed(self, event: Event) -> Event:
        """``event``, a change or an order with the browser behind its text where there are several."""
        if not (event.is_change or event.is_order) or self.present < 2 or time.monotonic() > self._at + ACTED_WITHIN:
            return event
        return replace(event, text=f"{event.text} · browser {self._last}")

    def _acted(self, client_id: int, message: Any) -> None:
        self._last, self._at = number(client_id), time.monotonic()


def number(client_id: int) -> int:
    """What a browser is called."""
    return client_id + 1
