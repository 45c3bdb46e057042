"""`explorer shape`: a mesh becomes the spheres of a body, and how many spheres are good enough.

The mesh is read in a unit that the file may leave open, and refused where it is no body's size. A table shows how far
the spheres are from the mesh, by their number; the fewest that are near enough are taken, and the body is saved.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from explorer.errors import CommandError
from explorer.files.output_file import check_new_file, write_whole
from explorer.scene.text import body_text
from explorer.terminal.text_table import table_line
from solver.shapes.clump import DEMANDS, MOST_SPHERES
from solver.shapes.clump_error import SphereError, sphere_error
from solver.shapes.mesh_file import LENGTH_UNITS
from solver.shapes.solid import MassProperties, Solid, mass_properties, surface_mesh
from solver.shapes.sphere_number import doubling, fitted

Array = npt.NDArray[np.float64]
Echo = Callable[[str], None]

QUARTERS = 4
COLUMNS = {
    "spheres": -7,
    "RMS mm": -8,
    "largest mm": -10,
    "covered %": -9,
    "volume mm3": -10,
    "mass g": -10,
    "Ix g mm2": -10,
    "Iy g mm2": -10,
    "Iz g mm2": -10,
    "smallest mm": -11,
}
"""Heading → width. Distances between mesh and spheres, larger of the two ways; mass and inertia if the spheres were the
body; radius of the smallest sphere."""
LEAST_EXTENT, LARGEST_EXTENT = 2e-4, 0.5
"""Longest outer dimension of a body [m], the range of a declared one; outside it the unit is probably another."""
FIXED_UNIT = {".glb": "m"}
"""Unit of a format that fixes one (glTF 2.0, §3.4: metres). The others leave it open."""
USUAL_UNIT = "mm"
MOST_FACES_DRAWN = 20_000
"""A mesh of more faces is not drawn on the page: 80 bodies of it are more than a browser turns smoothly."""
USUAL_DENSITY = 1000.0
NAME = re.compile(r"[^\s.\"\\]+")


@dataclass(frozen=True)
class ShapeOrder:
    """What is asked for. None: by the rule of this file. Lengths [m], density [kg/m3]."""

    file: Path
    unit: str | None
    density: float | None
    name: str
    out: Path | None
    number: int | None
    limit: float | None
    most: int
    smallest: float


def run_shape(order: ShapeOrder, echo: Echo) -> None:
    """Print the table as it grows, and write ``order.out``.

    Raises CommandError or ShapeError, in one line, for options that are not allowed, a file that holds no solid, and a
    limit that no number reaches.
    """
    _check(order)
    solid = mesh_solid(order.file, order.unit, unit_input="--unit")
    density = USUAL_DENSITY if order.density is None else order.density
    true = mass_properties(solid, density)
    faces = len(surface_mesh(solid).faces)
    size = " × ".join(mm(extent) for extent in true.extents)
    named = "" if order.unit or solid.unit != USUAL_UNIT else ", which the file does not say: --unit changes it"
    echo(f"{order.file}: {faces} faces, {size} mm; coordinates in {solid.unit}{named}")
    assumed = ", assumed: --density changes it" if order.density is None else ""
    echo(f"mass and inertia at {density:g} kg/m3{assumed}\n")
    echo(heading())
    echo(solid_line(true))
    rows: dict[int, Fitted] = {}
    numbers = shown_numbers(order.most, order.number)
    for number, fit in zip(numbers, fits(solid, numbers, order.smallest), strict=True):
        rows[number] = fit
        echo(error_line(fit.error, density))
    taken, reason = _taken(order, solid, rows, lambda fit: echo(error_line(fit.error, density)))
    echo(f"\n{taken.error.number} spheres taken: {reason}")
    if order.out is not None:
        _write(order.out, order, solid, taken, density, faces, echo)


def _check(order: ShapeOrder) -> None:
    if order.number is not None and order.limit is not None:
        raise CommandError("--spheres and --error exclude each other")
    for option, number in (("--spheres", order.number), ("--most", order.most)):
        if number is not None and not 1 <= number <= MOST_SPHERES:
            raise CommandError(f"{option} {number}; allowed: 1 … {MOST_SPHERES}")
    if order.limit is not None and order.limit <= 0.0:
        raise CommandError(f"--error {order.limit:g} m: must be positive")
    if not 0.1 <= order.smallest <= 1.0:
        raise CommandError(f"--smallest {order.smallest:g}; allowed: 0.1 … 1")
    if not NAME.fullmatch(order.name):
        raise CommandError(
            f"--name {order.name!r}: allowed: at least one character, without blanks, dots, quotes and backslashes"
        )
    if order.out is not None:
        check_new_file(order.out, suffix=".toml")


def mesh_solid(file: Path, unit: str | None, unit_input: str) -> Solid:
    """The solid in ``file``, its coordinates in ``unit``; None: that of the format, or millimetres.

    ``unit_input``: what a person changes the unit with, for the message. Raises ShapeError for a file that holds no
    solid, and CommandError for one that is too large or too small.
    """
    unit = unit or FIXED_UNIT.get(file.suffix.lower(), USUAL_UNIT)
    solid = Solid("mesh", file=str(file), unit=unit)
    longest = float(surface_mesh(solid).extents.max())
    if not LEAST_EXTENT <= longest <= LARGEST_EXTENT:
        raise CommandError(
            f"{file}: {mm(longest)} mm long with coordinates in {unit}; allowed: {mm(LEAST_EXTENT)} … "
            f"{mm(LARGEST_EXTENT)} mm: is it in another {unit_input} ({', '.join(LENGTH_UNITS)})?"
        )
    return solid


@dataclass(frozen=True, eq=False)
class Fitted:
    """Member spheres in the principal frame [m] and what they get wrong."""

    centres: Array
    radii: Array
    error: SphereError


def shown_numbers(most: int, wanted: int | None) -> list[int]:
    """1, 2, 4, … ``most``, and the number that is ``wanted``."""
    return sorted({*doubling(most)} | ({wanted} if wanted is not None else set()))


def fits(solid: Solid, numbers: list[int], least_radius: float) -> Iterator[Fitted]:
    """Fits for ascending ``numbers`` of spheres, one after the other."""
    for centres, radii in fitted(solid, numbers, least_radius):
        yield Fitted(centres, radii, sphere_error(solid, centres, radii))


def _taken(
    order: ShapeOrder, solid: Solid, rows: dict[int, Fitted], show: Callable[[Fitted], None]
) -> tuple[Fitted, str]:
    if order.number is not None:
        fit = rows[order.number]
        idle = order.number - fit.error.number
        return fit, "--spheres" + (f", less {idle} that no part of the surface would have been next to" if idle else "")
    limit = standard_limit(solid) if order.limit is None else order.limit
    found = fewest(solid, rows, limit, order.smallest, show)
    best = min(rows.values(), key=lambda fit: fit.error.rms)
    if found is not None:
        asked = "--error" if order.limit is not None else 'as for spheres = "standard"; --spheres or --error change it'
        return found, f"the fewest tried with an RMS of at most {mm(limit)} mm ({asked})"
    if order.limit is not None:
        raise CommandError(
            f"--error {mm(limit)} mm: not reached with {order.most} spheres; the smallest is {mm(best.error.rms)} mm; "
            "allow a larger error, a larger --most or a smaller --smallest"
        )
    return best, f'the least RMS; the {mm(limit)} mm of spheres = "standard" are not reached'


def standard_limit(solid: Solid) -> float:
    """RMS distance [m] that ``spheres = "standard"`` asks for: 3.1 % of the diameter of the ball of equal volume."""
    volume = mass_properties(solid, 1.0).volume
    return float(DEMANDS["standard"].rms * np.cbrt(6.0 * volume / np.pi))


def fewest(
    solid: Solid, rows: dict[int, Fitted], limit: float, least_radius: float, show: Callable[[Fitted], None]
) -> Fitted | None:
    """The fit of fewest spheres with an RMS distance of at most ``limit`` [m]; None if none of ``rows`` has it.

    ``rows`` are fits by the number asked for. Between the first that is good enough and the one before it, the numbers
    at the quarters are tried as well, and handed to ``show``.
    """
    good = next((number for number in sorted(rows) if rows[number].error.rms <= limit), None)
    if good is None:
        return None
    below = max((number for number in rows if number < good), default=good)
    between = sorted({below + (good - below) * k // QUARTERS for k in range(1, QUARTERS)} - {below, good})
    if not between:
        return rows[good]
    asked = [number for number in sorted(rows) if number <= below] + between
    for number, (centres, radii) in zip(asked, fitted(solid, asked, least_radius), strict=True):
        if number in between:
            found = Fitted(centres, radii, sphere_error(solid, centres, radii))
            show(found)
            if found.error.rms <= limit:
                return found
    return rows[good]


def _write(out: Path, order: ShapeOrder, solid: Solid, taken: Fitted, density: float, faces: int, echo: Echo) -> None:
    drawn = None
    if faces <= MOST_FACES_DRAWN:
        drawn = Path(os.path.relpath(order.file.absolute(), out.absolute().parent))
    text = body_text(order.name, out.name, solid, taken.centres, taken.radii, density, drawn)
    write_whole(out, text)
    how = "the mesh is drawn" if drawn else f"the spheres are drawn, the mesh has more than {MOST_FACES_DRAWN} faces"
    echo(f'wrote {out} ({how}); in a material file: [[body]] with file = "{out.name}", material and mass_fraction')


def heading() -> str:
    """First line."""
    return table_line(list(COLUMNS), list(COLUMNS.values()))


def solid_line(true: MassProperties) -> str:
    """What the spheres stand for."""
    return _line("mesh", None, None, 1.0, true.volume, true.mass, list(true.inertia), None)


def error_line(error: SphereError, density: float) -> str:
    """One fit; masses at ``density`` [kg/m3]."""
    return _line(
        str(error.number),
        error.rms,
        error.largest,
        error.covered,
        error.volume,
        density * error.volume,
        [density * second for second in error.second],
        error.smallest_radius,
    )


def _line(
    name: str,
    rms: float | None,
    largest: float | None,
    covered: float,
    volume: float,
    mass: float,
    inertia: list[float],
    smallest: float | None,
) -> str:
    moments = [f"{1e9 * moment:.4g}" for moment in inertia]
    row = [name, mm(rms), mm(largest), f"{100 * covered:.1f}", f"{1e9 * volume:.4g}", f"{1e3 * mass:.4g}"]
    return table_line([*row, *moments, mm(smallest)], list(COLUMNS.values()))


def mm(length: float | None) -> str:
    """A length [m] in millimetres, four digits; a dash for none."""
    if length is None:
        return "-"
    return f"{1e3 * length:.4g}" if length < 1.0 else f"{1e3 * length:.0f}"
