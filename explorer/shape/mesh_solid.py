"""A mesh file as the solid of a body: in which unit it is, and whether that can be."""

from __future__ import annotations

from pathlib import Path

from explorer.errors import CommandError
from explorer.tables.shape import mm
from solver.shapes.mesh_file import LENGTH_UNITS
from solver.shapes.solid import Solid, surface_mesh

LEAST_EXTENT, LARGEST_EXTENT = 2e-4, 0.5
"""Longest outer dimension of a body [m], the range of a declared one; outside it the unit is probably another."""
FIXED_UNIT = {".glb": "m"}
"""Unit of a format that fixes one (glTF 2.0, §3.4: metres). The others leave it open."""
USUAL_UNIT = "mm"
MOST_FACES_DRAWN = 20_000
"""A mesh of more faces is not drawn on the page: 80 bodies of it are more than a browser turns smoothly."""


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
            f"{file}: {mm(longest)} mm long with coordinates in {unit}; allowed are {mm(LEAST_EXTENT)} … "
            f"{mm(LARGEST_EXTENT)} mm: is it in another {unit_input} ({', '.join(LENGTH_UNITS)})?"
        )
    return solid
