"""A file that is there complete or not at all."""

from __future__ import annotations

from pathlib import Path


def write_whole(path: Path, text: str) -> None:
    """Write ``text`` beside ``path`` and move it into place in one step."""
    write_whole_bytes(path, text.encode())


def write_whole_bytes(path: Path, contents: bytes) -> None:
    """The same for ``contents``."""
    temporary = path.with_name(f".{path.name}.part")
    temporary.write_bytes(contents)
    temporary.replace(path)
