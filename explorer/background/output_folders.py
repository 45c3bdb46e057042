"""Names of the folders that commands in the background write into, and which of them hold a result."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from pathlib import Path

STAMP = r"\d{8}-\d{6}(?:-\d+)?"
"""Date, time and perhaps a number: the end of an output folder's name."""


def new_folder(folder: Path, stem: str) -> Path:
    """A name in ``folder``, which is made, that nobody has: ``<stem>-<date>-<time>``, with a number if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    dated = f"{stem}-{time.strftime('%Y%m%d-%H%M%S')}"
    names = [dated, *(f"{dated}-{k}" for k in range(2, 100))]
    return next(folder / name for name in names if not (folder / name).exists())


def finished(folder: Path, result: str) -> tuple[Path, ...]:
    """Folders in ``folder`` that hold the file ``result``, newest first."""
    found = [(file.stat().st_mtime, one) for one in folder.glob("*/") if (file := one / result).is_file()]
    return tuple(one for _, one in sorted(found, reverse=True))


def newest_unfinished(folder: Path, stems: Sequence[str], result: str) -> tuple[Path, str] | None:
    """The newest of the folders ``<stem>-<date>-<time>`` that holds no file ``result``, and its stem."""
    name = re.compile(rf"({'|'.join(map(re.escape, stems))})-({STAMP})")
    named = [(match, one) for one in folder.glob("*/") if (match := name.fullmatch(one.name))]
    stopped = [(match[2], match[1], one) for match, one in named if not (one / result).exists()]
    if not stopped:
        return None
    _, stem, found = max(stopped)
    return found, stem
