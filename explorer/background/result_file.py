"""The JSON file that a command left in its output folder, read again only when it has changed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from explorer.errors import CommandError


class ResultFile:
    """The first of ``names`` that a folder holds."""

    def __init__(self, *names: str) -> None:
        self._names = names
        self._stamp: tuple[Path, int, int] | None = None
        self._content: dict[str, Any] | None = None

    @property
    def version(self) -> tuple[Path, int, int] | None:
        """Changes whenever the content does; None where there is none."""
        return self._stamp

    def read(self, folder: Path | None) -> dict[str, Any] | None:
        """The file's object; None where there is no folder, no file, or no whole object in it."""
        found = None if folder is None else next((f for n in self._names if (f := folder / n).is_file()), None)
        stamp = None
        if found is not None:
            try:
                seen = found.stat()
                stamp = (found, seen.st_mtime_ns, seen.st_size)
                if stamp != self._stamp:
                    self._content = _object(found)
            except (OSError, ValueError):  # taken away or not JSON: as if it were not there
                stamp = None
        if stamp is None:
            self._content = None
        self._stamp = stamp
        return self._content


def checked_folder(text: str, name: str) -> Path:
    """The folder that a person typed, which has to hold a readable file ``name``. Raises CommandError."""
    if not text.strip():
        raise CommandError(f"name a folder that holds {name}")
    folder = Path(text.strip()).expanduser().absolute()
    file = folder / name
    if not file.is_file():
        raise CommandError(f"{folder}: holds no {name}")
    try:
        _object(file)
    except (OSError, ValueError) as error:
        raise CommandError(f"{file}: cannot be read ({error})") from None
    return folder


def _object(file: Path) -> dict[str, Any]:
    content = json.loads(file.read_text(encoding="utf-8"))
    if not isinstance(content, dict):
        raise ValueError("not a JSON object")
    return content
