"""Fitted member spheres, kept between programs: a fit takes seconds, reading it back a millisecond.

One file per fit in ``$REPOSE_CACHE``, or ``clumps`` in the user's cache directory. Its name is a digest of all that the
fit depends on (the solid, a mesh by its contents; the spheres asked for; the solver's sources; NumPy, SciPy and
trimesh), so a file is either the fit that would be made or not found. A cache that cannot be read or written is as
none.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import astuple
from importlib.metadata import version
from pathlib import Path

import numpy as np
import numpy.typing as npt
import platformdirs

from solver.clump_fit import ClumpFit
from solver.shape import Solid
from solver.version import code_version

Array = npt.NDArray[np.float64]
Fit = tuple[Array, Array, ClumpFit]
"""Centres (n, 3) [m], radii (n,) [m] and how well they stand for the solid."""


def cache_folder() -> Path:
    """Where fits are kept."""
    named = os.environ.get("REPOSE_CACHE")
    return Path(named) if named else Path(platformdirs.user_cache_dir("repose-explorer")) / "clumps"


def kept_fit(solid: Solid, spheres: str, fit: Callable[[Solid, str], Fit]) -> Fit:
    """The fit of ``solid`` from the cache, or made by ``fit`` and kept; the same bits either way."""
    path = cache_folder() / f"{_digest(solid, spheres)}.npz"
    found = _read(path)
    if found is None:
        found = fit(solid, spheres)
        _write(path, found)
    return found


def _digest(solid: Solid, spheres: str) -> str:
    mesh = Path(solid.file).read_bytes() if solid.file else b""
    libraries = [version(name) for name in ("numpy", "scipy", "trimesh")]
    named = [solid.kind, [float(x).hex() for x in solid.dimensions], solid.unit, spheres, code_version(), libraries]
    return hashlib.sha256(repr(named).encode() + mesh).hexdigest()[:32]


def _read(path: Path) -> Fit | None:
    try:
        with np.load(path, allow_pickle=False) as kept:
            centres, radii, numbers = kept["centres"], kept["radii"], [float(x) for x in kept["fit"]]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    share, covered, rms, largest, x, y, z, smallest = numbers
    return centres, radii, ClumpFit(len(radii), share, covered, rms, largest, (x, y, z), smallest)


def _write(path: Path, fit: Fit) -> None:
    centres, radii, quality = fit
    _, share, covered, rms, largest, errors, smallest = astuple(quality)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Written apart and moved: another program never reads half a file.
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as part:
            np.savez(
                part, centres=centres, radii=radii, fit=np.array([share, covered, rms, largest, *errors, smallest])
            )
        Path(part.name).replace(path)
    except OSError:
        return
