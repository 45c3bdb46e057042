"""Between the page's loop and what stands around viser's page in a browser: small states out, named commands in.

It is a WebSocket of its own on viser's port, behind the same rules of Host and Origin; viser's own panels can be folded
away by a browser, and what is in them is then gone from its page.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
from collections.abc import Callable, Mapping
from typing import Any

import websockets
from websockets.asyncio.server import ServerConnection

from explorer.viewer.incoming import RateLimit

PATH = "/shell/channel"
LONGEST_COMMAND = 2500
"""Characters of a command: a link's text with what stands around it."""

Command = Mapping[str, Any]
"""What a browser sent: {"do": name, …}. Every value in it may be anything."""


class ShellChannel:
    """What was told last is sent to every browser that comes, and every change to those that are there."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._told: dict[str, str] = {}
        self._acts: dict[str, Callable[[Command], None]] = {}
        self._noted: Callable[[], None] = lambda: None
        self._waiting: dict[ServerConnection, tuple[asyncio.AbstractEventLoop, asyncio.Event]] = {}

    def offer(self, name: str, act: Callable[[Command], None]) -> None:
        """Call ``act`` with every command ``name``, in the server's thread: it should only leave an action."""
        self._acts[name] = act

    def on_command(self, note: Callable[[], None]) -> None:
        """Call ``note`` before every command, in the server's thread."""
        self._noted = note

    def tell(self, key: str, value: Any) -> None:
        """Show ``value`` (JSON) under ``key`` in every browser; what is shown already is left alone. Any thread."""
        text = json.dumps(value, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
        with self._lock:
            if self._told.get(key) == text:
                return
            self._told[key] = text
            for loop, changed in self._waiting.values():
                # A loop that has ended has no browsers any more.
                with contextlib.suppress(RuntimeError):
                    loop.call_soon_threadsafe(changed.set)

    @property
    def told(self) -> dict[str, Any]:
        """What browsers are shown, by key."""
        with self._lock:
            return {key: json.loads(text) for key, text in self._told.items()}

    def take(self, message: str | bytes) -> None:
        """Carry out what a browser sent; anything that is not a command is ignored."""
        if not isinstance(message, str) or len(message) > LONGEST_COMMAND:
            return
        try:
            command = json.loads(message)
        except (ValueError, RecursionError):
            return
        act = self._acts.get(str(command.get("do"))) if isinstance(command, dict) else None
        if act is not None:
            self._noted()
            act(command)

    async def handle(self, connection: ServerConnection) -> None:
        """Serve one browser until it disconnects."""
        changed = asyncio.Event()
        changed.set()
        with self._lock:
            self._waiting[connection] = asyncio.get_running_loop(), changed
        teller = asyncio.create_task(self._tell_changes(connection, changed))
        pace = RateLimit()
        try:
            async for message in connection:
                await pace.wait()
                self.take(message)
        except websockets.ConnectionClosed:
            pass
        finally:
            teller.cancel()
            with self._lock:
                del self._waiting[connection]

    async def _tell_changes(self, connection: ServerConnection, changed: asyncio.Event) -> None:
        """Send what is new to this browser; for a slow one, only the newest state is sent, and nothing piles up."""
        sent: dict[str, str] = {}
        with contextlib.suppress(websockets.ConnectionClosed):
            while await changed.wait():
                changed.clear()
                with self._lock:
                    new = {key: text for key, text in self._told.items() if sent.get(key) != text}
                sent |= new
                if new:
                    await connection.send(
                        "{" + ",".join(f"{json.dumps(key)}:{text}" for key, text in new.items()) + "}"
                    )
