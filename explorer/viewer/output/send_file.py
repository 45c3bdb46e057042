"""Send a file to a user's browser, unless it is too large."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from viser import _messages

from explorer.errors import CommandError

MOST_SENT = 200_000_000
"""Bytes of a recording that are sent to a browser at most."""


def send_file(client: Any, name: str, content: bytes) -> None:
    """Have a browser download ``content`` as a file named ``name``. Raises CommandError like :func:`send_files`."""
    send_files(client, {name: content})


def send_files(client: Any, files: Mapping[str, bytes]) -> None:
    """Have a browser download ``files``, name → content.

    Raises CommandError while earlier ones are being sent: for a browser that takes none they would pile up here.
    """
    buffer = client._websock_connection.get_message_buffer()
    with buffer.buffer_lock:
        waiting = any(isinstance(one, _messages.FileTransferPart) for one in buffer.message_from_id.values())
    if waiting:
        raise CommandError(f"{', '.join(files)}: this browser has not yet received the previous file")
    for name, content in files.items():
        # At once: otherwise the user gets a link in a notification and has to click it.
        client.send_file_download(name, content, save_immediately=True)


def refuse_large(files: Sequence[Path]) -> None:
    """Raise CommandError if recordings are too large to send together; the message says where they are."""
    size = sum(file.stat().st_size for file in files)
    if size > MOST_SENT:
        listed = ", ".join(map(str, files))
        raise CommandError(f"recording: {size / 1e6:.0f} MB is too large to send; copy {listed}")
