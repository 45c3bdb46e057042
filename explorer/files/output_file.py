"""A file that a command makes: refused before any work where it cannot be made; then there complete or not at all."""

from __future__ import annotations

from pathlib import Path

from explorer.errors import CommandError


def check_new_file(path: Path, suffix: str) -> None:
    """Raise :class:`CommandError` unless ``path`` ends in ``suffix``, is new and has a folder."""
    if path.suffix != suffix:
        raise CommandError(f"{path}: the name must end in {suffix}")
    if path.exists():
        raise CommandError(f"{path}: exists already; choose another name")
    if not path.absolute().parent.is_dir():
        raise CommandError(f"{path}: there is no folder {path.absolute().parent}")


def write_whole(path: Path, text: str) -> None:
    """Write ``text`` beside ``path`` and move it into place in one step."""
    write_whole_bytes(path, text.encode())


def write_whole_bytes(path: Path, contents: bytes) -> None:
    """The same for ``contents``."""
    temporary = path.with_name(f".{path.name}.part")
    temporary.write_bytes(contents)
    temporary.replace(path)
