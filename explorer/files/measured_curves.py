"""What was measured as curves in the picture of a pile: those of a data set, or of one file that a browser sent.

A data set gives silhouettes of scans, height profiles and free surfaces. One file gives one curve:

.npz   xyz (n, 3) [m], radius (n,) [m]: spheres of the bodies on the plate, as in a measured data set
.csv   a line u_m,z_m, then one point per line: to the right and above the plate [m]; # starts a comment;
       cells and numbers as `doe.table_file` reads them
.jpg   (.jpeg, .png) a photograph along the plate, read like `explorer measure` does; it needs the length of a pixel
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
import numpy.typing as npt

from doe.measurement.load import load_measurement
from doe.measurement.measurement import Condition
from doe.measurement.piles import pile_files, read_pile
from doe.table_file import CellTable, csv_table, decoded
from explorer.errors import CommandError
from solver import NpzError, npz_arrays
from solver.assets import measurement_folder
from solver.observables.repose import AZIMUTHS_DEG, Flanks, outline
from solver.photograph import PhotographError, Refusal, open_picture, read_photograph
from solver.pours.record import Spheres
from solver.rigs.rotating_drum import RotatingDrum

Array = npt.NDArray[np.float64]

NO_FLANKS: Flanks = (None, None)
PICTURES = (".jpg", ".jpeg", ".png")
SUFFIXES = (".npz", ".csv", *PICTURES)
MOST_BYTES = 50_000_000
MOST_SPHERES, MOST_POINTS = 1_000_000, 100_000
FARTHEST = 2.0
"""No coordinate of a pile is further from the axis than this [m]: the image of a silhouette has pixels of 0.25 mm."""
COLUMNS = ["u_m", "z_m"]


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """A measured line in the plane that a camera looks at along +y: u [m] to the right, z [m] above the plate."""

    name: str
    u: Array
    """Shape (n,), ascending [m]."""
    z: Array
    """Shape (n,) [m]."""
    flanks: Flanks = NO_FLANKS
    """Lines of the flanks, fitted as to a simulated pile, where a scan gives them."""


def measured_curves(name: str) -> dict[str, MeasuredCurve]:
    """Curves of the data set ``name``, shipped or a folder, by what they are called in a list.

    Raises:
        MeasurementError, AssetNotFoundError, CommandError: in one line, for data that cannot be read or show no pile.
    """
    folder = measurement_folder(name)
    measurement = load_measurement(folder)
    scans, _ = pile_files(folder, [condition.name for condition in measurement.conditions])
    found: dict[str, MeasuredCurve] = {}
    for condition in measurement.conditions:
        for curve in (*_scanned(condition, scans[condition.name]), *_observed(condition)):
            found[curve.name] = curve
    if not found:
        raise CommandError(f"{name}: holds no scanned pile, height profile or free surface to draw")
    return found


def _scanned(condition: Condition, scans: dict[int, Path]) -> Iterator[MeasuredCurve]:
    """The silhouette of every scan, in the view that the left and the right angle are read in."""
    for replicate in sorted(scans):
        seen = outline(read_pile(scans[replicate], condition.scene).spheres, AZIMUTHS_DEG[0])
        yield MeasuredCurve(f"{condition.name}: scan {replicate}", seen.u, seen.top, seen.flanks)


def _observed(condition: Condition) -> Iterator[MeasuredCurve]:
    """Curves that stand for a condition: means over its replicates."""
    for name, observation in condition.offered.items():
        if observation.x is None:
            continue
        measured = np.isfinite(observation.values).any(axis=0)
        place, height = observation.x[measured], np.nanmean(observation.values[:, measured], axis=0)
        if name == "height_profile_m":
            # About the axis of the pile, so the same on both sides.
            both = np.concatenate([-place[::-1], place]), np.concatenate([height[::-1], height])
            yield MeasuredCurve(f"{condition.name}: mean height profile", *both)
        elif name == "surface_profile_m" and isinstance(condition.scene.rig, RotatingDrum):
            yield MeasuredCurve(f"{condition.name}: free surface", place, height + condition.scene.rig.radius)


def measured_file(name: str, content: bytes, pixel: float | None = None) -> MeasuredCurve:
    """The curve in the file ``content`` that is called ``name``; CommandError in one line for a bad file.

    ``pixel``: length [m] of a pixel of a photograph.
    """
    if not 0 < len(content) <= MOST_BYTES:
        raise CommandError(f"{name[:80]}: {len(content)} bytes; allowed: up to {MOST_BYTES}")
    readers = {".npz": _scan, ".csv": _points} | dict.fromkeys(PICTURES, partial(_photograph, pixel=pixel))
    read = readers.get(Path(name).suffix.lower())
    if read is None:
        raise CommandError(f"{name[:80]}: allowed: files ending in {', '.join(SUFFIXES)}")
    try:
        return read(name[:80], content)
    except CommandError as error:
        raise CommandError(f"{name[:80]}: {error}") from None


def _scan(name: str, content: bytes) -> MeasuredCurve:
    seen = outline(scanned_spheres(content), AZIMUTHS_DEG[0])
    return MeasuredCurve(name, seen.u, seen.top, seen.flanks)


def scanned_spheres(content: bytes) -> Spheres:
    """The spheres in an .npz file ``content``, all as one body; CommandError in one line for a bad one."""
    try:
        centre, radius = (
            array.astype(np.float64) for array in npz_arrays(content, ("xyz", "radius"), MOST_BYTES).values()
        )
    except NpzError as error:
        raise CommandError(str(error)) from None
    except (TypeError, ValueError):
        raise CommandError("cannot be read as plain arrays of numbers") from None
    if radius.ndim != 1 or centre.shape != (len(radius), 3) or not 1 <= len(radius) <= MOST_SPHERES:
        raise CommandError(f"xyz and radius have shapes {centre.shape} and {radius.shape}; allowed: (n, 3) and (n,)")
    _check_places(centre, "xyz")
    _check_places(radius, "radius")
    if (radius <= 0.0).any():
        raise CommandError("radius: every radius must be positive")
    return Spheres(centre, radius, np.zeros(len(radius), dtype=np.int32))


def _points(name: str, content: bytes) -> MeasuredCurve:
    text = decoded(content)
    if text is None:
        raise CommandError("not a text file")
    table = csv_table(text, lambda line, what: CommandError(f"line {line}: {what}"))
    line, head = table.rows[0] if table.rows else (1, [])
    if head != COLUMNS:
        raise CommandError(f"line {line}: {','.join(head)[:40]!r}; allowed: a line u_m,z_m, and points below it")
    points = np.array([_point(table, line, cells) for line, cells in table.rows[1:]])
    if not 2 <= len(points) <= MOST_POINTS:
        raise CommandError(f"{len(points)} points; allowed: 2 … {MOST_POINTS}")
    _check_places(points, "u_m, z_m")
    ordered = points[np.argsort(points[:, 0], kind="stable")]
    return MeasuredCurve(name, ordered[:, 0], ordered[:, 1])


def _point(table: CellTable, line: int, cells: list[str]) -> list[float]:
    if len(cells) != len(COLUMNS):
        raise CommandError(f"line {line}: {len(cells)} cells; allowed: 2, one each for u_m,z_m")
    point = [table.number(cell) for cell in cells]
    for column, cell, value in zip(COLUMNS, cells, point, strict=True):
        if np.isnan(value):
            raise CommandError(f"line {line}, column {column}: {cell[:40]!r}; allowed: a finite number in m")
    return point


def _photograph(name: str, content: bytes, pixel: float | None) -> MeasuredCurve:
    if pixel is None:
        raise CommandError("a photograph needs its scale: give the millimetres per pixel, then upload it again")
    with NamedTemporaryFile(suffix=Path(name).suffix) as file:
        file.write(content)
        file.flush()
        try:
            seen = read_photograph(open_picture(Path(file.name)), pixel)
        except PhotographError as error:
            raise CommandError(str(error).replace(f"{file.name}: ", "")) from None
    if isinstance(seen, Refusal):
        raise CommandError(f"{seen.reason}: {seen.detail}")
    angle = seen.angles.mean.value_deg
    return MeasuredCurve(f"{name}: {angle:.1f}°", seen.outline.u, seen.outline.top, seen.outline.flanks)


def _check_places(numbers: Array, what: str) -> None:
    if not (np.abs(numbers) <= FARTHEST).all():  # neither does NaN pass
        raise CommandError(f"{what}: a number is not finite or beyond {FARTHEST:g} m")
