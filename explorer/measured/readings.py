"""A laboratory's files of one condition → rows of its table, and files that the reader of data sets reads itself.

    photographs       angle_of_repose_deg@0, read again from the pictures whenever the folder is read; with a scale also
                      height_m; of the face of a turning drum dynamic_angle_deg and surface_profile_m, read once
    angles            angle_of_repose_deg; in a drum dynamic_angle_deg, below a draw-down box angle_of_repose_deg@0
    a balance         discharge_time_s; with the time at which the flow was released also t10, t50, t90 and the curve
    scans             height_profile_m in rings of the solver's width, and the surfaces themselves
    a drum's sheet    dynamic_angle_deg, as `explorer lab drum` reads it: the mean of upper and lower angle

The k-th photograph, angle, balance file, scan and row of a sheet belong to pour k.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np
import numpy.typing as npt

from doe.laboratory import analyse
from doe.measurement.photographs import HEIGHT
from doe.measurement.scans import ARRAYS, POINTS, SURFACES, Scan, ScanSettings, read_scan
from doe.table_file import check_cells, read_table
from explorer.errors import CommandError
from explorer.measured.balance import MOST_BYTES, BalanceCurve, read_balance
from explorer.units import fixed
from solver import Scene, pour_rig, poured_mass, without_holes
from solver.assets import asset_path
from solver.observables import observable_names
from solver.observables.free_surface import CHORD
from solver.observables.pile import PROFILE_RING
from solver.observables.surface import radial_profile
from solver.photograph import Picture, Refusal, open_picture, read_drum, read_photograph
from solver.rigs.rotating_drum import RotatingDrum

Array = npt.NDArray[np.float64]
ScanUnit = Literal["m", "cm", "mm", "um"]

ANGLES = ("dynamic_angle_deg", "angle_of_repose_deg", "angle_of_repose_deg@0")
"""Observables for an angle without a name: the first one that the rig gives."""
VIEW, DYNAMIC, FLOWED = "angle_of_repose_deg@0", "dynamic_angle_deg", "discharge_time_s"
SHARES = {"discharge_t10_s": 0.1, "discharge_t50_s": 0.5, "discharge_t90_s": 0.9}
SURFACE = "surface_profile_m"
SURFACE_PLACES = 13
"""Points along a drum's free surface."""
PLACES = 21
"""Points of a curve of discharged mass."""
FLATTEST = 3.0
"""Angle [°] below which a number after --angles is taken for what follows a decimal comma."""
SAME = 0.02
"""Relative difference allowed between the Froude numbers of a drum's sheet and of the rig."""


@dataclass(frozen=True)
class Row:
    """One number of a condition's table; SI, angles in degrees."""

    replicate: int
    observable: str
    value: float
    x: float | None = None


@dataclass(frozen=True, kw_only=True)
class Brought:
    """Files of one condition, in the order of its pours."""

    photographs: tuple[Path, ...] = ()
    pixel: float | None = None
    """Length of a pixel of a photograph [m]."""
    angles: str | None = None
    """24.1,25.0,… or FILE.csv, FILE.csv:COLUMN."""
    balances: tuple[Path, ...] = ()
    starts: tuple[float, ...] = ()
    """When the gate opened or, without a gate, the first body entered: on each balance's clock, or one for all [s]."""
    lag: float | None = None
    """Lag of the balance [s]."""
    scans: tuple[Path, ...] = ()
    scan_unit: ScanUnit = "m"
    drum: str | None = None
    """FILE.csv, FILE.csv:COMPONENT, or the shipped sheet's name."""


@dataclass(frozen=True)
class Readings:
    """What was read: rows, files to keep beside them, and what to tell the user."""

    rows: list[Row] = field(default_factory=list)
    photographs: tuple[Path, ...] = ()
    """Photographs of piles, which are read again with the folder."""
    faces: tuple[Path, ...] = ()
    """Photographs of a drum's face."""
    scans: tuple[Path, ...] = ()
    sources: list[str] = field(default_factory=list)
    """One line on each source, for the head of the table."""
    told: list[str] = field(default_factory=list)

    def add(self, observable: str, values: Sequence[float]) -> None:
        """Add the values of a scalar, one for each pour; those that are not finite were not measured."""
        self.rows.extend(Row(k, observable, value) for k, value in enumerate(values, start=1) if math.isfinite(value))


def read_brought(brought: Brought, scene: Scene) -> Readings:
    """Read everything in ``brought``, from pours in the rig of ``scene``.

    Raises CommandError, MeasurementError or LaboratoryError in one line naming the file, its key and what is allowed.
    """
    given = observable_names(scene)
    drum = scene.rig if isinstance(scene.rig, RotatingDrum) else None
    piles, faces = ((), brought.photographs) if drum else (brought.photographs, ())
    found = Readings(photographs=piles, faces=faces, scans=brought.scans)
    if brought.pixel is not None and not brought.photographs:
        raise CommandError("--scale: allowed only with --photo")
    if brought.photographs and drum:
        _faces(brought, drum, found)
    elif brought.photographs:
        _check("--photo", any(name in given for name in ANGLES[1:]), scene)
        _photographs(brought, found)
    if drum and sum(given is not None for given in (brought.photographs or None, brought.angles, brought.drum)) > 1:
        raise CommandError(f"--photo, --angles, --drum: each gives {DYNAMIC}; allowed: one of them for a condition")
    if piles and brought.angles is not None and next((one for one in ANGLES if one in given), "") == VIEW:
        raise CommandError(f"--photo, --angles: each gives {VIEW}; allowed: one of them for a condition")
    if brought.angles is not None:
        name = next((name for name in ANGLES if name in given), "")
        _check("--angles", bool(name), scene)
        values = _angles(brought.angles)
        found.add(name, values)
        found.sources.append(f"{name}: given as {brought.angles[:80]}")
        found.told.append(f"{len(values)} angles: mean {_mean_and_sd(values)}, taken for {name}")
    if brought.balances:
        _check("--balance", FLOWED in given, scene)
        _balances(brought, scene, found)
    elif brought.starts or brought.lag is not None:
        raise CommandError("--starts, --lag: allowed only with --balance")
    if brought.scans:
        _check("--scan", pour_rig(scene).leaves_heap, scene)
        _scans(brought, found)
    if brought.drum is not None:
        _check("--drum", DYNAMIC in given, scene)
        _drum(brought.drum, scene, found)
    if not found.rows:
        said = "; ".join(found.told) or "give --photo, --angles, --balance, --scan or --drum"
        raise CommandError(f"nothing was measured: {said}")
    return found


def _check(option: str, gives: bool, scene: Scene) -> None:
    if not gives:
        raise CommandError(
            f"{option}: the rig {scene.rig.name} does not give this observable; it gives "
            f"{', '.join(observable_names(scene))}"
        )


def _mean_and_sd(values: Sequence[float]) -> str:
    spread = f", SD {fixed(float(np.std(values, ddof=1)))}°" if len(values) > 1 else ""
    return f"{fixed(float(np.mean(values)))}°{spread}"


def _photographs(brought: Brought, found: Readings) -> None:
    """Read pictures of piles; each has to show a pile, because one without would be a pour without a number."""
    piles = _each(brought.photographs, lambda picture: read_photograph(picture, brought.pixel))
    angles, heights = [one.angles.mean.value_deg for one in piles], [one.height for one in piles]
    found.add(VIEW, angles)
    if brought.pixel is not None:
        found.add(HEIGHT, heights)
    found.sources.append(f"{VIEW}: read off images/, anew whenever this folder is")
    found.told.append(f"{len(angles)} photographs, each of another pour: mean {_mean_and_sd(angles)}")


def _faces(brought: Brought, rig: RotatingDrum, found: Readings) -> None:
    """Read pictures of a drum; each has to show its whole face, whose diameter is the scale."""
    if brought.pixel is not None:
        raise CommandError(
            "--scale: not allowed for pictures of a drum, whose diameter is the scale; state --set rig.diameter"
        )
    drums = _each(brought.photographs, read_drum)
    found.add(DYNAMIC, [one.angle_deg for one in drums])
    radius = rig.radius
    for k, one in enumerate(drums, start=1):
        places = np.linspace(-CHORD, CHORD, SURFACE_PLACES + 2)[1:-1]
        known = np.isfinite(one.height)
        heights = np.interp(places, one.x[known], one.height[known], left=np.nan, right=np.nan)
        found.rows.extend(
            Row(k, SURFACE, float(radius * z), round(float(radius * x), 6))
            for x, z in zip(places, heights, strict=True)
            if np.isfinite(z)
        )
    found.sources.append(f"{DYNAMIC}, {SURFACE}: read off images/ once, by a camera that is taken for level")
    angles, filled = [one.angle_deg for one in drums], [one.filled for one in drums]
    radii = [one.circle.radius for one in drums]
    found.told.append(
        f"{len(drums)} pictures of the drum, each of another run: mean {_mean_and_sd(angles)}, read to ± "
        f"{fixed(max(one.error_deg for one in drums))}° at worst; the drum's radius is {min(radii):.0f} … "
        f"{max(radii):.0f} px, the bed covers {min(filled):.0%} … {max(filled):.0%} of its face, that of the rig at "
        f"rest {rig.fill_level:.0%}; a camera turned by 1° turns every angle by 1°, and one moment scatters more than "
        "the mean over turns that a simulated drum gives"
    )


def _refuse_twins(option: str, files: Sequence[Path]) -> None:
    """Each file has to be of another pour."""
    seen: dict[bytes, Path] = {}
    for file in files:
        if (twin := seen.setdefault(sha256(file.read_bytes()).digest(), file)) is not file:
            what = "picture" if option == "--photo" else "file"
            raise CommandError(f"{option} {file}: is the same {what} as {twin}; take one of another pour")


Reading = TypeVar("Reading")


def _each(files: Sequence[Path], read: Callable[[Picture], Reading | Refusal]) -> list[Reading]:
    """What ``read`` gives for each picture; no two may be the same, as each has to show another pour."""
    _refuse_twins("--photo", files)
    found = []
    for file in files:
        one = read(open_picture(file))
        if isinstance(one, Refusal):
            raise CommandError(f"--photo {file}: no angle: {one.reason}: {one.detail}")
        found.append(one)
    return found


def _angles(text: str) -> list[float]:
    """Angles from ``24.1,25.0`` or from a column of a file."""
    if ".csv" not in text and ".xlsx" not in text:
        parts = text.replace(",", ".").split(";") if ";" in text else text.split(",")
        try:
            values = [float(part) for part in parts]
        except ValueError:
            values = [math.nan]
        if values and min(values) < FLATTEST and ";" not in text:
            raise CommandError(
                f"--angles {text}: {min(values):g}° is no angle of a pile; allowed: such as 24.1,25.0 or, with decimal "
                "commas, 24,1;25,0"
            )
        return _checked_angles(values, f"--angles {text}")
    path, column = _named_part(text)
    table = read_table(path, MOST_BYTES, CommandError, ":{}", comments=True)
    check_cells(table, lambda line, what: CommandError(f"--angles {path}:{line}: {what}"), short=True)
    (line, header), *rows = table.rows or ((1, []),)
    if not column and len(header) == 1:
        column = header[0]
    if header.count(column) != 1:
        raise CommandError(
            f"--angles {path}:{line}: column {column or 'not named'}; allowed: FILE.csv:COLUMN, one of "
            f"{', '.join(header)[:100]}"
        )
    if column.endswith("_rad"):
        raise CommandError(f"--angles {path}:{line}: {column}: allowed: a column in degrees, such as angle_deg")
    place = header.index(column)
    return _checked_angles(
        [table.number(cells[place] if place < len(cells) else "") for _, cells in rows], f"--angles {path}: {column}"
    )


def _checked_angles(values: list[float], where: str) -> list[float]:
    if not values or not all(0.0 < value < 90.0 for value in values):
        raise CommandError(f"{where}: allowed: angles in degrees, above 0 and below 90, one for each pour")
    return values


def _named_part(text: str) -> tuple[Path, str]:
    """Path and part of FILE or FILE:PART."""
    file, _, part = text.rpartition(":")
    return (Path(file), part) if file and not Path(text).exists() else (Path(text), "")


def _balances(brought: Brought, scene: Scene, found: Readings) -> None:
    _refuse_twins("--balance", brought.balances)
    curves = [read_balance(file) for file in brought.balances]
    poured, lag = poured_mass(scene), brought.lag or 0.0
    if not 0.0 <= lag < math.inf:
        raise CommandError(f"--lag {lag:g}: allowed: 0 s or more")
    for curve in curves:
        if curve.total > poured and curve.whole(poured) == poured:
            raise CommandError(
                f"--balance {curve.name}: {1e3 * curve.total:.4g} g passed, but {1e3 * poured:.4g} g is poured; state "
                "the mass, such as --set rig.mass=30g"
            )
        found.told.append(curve.line(poured, brought.lag, bool(brought.starts)))
        if math.isnan(curve.share_time(0.9, poured)):
            if not brought.starts:
                raise CommandError(
                    f"--balance {curve.name}: less than 90 % of {1e3 * poured:.4g} g passed, so that it has no "
                    "duration; leave it out, or state --starts for the times and the curve that it has"
                )
            found.told.append(f"{curve.name}: less than 90 % of it passed, so that it has no t90 and no duration")
    times = {name: [curve.share_time(share, poured) for curve in curves] for name, share in SHARES.items()}
    found.add(FLOWED, [b - a for a, b in zip(times["discharge_t10_s"], times["discharge_t90_s"], strict=True)])
    names = ", ".join(file.name for file in brought.balances)
    found.sources.append(f"{FLOWED}: t90 - t10 of {names}")
    if not brought.starts:
        found.told.append("no --starts: t10, t50, t90 and the curve need the time on the balance's clock of the start")
        return
    if len(brought.starts) not in (1, len(curves)):
        raise CommandError(
            f"--starts: {len(brought.starts)} times; allowed: one, or {len(curves)}, one per balance file"
        )
    starts = brought.starts if len(brought.starts) == len(curves) else brought.starts * len(curves)
    for curve, start in zip(curves, starts, strict=True):
        tenth = curve.share_time(0.1, poured)
        if not curve.time[0] <= start < tenth:
            raise CommandError(
                f"--starts {start:g}: allowed: from {curve.time[0]:g} s, where {curve.name} begins, to {tenth:.4g} s, "
                "where a tenth has passed"
            )
        if not start + lag < tenth:
            raise CommandError(
                f"--lag {lag:g}: allowed: below {tenth - start:.4g} s, from the start to where a tenth of {curve.name} "
                "has passed"
            )
    for name, values in times.items():
        found.add(name, [value - start - lag for value, start in zip(values, starts, strict=True)])
    found.rows.extend(_curves(curves, starts, lag, poured))
    found.sources.append(f"times and curve: from {', '.join(f'{start:g}' for start in starts)} s on its clock on")
    found.sources[-1] += f", less a lag of the balance of {lag:g} s"


def _curves(curves: Sequence[BalanceCurve], starts: Sequence[float], lag: float, poured: float) -> Iterator[Row]:
    """``discharged_mass_kg`` at times common to all ``curves``, until the slowest is complete."""
    ends = [float(curve.time[-1]) - start - lag for curve, start in zip(curves, starts, strict=True)]
    done = [curve.share_time(0.99, curve.total) - start - lag for curve, start in zip(curves, starts, strict=True)]
    for k, (curve, start) in enumerate(zip(curves, starts, strict=True), start=1):
        for x in np.linspace(0.0, min(min(ends), 1.1 * max(done)), PLACES):
            mass = float(np.interp(x + start + lag, curve.time, curve.passed))
            yield Row(k, "discharged_mass_kg", max(0.0, mass), round(float(x), 6))


def _scans(brought: Brought, found: Readings) -> None:
    known = SURFACES + POINTS + ARRAYS
    scans: list[Scan] = []
    _refuse_twins("--scan", [file for file in brought.scans if file.is_file()])
    for file in brought.scans:
        if brought.scan_unit != "m" and file.suffix.lower() in ARRAYS:
            raise CommandError(f"--scan-unit {brought.scan_unit}: {file} states its own units; allowed: other files")
        if file.suffix.lower() not in known or not file.is_file():
            raise CommandError(f"--scan {file}: allowed: an existing file ending in {', '.join(known)}")
        scans.append(read_scan(file, ScanSettings(unit=brought.scan_unit)))
    # A ring is known if every scan extends all around it.
    reach = min(
        float(min(scan.points[:, :2].max(axis=0).min(), -scan.points[:, :2].min(axis=0).max())) for scan in scans
    )
    rings = int(reach / PROFILE_RING)
    if rings < 2:
        raise CommandError(
            f"--scan: reaches {1e3 * reach:.3g} mm around the pile; allowed: {2e3 * PROFILE_RING:g} mm or more"
        )
    for k, (file, scan) in enumerate(zip(brought.scans, scans, strict=True), start=1):
        surface = without_holes(scan.height_map(PROFILE_RING * rings, scan.grid))
        middle, height = radial_profile(surface, PROFILE_RING, rings)
        if np.isnan(height).any():
            raise CommandError(
                f"--scan {file}: its points lie {1e3 * scan.grid:.3g} mm apart, too far for a profile in rings of "
                f"{1e3 * PROFILE_RING:g} mm; allowed: as far as a ring is wide, or less"
            )
        found.rows.extend(
            Row(k, "height_profile_m", float(z), float(r)) for r, z in zip(middle.round(6), height, strict=True)
        )
        found.told.append(f"{file.name}: read in cells of {1e3 * scan.grid:.3g} mm, {1e3 * height.max():.4g} mm high")
    found.sources.append("height_profile_m: rings about the middle of the volume of scans/, bare plate as 0")


def _drum(text: str, scene: Scene, found: Readings) -> None:
    path, component = _named_part(text)
    result = analyse("drum", asset_path("laboratory", str(path)))
    of = list(dict.fromkeys(one.of[0] for one in result.derived))
    component = component or of[0]
    if component not in of or (len(of) > 1 and component == of[0] and ":" not in text):
        raise CommandError(f"--drum {text}: holds {', '.join(of)}; allowed: one of them, FILE.csv:COMPONENT")
    by_name = {one.name: one for one in result.derived if one.of[0] == component}
    angle = by_name.get("dynamic_angle", by_name["dynamic_angle_upper"])
    if missing := [name for name in by_name["dynamic_angle_upper"].replicates if name not in angle.replicates]:
        raise CommandError(
            f"--drum {text}: no lower angle in replicate {', '.join(missing)} of {component}; allowed: one in every "
            "replicate, or in none"
        )
    values = [math.degrees(value) for value in angle.values]
    found.add(DYNAMIC, values)
    found.sources.append(f"{DYNAMIC}: {angle.formula} of {component} in {path.name}")
    found.told.append(f"{len(values)} readings of {component}: mean {_mean_and_sd(values)}, {angle.formula}")
    assert isinstance(scene.rig, RotatingDrum)
    froude = scene.rig.angular_speed**2 * scene.rig.diameter / (2.0 * 9.81)
    stated = by_name["froude_number"].summary.mean if "froude_number" in by_name else froude
    if abs(stated / froude - 1.0) > SAME:
        raise CommandError(
            f"--drum {text}: its Froude number is {stated:.3g}, but that of the rig is {froude:.3g}; state the rig, "
            "such "
            "as --set rig.speed_rpm=5 --set rig.diameter=84mm"
        )
