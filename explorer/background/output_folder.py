"""Output folders of background commands: their names, which of them hold a result, and the result as JSON."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from doe.record import Document, RecordError
from explorer.errors import CommandError
from solver.assets import own_path

Read = TypeVar("Read", bound=Document)

STAMP = r"\d{8}-\d{6}(?:-\d+)?"
"""End of an output folder's name: date, time and perhaps a number."""


def new_folder(folder: Path, stem: str) -> Path:
    """An unused path ``<stem>-<date>-<time>`` in ``folder``, with a number if needed; ``folder`` is created."""
    folder.mkdir(parents=True, exist_ok=True)
    dated = f"{stem}-{time.strftime('%Y%m%d-%H%M%S')}"
    names = [dated, *(f"{dated}-{k}" for k in range(2, 100))]
    return next(folder / name for name in names if not (folder / name).exists())


@contextlib.contextmanager
def kept_for_one(folder: Path) -> Iterator[None]:
    """Create ``folder`` and keep other commands out while this one writes there; it is freed however this one ends.

    Raises CommandError if another command is writing there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise CommandError(
                f"--out {folder}: another command is writing there; wait for it, or name another folder"
            ) from None
        yield
    finally:
        os.close(descriptor)


def finished(folder: Path, result: str) -> tuple[Path, ...]:
    """Folders in ``folder`` that hold the file ``result``, newest first."""
    found = [(file.stat().st_mtime, one) for one in folder.glob("*/") if (file := one / result).is_file()]
    return tuple(one for _, one in sorted(found, reverse=True))


def newest_unfinished(folder: Path, stems: Sequence[str], result: str) -> tuple[Path, str] | None:
    """The newest of the folders ``<stem>-<date>-<time>`` without a file ``result``, and its stem; None if none."""
    name = re.compile(rf"({'|'.join(map(re.escape, stems))})-({STAMP})")
    named = [(match, one) for one in folder.glob("*/") if (match := name.fullmatch(one.name))]
    stopped = [(match[2], match[1], one) for match, one in named if not (one / result).exists()]
    if not stopped:
        return None
    _, stem, found = max(stopped)
    return found, stem


class ResultFile:
    """The first of ``names`` that a folder holds."""

    def __init__(self, *names: str) -> None:
        self._names = names
        self._stamp: tuple[Path, int, int] | None = None
        self._content: dict[str, Any] | None = None

    @property
    def version(self) -> tuple[Path, int, int] | None:
        """Changes whenever the content does; None if there is no content."""
        return self._stamp

    def read(self, folder: Path | None) -> dict[str, Any] | None:
        """The JSON object in the file; None if there is no folder, no file, or no complete object in it."""
        found = None if folder is None else next((f for n in self._names if (f := folder / n).is_file()), None)
        stamp = None
        if found is not None:
            try:
                seen = found.stat()
                stamp = (found, seen.st_mtime_ns, seen.st_size)
                if stamp != self._stamp:
                    self._content = _object(found)
            except (OSError, ValueError):  # removed, or not JSON: as if it did not exist
                stamp = None
        if stamp is None:
            self._content = None
        self._stamp = stamp
        return self._content


def read_result(kind: type[Read], folder: Path, name: str) -> Read | None:
    """The result in the file ``name`` of ``folder``; None if there is none.

    Raises CommandError, in one line, for a result of another version.
    """
    content = ResultFile(name).read(folder)
    try:
        return None if content is None else kind.from_dict(content)
    except RecordError as error:
        raise CommandError(f"{folder / name}: {error}") from None


def checked_folder(text: str, name: str) -> Path:
    """The folder that the user typed, which has to hold a readable file ``name``. Raises CommandError."""
    if not text.strip():
        raise CommandError(f"name a folder that holds {name}")
    folder = own_path(text.strip()).absolute()
    file = folder / name
    if not file.is_file():
        raise CommandError(f"{folder}: holds no {name}")
    try:
        _object(file)
    except (OSError, ValueError) as error:
        raise CommandError(f"{file}: cannot be read ({error})") from None
    return folder


def _object(file: Path) -> dict[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except RecursionError:
        raise ValueError("brackets are nested too deeply") from None
    if not isinstance(content, dict):
        raise ValueError("not a JSON object")
    return content
