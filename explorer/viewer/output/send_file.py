"""A file for the person at a browser."""

from __future__ import annotations

from typing import Any


def send_file(client: Any, name: str, content: bytes) -> None:
    """Have a browser keep ``content`` as a file called ``name``."""
    # At once: otherwise a person gets a link in a notification, and has to press it.
    client.send_file_download(name, content, save_immediately=True)
