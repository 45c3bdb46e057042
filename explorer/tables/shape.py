"""The table of `explorer shape`: how far the spheres are from the mesh, by their number."""

from __future__ import annotations

from explorer.tables.text_table import table_line
from solver.shapes.clump_error import SphereError
from solver.shapes.solid import MassProperties

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


def mm(length: float | None) -> str:
    """A length [m] in millimetres, four digits; a dash for none."""
    if length is None:
        return "-"
    return f"{1e3 * length:.4g}" if length < 1.0 else f"{1e3 * length:.0f}"


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
