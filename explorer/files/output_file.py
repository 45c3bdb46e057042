"""What a command makes: refused before any work where it cannot be made; a file is there complete or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from explorer.errors import CommandError


def check_new_file(path: Path, suffix: str = "", option: str = "") -> None:
    """Raise :class:`CommandError` unless ``path``, named by ``option``, ends in ``suffix``, is new and has a folder."""
    named = f"{option} {path}".lstrip()
    if suffix and path.suffix != suffix:
        raise CommandError(f"{named}: the name must end in {suffix}")
    if path.exists():
        raise CommandError(f"{named}: exists already; choose another name")
    check_folder_of(path, option)


def check_folder_of(path: Path, option: str = "") -> None:
    """Raise :class:`CommandError` unless ``path``, named by ``option``, is or can become a file in its folder."""
    named = f"{option} {path}".lstrip()
    if path.is_dir():
        raise CommandError(f"{named}: is a folder; name a file")
    if not path.absolute().parent.is_dir():
        raise CommandError(f"{named}: there is no folder {path.absolute().parent}")


def check_vacant(folder: Path, option: str = "--out", own: Sequence[Path] = (), resume: bool | None = None) -> None:
    """Raise :class:`CommandError` unless ``folder``, which ``option`` named, is missing or holds at most ``own``.

    ``resume``: whether the command is to go on with what is there; None of one that cannot.
    """
    named = f"{option} {folder}".lstrip()
    if folder.exists() and not folder.is_dir():
        raise CommandError(f"{named}: is a file; name a folder that is new or empty")
    known = {path.resolve() for path in own}
    if not resume and folder.is_dir() and any(one.resolve() not in known for one in folder.iterdir()):
        go_on = "" if resume is None else ", or add --resume to go on there"
        raise CommandError(f"{named}: is not empty; name a folder that is new or empty{go_on}")


def write_whole(path: Path, text: str) -> None:
    """Write ``text`` beside ``path`` and move it into place in one step."""
    write_whole_bytes(path, text.encode())


def write_whole_bytes(path: Path, contents: bytes) -> None:
    """The same for ``contents``. A link stays one; into a device or a pipe, such as /dev/stdout, they are written."""
    if path.exists() and not path.is_file() and not path.is_dir():
        path.write_bytes(contents)
        return
    path = path.resolve()
    temporary = path.with_name(f".{path.name}.part")
    try:
        temporary.write_bytes(contents)
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
