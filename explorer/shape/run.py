"""`explorer shape`: read a mesh, show the error of its spheres by their number, take a number and save the body."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from explorer.errors import CommandError
from explorer.files.new_file import check_new_file
from explorer.files.whole_file import write_whole
from explorer.scene.body_text import body_text
from explorer.shape.choice import Fitted, fewest, fits, shown_numbers, standard_limit
from explorer.shape.mesh_solid import MOST_FACES_DRAWN, USUAL_UNIT, mesh_solid
from explorer.tables.shape import error_line, heading, mm, solid_line
from solver.shapes.clump import MOST_SPHERES
from solver.shapes.solid import Solid, mass_properties, surface_mesh

USUAL_DENSITY = 1000.0
NAME = re.compile(r"[^\s.\"\\]+")

Echo = Callable[[str], None]


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
            raise CommandError(f"{option} {number}: allowed are 1 … {MOST_SPHERES}")
    if order.limit is not None and order.limit <= 0.0:
        raise CommandError(f"--error {order.limit:g} m: must be positive")
    if not 0.1 <= order.smallest <= 1.0:
        raise CommandError(f"--smallest {order.smallest:g}: allowed are 0.1 … 1")
    if not NAME.fullmatch(order.name):
        raise CommandError(f"--name {order.name!r}: no blank, dot, quote or backslash is allowed, nor nothing at all")
    if order.out is not None:
        check_new_file(order.out, suffix=".toml")


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
            f"--error {mm(limit)} mm: not reached with {order.most} spheres, the least is {mm(best.error.rms)} mm; "
            "allow a larger error, a larger --most or a smaller --smallest"
        )
    return best, f'the least RMS; the {mm(limit)} mm of spheres = "standard" are not reached'


def _write(out: Path, order: ShapeOrder, solid: Solid, taken: Fitted, density: float, faces: int, echo: Echo) -> None:
    drawn = None
    if faces <= MOST_FACES_DRAWN:
        drawn = Path(os.path.relpath(order.file.absolute(), out.absolute().parent))
    text = body_text(order.name, out.name, solid, taken.centres, taken.radii, density, drawn)
    write_whole(out, text)
    how = "the mesh is drawn" if drawn else f"the spheres are drawn, the mesh has more than {MOST_FACES_DRAWN} faces"
    echo(f'wrote {out} ({how}); in a material file: [[body]] with file = "{out.name}", material and mass_fraction')
