"""A material from another program's input: `explorer new material NAME --from-liggghts FILE`, and YADE's and EDEM's.

Scripts are read, never run. A number whose convention is another here is converted, and that is told; what has no
counterpart is listed.

found.py      what an input says, its gaps filled by the starter material; arithmetic without running anything
liggghts.py   input scripts
yade.py       Python scripts
edem.py       tables of values
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from explorer.errors import CommandError
from explorer.imported.edem import read_edem
from explorer.imported.found import Found, scene_of
from explorer.imported.liggghts import read_liggghts
from explorer.imported.yade import read_yade
from explorer.scene.starter_files import new_path, write_new
from explorer.scene.text import material_toml
from solver import ParameterError

READERS: Mapping[str, Callable[[Path], Found]] = {"liggghts": read_liggghts, "yade": read_yade, "edem": read_edem}
NEEDED = {
    "liggghts": "fix … property/global youngsModulus peratomtype …",
    "yade": "FrictMat(young=…, poisson=…, density=…, frictionAngle=…)",
    "edem": "a table with Material, Poisson's Ratio, Solids Density, Shear Modulus",
}


def write_imported(folder: Path, name: str, program: str, file: Path) -> tuple[Path, list[str]]:
    """Write ``NAME.toml`` from the input ``file`` of ``program`` (a key of :data:`READERS`); its path, and the notes.

    Raises CommandError in one line where it exists already or the input does not say a material.
    """
    path = new_path(folder, name)
    try:
        found = READERS[program](file)
    except OSError as error:
        raise CommandError(f"{file}: {error.strerror or error}") from None
    if not found.materials:
        raise CommandError(f"{file}: no material found in {program}'s syntax; needed: {NEEDED[program]}")
    try:
        scene = scene_of(found, path)
    except ParameterError as error:
        raise CommandError(f"{file}: {error}") from None
    if scene.assumed:
        found.notes.append(f"not said there, so assumed: {', '.join(scene.assumed)}")
    heading = [f"{path.stem}: read from {program}'s {file.name}. SI.", *found.notes]
    return write_new(path, material_toml(scene, "\n".join(heading))), found.notes
