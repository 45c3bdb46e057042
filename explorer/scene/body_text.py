"""The file of a body that is declared by its spheres: what `explorer shape` writes and a material file takes in."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from solver.shapes.clump_error import measured_fit
from solver.shapes.solid import Solid, mass_properties

Array = npt.NDArray[np.float64]

DIGITS = 9
"""Significant digits: a nanometre on a metre."""


def body_text(
    name: str,
    file: str,
    solid: Solid,
    centres: Array,
    radii: Array,
    density: float,
    drawn: Path | None,
) -> str:
    """Text of a body file.

    Args:
        name: of the body.
        file: name of the body file.
        solid: the mesh that the spheres stand for.
        centres: (n, 3) in its principal frame [m].
        radii: (n,) [m].
        density: [kg/m3] of the mass that is written.
        drawn: path of the mesh as seen from the body file; None to draw the spheres instead.
    """
    true, fit = mass_properties(solid, density), measured_fit(solid, centres, radii)
    size = " × ".join(f"{1e3 * extent:.4g}" for extent in true.extents)
    mesh = ""
    if drawn is not None:
        mesh = f"mesh = {json.dumps(drawn.as_posix())}   # drawn instead of the spheres\n"
        mesh += f"unit = {json.dumps(solid.unit)}\n"
    rows = ",\n".join(f"    [{_numbers(centre)}]" for centre in centres)
    numbers = {
        "volume_ratio": fit.volume_ratio,
        "covered_ratio": fit.covered_ratio,
        "surface_rms": fit.surface_rms,
        "surface_max": fit.surface_max,
    }
    stated = ", ".join(f"{key} = {number:.4g}" for key, number in numbers.items())
    errors = ", ".join(f"{error:.4g}" for error in fit.extent_errors)
    return f"""\
# Body {name}: {len(radii)} spheres for {Path(solid.file).name} ({size} mm). SI.
# In a material file: [[body]] with file = "{file}", material and mass_fraction; or copy the table below.
# Frame: centre of mass and principal axes of the mesh. Mass and inertia are those of the mesh, not of the spheres, and
# follow the density of the material that the body is made of.

format = 1

[[body]]
name = {json.dumps(name)}
density = {density:.{DIGITS}g}   # [kg/m3], at which mass and inertia hold
mass = {true.mass:.{DIGITS}g}   # [kg]
inertia = [{_numbers(true.inertia)}]   # principal moments [kg m2]
{mesh}fit = {{ {stated}, extent_errors = [{errors}] }}
sphere_centres = [   # [m]
{rows},
]
sphere_radii = [{_numbers(radii)}]   # [m]
"""


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.{DIGITS}g}" for value in values)
