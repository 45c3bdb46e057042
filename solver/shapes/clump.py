"""Clumps: rigid bodies that touch with their member spheres and move with the inertia of the true solid.

A fit of member spheres takes seconds, reading it back a millisecond, so fits are kept between runs of the program: one
file per fit, for shipped bodies in ``assets/clumps``, for all others in ``$REPOSE_CACHE`` or ``clumps`` in the user's
cache directory. Its name is a digest of all that the fit depends on (the solid, a mesh by its contents; the requested
spheres; the version of the fitting), so that the file found is always the requested fit. A cache that cannot be read or
written is ignored.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from dataclasses import astuple, dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import platformdirs

from solver.assets import shipped_fits
from solver.npz import npz_arrays
from solver.shapes.clump_error import ClumpFit, extent_errors, measured_fit
from solver.shapes.solid import ShapeError, Solid, file_stamp, mass_properties, surface_mesh
from solver.shapes.solid_points import interior_points, surface_points
from solver.shapes.sphere_fit import FitTarget, Orbits, not_facing, refine, start_layouts, without_idle
from solver.shapes.sphere_number import LEAST_RADIUS, doubling, fitted
from solver.shapes.sphere_union import squared_distances
from solver.version import FITTING

Array = npt.NDArray[np.float64]
Fit = tuple[Array, Array, ClumpFit]
"""Centres (n, 3) [m], radii (n,) [m] and how well they represent the solid."""

MOST_SPHERES = 128
EXTENT_LIMIT = 0.02
# points of equal area: a symmetric solid folds them into one octant, eight times as dense
FIT_POINTS, FIT_POINTS_SYMMETRIC = 1000, 800
INTERIOR_POINTS = 30_000


@dataclass(frozen=True)
class Demand:
    """What a resolution requires of a clump.

    Args:
        rms: largest RMS surface deviation, relative to the diameter of the sphere of the same volume.
        least_radius: smallest member sphere, relative to the largest sphere inside the solid; it sets the time step.
        most_spheres: number at which the search ends; the best clump so far is then used, with its stated error.
    """

    rms: float
    least_radius: float
    most_spheres: int


# standard is 0.39 mm RMS for a seed of 27.92 x 11.18 x 6.11 mm, 0.49 mm for a plate of 27.53 x 15.02 x 5 mm
DEMANDS: dict[str, Demand] = {
    "coarse": Demand(rms=0.075, least_radius=0.8, most_spheres=16),
    "standard": Demand(rms=0.0312, least_radius=0.7, most_spheres=40),
    "fine": Demand(rms=0.0145, least_radius=0.6, most_spheres=48),
}
RESOLUTIONS = tuple(DEMANDS)


@dataclass(frozen=True, eq=False)
class Clump:
    """A rigid body of member spheres. Arrays are read-only.

    Args:
        centres: (n, 3) in the principal frame, relative to the centre of mass [m].
        radii: (n,) [m].
        mass: [kg].
        inertia: (3,) principal moments about x, y, z [kg m2].
        bounding_radius: radius of the sphere about the centre of mass that contains every member sphere [m].
        fit: how well the spheres represent the solid.
    """

    centres: Array
    radii: Array
    mass: float
    inertia: Array
    bounding_radius: float
    fit: ClumpFit


def fit_clump(solid: Solid, density: float, spheres: str) -> Clump:
    """The clump of the fewest spheres that meet a resolution's demand, or of a given number; the same bits every time.

    Resolution: starting layouts are tried by ascending number of spheres and refined by least squares
    (`solver.shapes.sphere_fit`); the first number whose best layout meets the RMS deviation, and outer dimensions
    within 2 %, is used. If none does, the layout of smallest deviation is used, and `fit` states its error.
    Number: the best symmetric layout of that many spheres if the solid is symmetric and there is one, else the
    best of `solver.shapes.sphere_number`. A sphere is its own clump, exactly. Mass and inertia are the solid's,
    never the spheres'. Kept in memory (a mesh by the time of its file's last change) and on disk
    (`solver.shapes.clump`).

    Args:
        solid: true shape.
        density: [kg/m3].
        spheres: coarse, standard or fine, or a number as text.

    Raises:
        ShapeError: neither a resolution nor a number, bad density or unusable mesh.
    """
    if spheres not in DEMANDS and not (spheres.isdecimal() and 1 <= int(spheres) <= MOST_SPHERES):
        raise ShapeError(
            f"spheres = {spheres!r}: allowed are {', '.join(DEMANDS)} and numbers from 1 to {MOST_SPHERES}"
        )
    properties = mass_properties(solid, density)
    centres, radii, fit = _fit_spheres(solid, spheres, file_stamp(solid))
    return _clump(centres, radii, properties.mass, properties.inertia, fit)


def explicit_clump(
    centres: npt.ArrayLike,
    radii: npt.ArrayLike,
    mass: float,
    inertia: npt.ArrayLike,
    fit: ClumpFit | None = None,
) -> Clump:
    """A body that is declared by its spheres.

    Without a `fit` the union of spheres is the body itself and has no error. Nothing is recentred: the centre of
    mass is where the declaration says.

    Args:
        centres: (n, 3) relative to the centre of mass, along the principal axes [m].
        radii: (n,) [m].
        mass: [kg].
        inertia: (3,) principal moments [kg m2].
        fit: how well the spheres represent another solid.

    Raises:
        ShapeError: wrong array shapes, values that are not finite, a radius, mass or moment that is not
            positive, or moments that no body can have (each must be at most the sum of the others).
    """
    centres, radii, inertia = (
        _numbers("sphere_centres", centres),
        _numbers("sphere_radii", radii),
        _numbers("inertia", inertia),
    )
    if centres.ndim != 2 or centres.shape[1] != 3 or len(centres) == 0:
        raise ShapeError(f"sphere_centres: an array (n, 3) with n >= 1 is expected, got {centres.shape}")
    if radii.shape != (len(centres),):
        raise ShapeError(f"sphere_radii: one radius for each of {len(centres)} centres is expected, got {radii.shape}")
    if not (radii > 0.0).all():
        raise ShapeError(f"sphere_radii: every radius must be positive [m], got {radii.min():g}")
    if not (np.ndim(mass) == 0 and _numbers("mass", mass) > 0.0):
        raise ShapeError(f"mass = {mass!r}: must be positive [kg]")
    if inertia.shape != (3,) or not (inertia > 0.0).all():
        raise ShapeError(f"inertia = {inertia.tolist()}: three positive principal moments are expected [kg m2]")
    # 1e-6: moments are declared with few digits, and those of a thin plate meet the limit exactly
    if inertia.max() > (1.0 + 1e-6) * (inertia.sum() - inertia.max()):
        raise ShapeError(f"inertia = {inertia.tolist()}: no moment may exceed the sum of the other two")
    fit = fit or ClumpFit(len(radii), 1.0, 1.0, 0.0, 0.0, (0.0, 0.0, 0.0), float(radii.min()))
    return _clump(centres, radii, float(mass), inertia, fit)


def scaled(clump: Clump, scale: float) -> Clump:
    """A geometrically similar clump of the same density: lengths times s, mass times s³, inertia times s⁵."""
    if scale == 1.0:
        return clump
    fit = replace(
        clump.fit,
        surface_rms=clump.fit.surface_rms * scale,
        surface_max=clump.fit.surface_max * scale,
        smallest_radius=clump.fit.smallest_radius * scale,
    )
    centres, radii, inertia = clump.centres * scale, clump.radii * scale, clump.inertia * scale**5
    return _clump(centres, radii, clump.mass * scale**3, inertia, fit)


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
        kept = npz_arrays(path, ("centres", "radii", "fit"))
        centres, radii = kept["centres"], kept["radii"]
        share, covered, rms, largest, x, y, z, smallest = (float(number) for number in kept["fit"])
    except (OSError, TypeError, ValueError):
        return None
    return centres, radii, ClumpFit(len(radii), share, covered, rms, largest, (x, y, z), smallest)


def write_fit(path: Path, fit: Fit) -> None:
    """Keep a fit; nothing is kept if the place cannot be written."""
    centres, radii, quality = fit
    _, share, covered, rms, largest, errors, smallest = astuple(quality)
    written: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Written to a temporary file and moved: another program never reads half a file.
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as part:
            written = Path(part.name)
            np.savez(
                part, centres=centres, radii=radii, fit=np.array([share, covered, rms, largest, *errors, smallest])
            )
        written.chmod(0o644)  # so that whoever shares the folder may read it
        written.replace(path)
    except OSError:
        if written is not None:
            written.unlink(missing_ok=True)


def _numbers(name: str, values: npt.ArrayLike) -> Array:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ShapeError(f"{name}: numbers in rows of equal length are expected, got {values!r}") from None
    if not np.isfinite(array).all():
        raise ShapeError(f"{name}: every number must be finite, got {values!r}")
    return array


def _clump(centres: Array, radii: Array, mass: float, inertia: Array, fit: ClumpFit) -> Clump:
    for array in (centres, radii, inertia):
        array.flags.writeable = False
    bounding_radius = float((np.linalg.norm(centres, axis=1) + radii).max())
    return Clump(centres, radii, mass, inertia, bounding_radius, fit)


@lru_cache(maxsize=64)
def _fit_spheres(solid: Solid, spheres: str, stamp: int) -> tuple[Array, Array, ClumpFit]:
    if solid.kind == "sphere":
        radius = solid.dimensions[0] / 2.0
        return np.zeros((1, 3)), np.array([radius]), ClumpFit(1, 1.0, 1.0, 0.0, 0.0, (0.0, 0.0, 0.0), radius)
    return kept_fit(solid, spheres, _new_fit)


def _new_fit(solid: Solid, spheres: str) -> tuple[Array, Array, ClumpFit]:
    if spheres in DEMANDS:
        volume = mass_properties(solid, 1.0).volume
        diameter = np.cbrt(6.0 * volume / np.pi)
        centres, radii = _fewest_spheres(_target(solid), DEMANDS[spheres], diameter).spheres()
    else:
        centres, radii = _so_many_spheres(solid, int(spheres))
    return centres, radii, measured_fit(solid, centres, radii)


def _target(solid: Solid) -> FitTarget:
    symmetric = solid.kind != "mesh"
    surface, normals = surface_points(solid, FIT_POINTS_SYMMETRIC if symmetric else FIT_POINTS)
    return FitTarget(
        np.abs(surface) if symmetric else surface,
        np.abs(normals) if symmetric else normals,
        interior_points(solid, INTERIOR_POINTS),
        np.array(surface_mesh(solid).bounds),
        symmetric,
    )


def _so_many_spheres(solid: Solid, number: int) -> tuple[Array, Array]:
    if solid.kind != "mesh":
        target = _target(solid)
        floor = LEAST_RADIUS * target.inscribed_radius
        layouts = start_layouts(target, number, floor).get(number, [])
        trials = [without_idle(refine(layout, target, floor, 100), target) for layout in layouts]
        whole = [trial for trial in trials if len(trial.owner) == number]
        if whole:
            return min(whole, key=lambda orbits: _score(orbits, target)).spheres()
    return list(fitted(solid, doubling(number)))[-1]


def _fewest_spheres(target: FitTarget, demand: Demand, diameter: float) -> Orbits:
    floor = demand.least_radius * target.inscribed_radius
    limit = demand.rms * diameter
    best_score, best, next_count = np.inf, None, 1
    for count, layouts in sorted(start_layouts(target, demand.most_spheres, floor).items()):
        if count < min(next_count, 0.9 * demand.most_spheres):
            continue
        trials = [without_idle(refine(layout, target, floor, 100), target) for layout in layouts]
        trial = min(trials, key=lambda orbits: _score(orbits, target))
        score = _score(trial, target)
        if score < best_score or best is None:
            best_score, best = score, trial
        if score <= limit:
            break
        # deviation falls more slowly than count^(-4/3): far from the demand, a few more spheres do not help
        next_count = int(count * min(best_score / limit, 1.5) ** 0.75)
    if best is None:
        raise ShapeError(
            f"too slender for the {demand.most_spheres} spheres of this resolution; allowed: thicker, or a number of "
            "spheres"
        )
    return best


def _score(orbits: Orbits, target: FitTarget) -> float:
    """RMS gap [m], raised by outer dimensions beyond their limit so that such clumps come last."""
    centres, radii = orbits.spheres()
    distance = np.sqrt(squared_distances(target.surface, centres))
    gap = (distance - radii + not_facing(target.surface, target.normals, centres)).min(axis=1)
    excess = np.abs(extent_errors(target.bounds, centres, radii)).max() - EXTENT_LIMIT
    return float(np.sqrt((gap**2).mean()) + max(excess, 0.0) * 100.0 * target.inscribed_radius)
