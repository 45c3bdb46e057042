"""The paper's formulas applied to simulated bench tests, beside their closed forms (``doe/laboratory/bias.py``)."""

from __future__ import annotations

import numpy as np

from doe.laboratory.bias import STRAINS, BiasTable, compression_ratio
from doe.laboratory.contact import flight, tangential_share
from explorer.errors import CommandError
from explorer.laboratory.twin import bench_scene
from solver import Scene, with_values
from solver.single_body import BenchResult, run_bench_test

FIRST_READING = 0.02
"""The twin's squeezing is shown from this share of its largest strain on: before, few steps fell into a reading."""


def simulated_bias(test: str, scene: Scene, of: tuple[str, ...]) -> BiasTable:
    """What the formula of ``test`` gives on the solver for one component or pair; CommandError where none is built."""
    if test == "drop":
        return _drop(run_bench_test(bench_scene(scene, test, of)), "-".join(of))
    if test == "compression":
        bench = with_values(bench_scene(scene, test, of), {"rig.strain": STRAINS[-1]})
        return _compression(run_bench_test(bench), scene, of)
    raise CommandError(f"--bias --simulate: {test}; allowed: drop, compression")


def _drop(found: BenchResult, name: str) -> BiasTable:
    table = dict(found.table)
    columns = (table[key] for key in ("static_friction", "restitution", "tracked", "paper_L_over_2H"))
    rows = [
        (mu, e, flight(e, tangential_share(e, mu)), paper, paper / e, tracked)
        for mu, e, tracked, paper in zip(*columns, strict=True)
    ]
    return BiasTable(
        title=f"{found.body} on {found.wall}: e = L/(2H) by closed form and simulated, {name} varied",
        columns=("static_friction", "restitution", "L_over_2H", "simulated", "ratio", "tracked"),
        rows=tuple(rows),
        statement="the closed form is that of a rigid sphere; the contact's tangential springs make the difference",
    )


def _compression(found: BenchResult, scene: Scene, of: tuple[str, ...]) -> BiasTable:
    series = {key: np.array(values) for key, values in found.series}
    material = scene.material(next(b for b in scene.bodies if of[0] in (b.name, b.material)).material)
    # The largest approach belongs to the largest strain: their ratio is the thickness, also of a last step too many.
    strain = series["approach_m"] * (STRAINS[-1] / series["approach_m"][-1])
    ratio = series["youngs_modulus_paper_equation_1_Pa"] / material.youngs_modulus
    shown = [wanted for wanted in STRAINS if wanted >= FIRST_READING * STRAINS[-1]]
    rows = [(wanted, compression_ratio(wanted, material.poisson_ratio), _at(wanted, strain, ratio)) for wanted in shown]
    return BiasTable(
        title=f"{found.body} between plates of {found.wall}: E by Equation (1) over the E of its material",
        columns=("strain", "ratio", "simulated"),
        rows=tuple(rows),
        statement=f"ν = {material.poisson_ratio:g}; the closed form takes the plates as rigid",
    )


def _at(wanted: float, strain: np.ndarray, ratio: np.ndarray) -> float:
    return float(np.interp(wanted, strain, ratio))
