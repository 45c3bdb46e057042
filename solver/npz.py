"""Arrays from .npz files: plain numbers, whole and bounded. Whatever is wrong with a file is one error in one line."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

MOST_BYTES = 2**30
"""[bytes] that the arrays of a file may take when they are unpacked."""


ZIP_DAMAGE = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError)
"""What ``zipfile`` raises for an archive that is damaged, encrypted or packed in a way that it does not know."""


class NpzError(ValueError):
    """A file that is no archive of plain arrays; the message is one line that does not name the file."""


def npz_arrays(source: Path | bytes, names: Sequence[str] = (), most: int = MOST_BYTES) -> dict[str, npt.NDArray[Any]]:
    """The arrays ``names`` of a file or its content; all of them if none are named. Nothing in it is executed.

    Raises:
        NpzError: damaged, encrypted or no archive, objects in place of numbers, an array that is missing, or more than
            ``most`` bytes when it is unpacked.
        OSError: a file that cannot be opened.
    """
    content = source if isinstance(source, bytes) else source.read_bytes()
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(member.file_size for member in archive.infolist())
        if size > most:
            raise NpzError(f"{size} bytes unpacked; allowed: up to {most} bytes")
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            missing = [name for name in names if name not in file]
            if missing:
                raise NpzError(f"array {missing[0]!r} is missing; allowed: {', '.join(names)}")
            found = {name: file[name] for name in names or file.files}
        if strange := [name for name, array in found.items() if not isinstance(array, np.ndarray)]:
            raise NpzError(f"{strange[0]!r} is not an array; allowed: .npz of plain arrays")
        return found
    except NpzError:
        raise
    # What zipfile, zlib and NumPy's reader of headers raise for damaged bytes; a size that nobody has is a MemoryError.
    except (
        *ZIP_DAMAGE,
        *(struct.error, OSError, ValueError, KeyError, TypeError, OverflowError, MemoryError, SyntaxError),
    ) as error:
        raise NpzError(f"cannot be read as .npz of plain arrays ({' '.join(str(error).split())[:120]})") from None
