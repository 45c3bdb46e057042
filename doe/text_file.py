"""Text files that people bring: of a size that is expected, in UTF-8 with or without a mark, or one clear line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path


def read_text(path: Path, most_bytes: int, wrong: Callable[[str], Exception]) -> str:
    """The text in ``path``, lines ending in ``\\n``; raises ``wrong(line)``, the line naming the file, otherwise."""
    try:
        size = path.stat().st_size
        if size > most_bytes:
            raise wrong(f"{path}: {size} bytes; allowed: up to {most_bytes}")
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise wrong(f"{path}: no such file") from None
    except UnicodeDecodeError:
        text = "\0"
    except OSError as error:
        raise wrong(f"{path}: {error.strerror}") from None
    if "\0" in text:
        raise wrong(f"{path}: not a text file in UTF-8; a spreadsheet saves one as CSV UTF-8")
    return text
