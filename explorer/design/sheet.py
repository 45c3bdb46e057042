"""The sheet of a design: a CSV file that is filled in anywhere and read again.

# design | box-behnken | …                          what it is
# factor | shear_modulus | 46.18 | 58.34 | MPa | 56.3      name, low, high, unit, reference
row,replicate,run,seed,shear_modulus [MPa],…,angle_of_repose_deg
3,1,1,3,46.18,…,

One line per run, in the order to run them. ``row`` is the row of the design in standard order, ``seed`` a number of its
own for an engine that draws at random. An empty cell is a run that is missing. Lines that begin with # are comments.
"""

from __future__ import annotations

import csv
import io

import numpy as np

from explorer.design.factors_file import FactorsFile, region_of
from explorer.design.plan import Plan

COLUMNS = ("row", "replicate", "run", "seed")
SEPARATOR = " | "


def sheet_text(plan: Plan, file: FactorsFile) -> str:
    """The empty sheet."""
    stream = io.StringIO()
    stream.write(
        SEPARATOR.join(
            ["# design", plan.design.name, *plan.points.traits, *plan.points.generators, f"seed {plan.seed}"]
        )
        + "\n"
    )
    for factor in file.factors:
        numbers = [written(factor.low), written(factor.high)]
        stream.write(
            SEPARATOR.join(["# factor", factor.name, *numbers, factor.unit or "1", written(factor.reference)]) + "\n"
        )
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([*COLUMNS, *(factor.title for factor in file.factors), *file.responses])
    natural = region_of(file.factors).natural(plan.coded)
    for position, ((row, replicate), seed) in enumerate(zip(plan.sequence, plan.seeds, strict=True)):
        levels = [written(value) for value in natural[row]]
        writer.writerow([row + 1, replicate + 1, position + 1, seed, *levels, *[""] * len(file.responses)])
    return stream.getvalue()


def written(value: float) -> str:
    """A level with twelve digits: rounding dust of the coding is gone, nothing that was meant is."""
    return np.format_float_positional(float(f"{value:.12g}"), trim="-")
