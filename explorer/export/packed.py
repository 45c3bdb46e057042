"""What `explorer export` writes, in one file that a browser takes along."""

from __future__ import annotations

import tempfile
from pathlib import Path

from explorer.background.printed import printed
from explorer.files.exports import zipped


def packed_export(scene: Path, program: str, seed: int) -> bytes:
    """A .zip of the folder that ``explorer export scene DIR --to program --seed seed`` makes, in a process of its own.

    Raises CommandError where that command refuses.
    """
    with tempfile.TemporaryDirectory() as apart:
        folder = Path(apart) / f"{scene.stem}_{program}"
        printed(["export", str(scene), str(folder), "--to", program, "--seed", str(seed)])
        written = sorted(one for one in folder.rglob("*") if one.is_file())
        return zipped({str(path.relative_to(apart)): path for path in written})
