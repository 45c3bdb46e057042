"""Fitted member spheres, kept between programs: a fit takes seconds, reading it back a millisecond.

One file per fit, of shipped bodies in ``assets/clumps``, of all others in ``$REPOSE_CACHE`` or ``clumps`` in the user's
cache directory. Its name is a digest of all that the fit depends on (the solid, a mesh by its contents; the spheres
asked for; the version of the fitting), so a file is either the fit that was asked for or not found. A cache that cannot
be read or written is as none.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import astuple
from pathlib import Path

import numpy as np
import numpy.typing as npt
import platformdirs

from solver.assets import shipped_fits
from solver.clump_fit import ClumpFit
from solver.shape import Solid
from solver.version import FITTING

Array = npt.NDArray[np.float64]
Fit = tuple[Array, Array, ClumpFit]
"""Centres (n, 3) [m], radii (n,) [m] and how well they stand for the solid."""


def cache_folder() -> Path:
    """Where fits are kept."""
    named = os.environ.get("REPOSE_CACHE")
    return Path(named) if named else Path(platformdirs.user_cache_dir("repose-explorer")) / "clumps"


def kept_fit(solid: Solid, spheres: str, fit: Callable[[Solid, str], Fit]) -> Fit:
    """The fit of ``solid`` from the cache, or made by ``fit`` and kept; the same bits either way."""
    name = fit_name(solid, spheres)
    found = read_fit(shipped_fits() / name) or read_fit(cache_folder() / name)
    if found is None:
        found = fit(solid, spheres)
        write_fit(cache_folder() / name, found)
    return found


def fit_name(solid: Solid, spheres: str) -> str:
    """Name of the file of a fit."""
    mesh = Path(solid.file).read_bytes() if solid.file else b""
    named = [solid.kind, [float(x).hex() for x in solid.dimensions], solid.unit, spheres, FITTING]
    return f"{hashlib.sha256(repr(named).encode() + mesh).hexdigest()[:32]}.npz"


def read_fit(path: Path) -> Fit | None:
    """The fit in a file, or None."""
    try:
        with np.load(path, allow_pickle=False) as kept:
            centres, radii = kept["centres"], kept["radii"]
            share, covered, rms, largest, x, y, z, smallest = (float(number) for number in kept["fit"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return centres, radii, ClumpFit(len(radii), share, covered, rms, largest, (x, y, z), smallest)


def write_fit(path: Path, fit: Fit) -> None:
    """Keep a fit; a place that cannot be written keeps none."""
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
