"""A bed of spheres in a box with a floor and four walls, for timing engines on the same state.

Both engines read it as plain spheres, not clumps. They stop after a number of steps, print the time of their stepping
loop and write ``final.txt`` (see ``frames.py``). Contacts begin without tangential springs in both.
"""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from explorer.export.liggghts import (
    INPUT,
    WRITE_FINAL,
    ContactSettings,
    FreeSpheres,
    gravity_lines,
    run_lines,
    settings_lines,
    write_spheres,
)
from explorer.export.yade import SCRIPTS, write_law

Array = npt.NDArray[np.float64]
SKIN = 0.4
"""Reach of LIGGGHTS's contact list beyond touching, in radii of the largest sphere."""
DATA, SCRIPT = "spheres.data", "yade_bed.py"


@dataclass(frozen=True)
class Bed:
    """Spheres (n of them) of one material in a box of the same material, open at the top."""

    position: Array
    """Centres [m], shape (n, 3)."""
    radius: Array
    """[m], shape (n,)."""
    velocity: Array
    """[m/s], shape (n, 3)."""
    low: tuple[float, float, float]
    """Corner of the box; the floor is at ``low[2]`` [m]."""
    high: tuple[float, float, float]
    """Opposite corner [m]; the sides are infinite and there is no lid."""
    dt: float
    """[s]."""
    steps: int
    density: float = 2500.0
    shear_modulus: float = 1e7
    poisson_ratio: float = 0.25
    friction: float = 0.5
    restitution: float = 0.5
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)

    @property
    def youngs_modulus(self) -> float:
        """E = 2 G (1 + ν) [Pa]."""
        return 2.0 * self.shear_modulus * (1.0 + self.poisson_ratio)


def write_liggghts_bed(folder: Path, bed: Bed) -> None:
    """Write ``in.liggghts`` and ``spheres.data`` into ``folder``; run it with ``run_liggghts``."""
    table = np.full((2, 2), bed.restitution), np.full((2, 2), bed.friction)
    largest = float(bed.radius.max())
    room = np.array([np.array(bed.low) - 4.0 * largest, np.array(bed.high) + 4.0 * largest])
    settings, law = settings_lines(room, 2, SKIN * largest), ContactSettings()
    walls = [
        law.plane_line("low_x", 2, "x", bed.low[0]),
        law.plane_line("high_x", 2, "x", bed.high[0]),
        law.plane_line("low_y", 2, "y", bed.low[1]),
        law.plane_line("high_y", 2, "y", bed.high[1]),
        law.plane_line("floor", 2, "z", bed.low[2]),
    ]
    lines = [
        f"# {len(bed.radius)} spheres, {bed.steps} steps of {bed.dt:.6g} s",
        *[line for line in settings if not line.startswith(("region", "create_box"))],
        f"read_data {DATA}",
        *law.pair_lines([bed.youngs_modulus] * 2, [bed.poisson_ratio] * 2, *table),
        *gravity_lines(bed.gravity),
        *walls,
        "fix motion all nve/sphere",
        *run_lines(bed.steps, bed.dt),
        f"run {bed.steps}",
        WRITE_FINAL,
    ]
    (folder / INPUT).write_text("\n".join(lines) + "\n", encoding="ascii")
    n = len(bed.radius)
    density, still = np.full(n, bed.density), np.zeros((n, 3))
    spheres = FreeSpheres(np.ones(n, dtype=np.int64), bed.radius, density, bed.position, bed.velocity, still)
    write_spheres(folder / DATA, spheres, 2, room)


def write_yade_bed(folder: Path, bed: Bed) -> None:
    """Write ``yade_bed.py``, ``bed.json`` and ``law.json`` into ``folder``; run it with ``run_yade``."""
    table = dataclasses.asdict(bed) | {"youngs_modulus": bed.youngs_modulus}
    text = json.dumps(table, default=lambda array: array.tolist(), allow_nan=False)
    (folder / "bed.json").write_text(text + "\n", encoding="utf-8")
    write_law(folder, np.full((1, 1), bed.restitution), np.full((1, 1), bed.friction))
    shutil.copyfile(SCRIPTS / SCRIPT, folder / SCRIPT)


BED_WRITERS: dict[str, Callable[[Path, Bed], None]] = {"liggghts": write_liggghts_bed, "yade": write_yade_bed}
"""Engine → function that writes its bed into an existing folder."""
