"""Scanned surfaces: ``scans/<condition>_<k>.*`` → the height map of replicate k, centred on the axis of the rig.

    .ply .stl           a surface; its facets are sampled
    .xyz .txt .csv      points x, y, z in the first three columns, with or without a header; a comma is a decimal sign
                        where semicolons, tabs or blanks separate the cells
    .npz                height (n, m), x (n,), y (m,); NaN where nothing was seen
    .tif .tiff          16 or 32 bit; one column per x, one row per y, from +y downward; 0 where nothing was seen

``[condition.scan]`` of ``measurement.toml`` states what the files do not (:class:`ScanSettings`).

Only the upper surface is used: in each cell, as wide as the scan's resolution, the mean height of the points within
``SHELL`` cell widths of the highest one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Protocol

import numpy as np
import numpy.typing as npt
from pydantic import ConfigDict
from scipy.spatial import cKDTree

from doe.errors import MeasurementError
from doe.table_file import decoded
from solver import TABLE, HeightMap, ParameterError, Quantity, Vector, npz_arrays

Array = npt.NDArray[np.float64]

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
SURFACES, POINTS, ARRAYS, IMAGES = (".ply", ".stl"), (".xyz", ".txt", ".csv"), (".npz",), (".tif", ".tiff")
SUFFIXES = (*SURFACES, *POINTS, *ARRAYS, *IMAGES)
"""File name suffixes of scans."""
AXIS_ERROR = 1.5e-3
"""Error [m] of a rig's axis in the scanner's coordinates where none is stated: that of locating a plumb bob's tip."""
MOST_BYTES = 300_000_000
MOST_POINTS = 20_000_000
SHELL = 2.0
"""Depth below the highest point of a cell, in cells, within which points count as upper surface."""
FEWEST = 200
"""Least number of points in a scan."""
PLATE_SHARE, PLATE_DEPTH = 0.2, 0.05
"""Share of the points that must lie on the bare plate for it to be found, and how far from it they may lie, as a
share of the scan's height."""
PROBED = 200
"""Rows at the end of a table that are looked at for what divides its cells."""
NEIGHBOURS, REGULAR = 4, 1.05
"""Points next to one on a square grid, and how much farther than the nearest the last of them may be, in a grid."""
ROUNDS = 30


@dataclass(frozen=True)
class ScanSettings:
    """What ``[condition.scan]`` says of the scans of a condition; lengths in metres, or with a unit."""

    __pydantic_config__: ClassVar[ConfigDict] = TABLE

    unit: Literal["m", "cm", "mm", "um"] = "m"
    """Unit of surfaces and points."""
    pixel: Annotated[float, Quantity("m", above=0.0)] | None = None
    """Images: size of a pixel."""
    step: Annotated[float, Quantity("m", above=0.0)] | None = None
    """Images: height of one count."""
    plate: Annotated[tuple[float, float, float], Vector(3)] | None = None
    """The plate z = a + b x + c y, in metres; found from the bare plate in the scan where not stated."""
    axis: Annotated[tuple[float, float], Vector(2)] | None = None
    """The rig's axis in the scan's coordinates, in metres; without it the centre of the volume stands for it, and
    nothing that depends on the axis (where the pile leans to) is read."""
    axis_error: Annotated[float, Quantity("m", above=0.0)] = AXIS_ERROR
    """Standard deviation of each coordinate of the axis."""
    grid: Annotated[float, Quantity("m", above=0.0)] | None = None
    """Resolution; by default that of the points (:func:`spacing`)."""
    noise: Annotated[float, Quantity("m", above=0.0)] | None = None
    """Standard deviation of one height, where it is known."""


class UpperSurface(Protocol):
    """A pile as seen from above."""

    @property
    def grid(self) -> float:
        """Resolution [m]; 0 where it is unlimited."""

    @property
    def axis(self) -> tuple[float, float] | None:
        """Where the rig's axis is said to be in the scanner's coordinates [m]; None if it is not known."""

    @property
    def axis_error(self) -> float:
        """Standard deviation of each coordinate of the axis [m]."""

    @property
    def noise(self) -> float:
        """Standard deviation of a height [m]; 0 where none is stated."""

    def height_map(self, half_width: float, pixel: float) -> HeightMap:
        """Heights within ``half_width`` [m] of the axis in pixels of ``pixel`` [m]; NaN where nothing was seen."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Points of an upper surface [m]: x, y about the axis of the rig, z above the plate."""

    points: Array
    """(n, 3)"""
    grid: float
    """Resolution [m]: width of the cells in which the points are read."""
    axis: tuple[float, float] | None
    """Where the axis is said to be in the file's coordinates [m]; if None, x and y are relative to the centre of the
    volume."""
    axis_error: float = AXIS_ERROR
    """Standard deviation of each coordinate of the axis [m]."""
    noise: float = 0.0
    """Standard deviation of a height [m]."""

    def height_map(self, half_width: float, pixel: float) -> HeightMap:
        """The upper surface within ``half_width`` [m] in pixels of ``pixel`` [m]; NaN where nothing was seen."""
        n = 2 * int(np.ceil(half_width / pixel - 1e-9))
        place = np.floor(self.points[:, :2] / pixel + n / 2).astype(np.int64)
        inside = ((place >= 0) & (place < n)).all(axis=1)
        cell, z = place[inside, 0] * n + place[inside, 1], self.points[inside, 2]
        top = np.full(n * n, -np.inf)
        np.maximum.at(top, cell, z)
        near = z >= top[cell] - SHELL * pixel
        count = np.bincount(cell[near], minlength=n * n)
        total = np.bincount(cell[near], weights=z[near], minlength=n * n)
        height = np.full(n * n, np.nan)
        height[count > 0] = total[count > 0] / count[count > 0]
        return HeightMap.of(height.reshape(n, n), pixel)


def scan_files(folder: Path, conditions: Iterable[str]) -> tuple[dict[str, dict[int, Path]], tuple[Path, ...]]:
    """Return the files of ``folder/scans`` by condition and replicate, and those that belong to no condition."""
    return replicate_files(folder / "scans", conditions, lambda suffix: suffix.lower() in SUFFIXES)


def replicate_files(
    folder: Path, conditions: Iterable[str], known: Callable[[str], bool]
) -> tuple[dict[str, dict[int, Path]], tuple[Path, ...]]:
    """Return files ``<condition>_<k>`` of a ``known`` suffix by condition and replicate, and the others of ``folder``.

    Raises MeasurementError for two files of one replicate.
    """
    found: dict[str, dict[int, Path]] = {name: {} for name in conditions}
    strangers = []
    for path in sorted(folder.glob("*")):
        name, _, replicate = path.stem.rpartition("_")
        if known(path.suffix) and name in found and replicate.isdecimal() and int(replicate) >= 1:
            if int(replicate) in found[name]:
                raise MeasurementError(f"{path}: replicate {int(replicate)} has more than one scan; allowed: one file")
            found[name][int(replicate)] = path
        else:
            strangers.append(path)
    return found, tuple(strangers)


def read_scans(files: Mapping[int, Path], settings: ScanSettings) -> dict[int, Scan]:
    """Read scans by replicate; raises MeasurementError with one line that names the file."""
    return {replicate: read_scan(path, settings) for replicate, path in files.items()}


def read_scan(path: Path, settings: ScanSettings) -> Scan:
    """Read one scan, with heights above the plate and x, y relative to the axis."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise MeasurementError(f"{path.stat().st_size / 1e6:.0f} MB; allowed: up to {MOST_BYTES / 1e6:.0f} MB")
        points, grid = _points(path, settings)
        points = points[np.isfinite(points).all(axis=1)]
        if not FEWEST <= len(points) <= MOST_POINTS:
            raise MeasurementError(f"{len(points)} finite points; allowed: {FEWEST} to {MOST_POINTS}")
        a, b, c = settings.plate or found_plate(points)
        points = points - [0.0, 0.0, a]
        points[:, 2] -= points[:, :2] @ [b, c]
        # Heights are taken along the plate's normal; the few degrees of a scanner's frame change x and y by less
        # than a thousandth.
        points[:, 2] /= np.sqrt(1.0 + b * b + c * c)
        given = settings.grid or grid
        near, fourth = (given, given) if given else _distances(points)
        points[:, :2] -= settings.axis if settings.axis is not None else _volume_centre(points, near)
        grid = _cell(near, fourth)
    except MeasurementError as error:
        raise MeasurementError(f"{path}: {error}") from None
    except (OSError, ParameterError) as error:
        raise MeasurementError(f"{path}: cannot be read ({' '.join(str(error).split())[:120]})") from None
    return Scan(points, grid, settings.axis, settings.axis_error, settings.noise or 0.0)


def found_plate(points: Array) -> tuple[float, float, float]:
    """Return the bare plate z = a + b x + c y of ``points`` (n, 3) [m]: the plane of the lowest points.

    Least squares, repeated with the points within three scaled median deviations of the previous plane. Raises
    MeasurementError if less than ``PLATE_SHARE`` of the points lie on it.
    """
    middle = points[:, :2].mean(axis=0)
    low = points[points[:, 2] <= np.quantile(points[:, 2], 0.3)]
    plane, most = np.zeros(3), PLATE_DEPTH * float(np.ptp(points[:, 2]))
    for _ in range(ROUNDS):
        design = np.column_stack([np.ones(len(low)), low[:, :2] - middle])
        plane = np.linalg.lstsq(design, low[:, 2], rcond=None)[0]
        off = points[:, 2] - plane[0] - (points[:, :2] - middle) @ plane[1:]
        below = off[off < 0.0]
        # Points below the plane are noise of the plate; points above it may be grains.
        within = min(most, 3.0 * max(1.4826 * float(np.median(-below)) if below.size else 0.0, 1e-6))
        chosen = points[np.abs(off) <= within]
        if len(chosen) < 3 or (len(chosen) == len(low) and np.array_equal(chosen, low)):
            break
        low = chosen
    share = len(low) / len(points)
    if share < PLATE_SHARE:
        raise MeasurementError(
            f"no bare plate found (only {share:.0%} of the points lie in one plane); state scan.plate = [a, b, c]"
        )
    return float(plane[0] - plane[1:] @ middle), float(plane[1]), float(plane[2])


def spacing(points: Array) -> float:
    """Return the width of the cells [m] in which ``points`` are read, from about a thousand of them.

    Of a regular grid, where four neighbours are equally near in the plane, it is the median distance of a point to the
    nearest. Of a cloud it is twice that to the fourth: cells as narrow as the nearest would mostly be empty, and 1 % of
    these are (4.8 points in a cell at random places).
    """
    return _cell(*_distances(points))


def _cell(nearest: float, fourth: float) -> float:
    return nearest if fourth <= REGULAR * nearest else 2.0 * fourth


def _distances(points: Array) -> tuple[float, float]:
    """Median distances in the plane of a point to the nearest other one and to the fourth [m]; 0 without."""
    some = points[:: max(1, len(points) // 1000), :2]
    distance = cKDTree(points[:, :2]).query(some, k=1 + NEIGHBOURS)[0][:, 1:]
    distance = distance[np.isfinite(distance[:, -1]) & (distance[:, 0] > 0.0)]
    return (float(np.median(distance[:, 0])), float(np.median(distance[:, -1]))) if len(distance) else (0.0, 0.0)


def _volume_centre(points: Array, near: float) -> Array:
    """Horizontal centre (x, y) of the volume above the plate; the points have a uniform density, and the nearest are
    ``near`` [m].
    """
    height = np.where(points[:, 2] > 2.0 * near, points[:, 2], 0.0)
    if height.sum() <= 0.0:
        raise MeasurementError("nothing lies on the plate; state scan.axis = [x, y]")
    return np.asarray(height @ points[:, :2] / height.sum(), dtype=np.float64)


def _points(path: Path, settings: ScanSettings) -> tuple[Array, float | None]:
    """Points (n, 3) [m], and the spacing [m] where the file gives one."""
    suffix = path.suffix.lower()
    if suffix in SURFACES:
        surface, resolution = _of_surface(path)
        return surface * UNITS[settings.unit], resolution * UNITS[settings.unit]
    if suffix in POINTS:
        return _of_table(path) * UNITS[settings.unit], None
    if suffix in ARRAYS:
        return _of_arrays(path)
    return _of_image(path, settings)


def _of_surface(path: Path) -> tuple[Array, float]:
    """The vertices of a surface, points on its facets, and the spacing of the vertices, in the unit of the file."""
    import trimesh

    try:
        found: Any = trimesh.load(path, process=False)
        parts = list(found.geometry.values()) if isinstance(found, trimesh.Scene) else [found]
        corners = np.concatenate([np.asarray(part.vertices, dtype=np.float64) for part in parts])
        facets = [np.asarray(part.triangles) for part in parts if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    except Exception as error:  # the readers of a damaged file raise anything from KeyError to struct.error
        raise MeasurementError(f"cannot be read ({' '.join(str(error).split())[:120]})") from None
    if len(corners) < 3:
        raise MeasurementError(f"{len(corners)} points; allowed: {FEWEST} to {MOST_POINTS}")
    # An STL file repeats a corner for every facet.
    resolution = spacing(np.unique(corners, axis=0))
    if not facets:
        return corners, resolution
    return np.concatenate([corners, *(_sampled(one) for one in facets)]), resolution


def _sampled(triangles: Array) -> Array:
    """Points in triangles (n, 3, 3), dense enough that neighbours are no further apart than the median edge."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    longest = np.max([np.linalg.norm(b - a, axis=1), np.linalg.norm(c - b, axis=1), np.linalg.norm(a - c, axis=1)], 0)
    edge = max(float(np.median(longest)), float(np.ptp(triangles.reshape(-1, 3), axis=0).max()) / 1000.0)
    parts = np.clip(np.ceil(longest / edge), 1, 1000).astype(np.int64)
    found = []
    for k in np.unique(parts):
        some = parts == k
        # Barycentric points of a triangle cut into k² equal ones.
        steps = [(i, j) for i in range(k + 1) for j in range(k + 1 - i)]
        weight = np.array([(k - i - j, i, j) for i, j in steps], dtype=np.float64) / k
        if len(weight) * int(some.sum()) > MOST_POINTS:
            raise MeasurementError("its facets differ too much in size; allowed: facets of similar size")
        found.append(np.einsum("pk,tkd->tpd", weight, triangles[some]).reshape(-1, 3))
    return np.concatenate(found)


def _of_table(path: Path) -> Array:
    """The first three columns of a table of numbers, separated by commas, semicolons, tabs or blanks."""
    text = decoded(path.read_bytes())
    if text is None:
        raise MeasurementError("not a text file")
    rows = [row for line in text.splitlines() if (row := line.strip()) and not row.startswith("#")]
    # A row with as many cells filled as any tells what divides them.
    probe = max(reversed(rows[-PROBED:]), key=lambda row: len(row.replace(";", " ").split()), default="")
    decimal_comma = _decimal_comma(probe)
    delimiter = next((sign for sign in (";\t" if decimal_comma else ";,\t") if sign in probe), None)
    if delimiter:
        # A cell may be empty: a height that the scanner did not see.
        cells = ([cell.strip() or "nan" for cell in row.split(delimiter)] for row in rows)
        rows = [" ".join(row + ["nan"] * (3 - len(row))) for row in cells]
    if decimal_comma:
        rows = [row.replace(",", ".") for row in rows]
    if rows and not _numeric(rows[0]):
        rows = rows[1:]
    try:
        found = np.loadtxt(rows, usecols=(0, 1, 2), ndmin=2)
    except (ValueError, IndexError) as error:
        raise MeasurementError(f"no table of x, y, z ({' '.join(str(error).split())[:100]})") from None
    return np.asarray(found, dtype=np.float64)


def _decimal_comma(row: str) -> bool:
    """Whether a comma in ``row`` is a decimal sign, because something else separates the cells."""
    cells = row.split()
    return ";" in row or (len(cells) >= 3 and all(cell.count(",") == cell.strip(",").count(",") <= 1 for cell in cells))


def _numeric(row: str) -> bool:
    try:
        return len([float(cell) for cell in row.split()[:3]]) == 3
    except ValueError:
        return False


def _of_arrays(path: Path) -> tuple[Array, float]:
    try:
        height, x, y = (array.astype(np.float64) for array in npz_arrays(path, ("height", "x", "y")).values())
    except (TypeError, ValueError) as error:
        raise MeasurementError(str(error)) from None
    if x.ndim != 1 or y.ndim != 1 or height.shape != (x.size, y.size) or min(height.shape) < 2:
        raise MeasurementError(
            f"height, x, y: shapes {height.shape}, {x.shape}, {y.shape}; allowed: (n, m), (n,), (m,)"
        )
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    grid = float(max(np.abs(np.diff(x)).max(), np.abs(np.diff(y)).max()))
    return np.concatenate([places, height[:, :, None]], axis=-1).reshape(-1, 3), grid


def _of_image(path: Path, settings: ScanSettings) -> tuple[Array, float]:
    from PIL import Image, UnidentifiedImageError

    if settings.pixel is None or settings.step is None:
        raise MeasurementError("scan.pixel or scan.step: missing; an image needs both for its scale")
    try:
        with Image.open(path) as image:
            if image.width * image.height > MOST_POINTS:
                raise MeasurementError(f"{image.width} × {image.height} pixels; allowed: up to {MOST_POINTS} in all")
            if not image.mode.startswith(("I", "F")):
                raise MeasurementError(f"an image of mode {image.mode}; allowed: one channel of 16 or 32 bits")
            counts = np.asarray(image, dtype=np.float64)
    except Image.DecompressionBombError:
        raise MeasurementError(
            f"more than {2 * (Image.MAX_IMAGE_PIXELS or 0)} pixels; allowed: up to {MOST_POINTS} in all"
        ) from None
    except (UnidentifiedImageError, OSError, ValueError) as error:
        if isinstance(error, MeasurementError):
            raise
        raise MeasurementError(f"cannot be read as an image ({' '.join(str(error).split())[:100]})") from None
    rows, columns = counts.shape
    x = (np.arange(columns) + 0.5 - columns / 2) * settings.pixel
    y = -(np.arange(rows) + 0.5 - rows / 2) * settings.pixel
    places = np.stack(np.meshgrid(x, y), axis=-1)
    # 0 is what the scanner has not seen; a plate at 0 scatters to both sides.
    height = np.where(np.isfinite(counts) & (counts != 0.0), counts * settings.step, np.nan)
    return np.concatenate([places, height[:, :, None]], axis=-1).reshape(-1, 3), settings.pixel
