"""A design with its replicates in the order in which it is run, and its sheet: a CSV file to fill in anywhere.

# design | box-behnken | …                          what it is
# factor | shear_modulus | 46.18 | 58.34 | MPa | 56.3      name, low, high, unit, reference
row,replicate,run,seed,shear_modulus [MPa],…,angle_of_repose_deg
3,1,1,3,46.18,…,

One line per run, in the order to run them. ``row`` is the row of the design in standard order, ``seed`` a number of its
own for an engine that draws at random. An empty cell is a run that is missing. Lines that begin with # are comments.
With blocks there is a column ``block`` as well, 1, 2, …: all runs of one block come before those of the next.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from doe.designs import DESIGNS, Design, DesignOptions, Points
from doe.errors import StatisticsError
from explorer.design.choices import Alpha
from explorer.design.factors_file import FactorsFile, region_of
from explorer.errors import CommandError

Array = npt.NDArray[np.float64]

MOST_RUNS = 20_000
OPTIONS = {
    "runs": "--runs",
    "fold": "--fold",
    "generators": "--generator",
    "fraction": "--fraction",
    "alpha": "--alpha",
    "centre": "--centre",
    "blocks": "--blocks",
    "nonregular": "--nonregular",
}
"""Option of a design → how it is spelt on the command line."""
COLUMNS = ("row", "replicate", "run", "seed")
BLOCK = "block"
"""Column of a sheet whose runs are made in blocks."""
SEPARATOR = " | "


@dataclass(frozen=True)
class DesignOrder:
    """What a user asked for; None: as the factors file says, else the usual value."""

    design: str
    runs: int | None = None
    replicates: int | None = None
    centre: int | None = None
    seed: int | None = None
    fold: bool = False
    generators: tuple[str, ...] = ()
    fraction: int = 0
    alpha: Alpha = Alpha.ROTATABLE
    standard_order: bool = False
    blocks: int | None = None
    nonregular: bool = False


@dataclass(frozen=True)
class RunPlan:
    """A design and its runs.

    ``sequence`` (runs, 2): row of the points and replicate, from 0, in the order in which they are run. ``seeds``
    (runs,): a different one for every run. ``block`` (runs,): of each run, from 0; empty where there are none.
    """

    design: Design
    points: Points
    sequence: npt.NDArray[np.int64]
    seeds: npt.NDArray[np.int64]
    seed: int
    block: npt.NDArray[np.int64]

    @property
    def coded(self) -> Array:
        """Rows in coded units, (rows, k), in standard order."""
        return self.points.coded

    @property
    def replicates(self) -> int:
        """Runs of each row."""
        return len(self.sequence) // len(self.coded)


def make_plan(order: DesignOrder, file: FactorsFile) -> RunPlan:
    """The design of an order; raises CommandError or StatisticsError for options that do not fit it."""
    if order.design not in DESIGNS:
        raise CommandError(f"design {order.design[:40]!r}: allowed are {', '.join(DESIGNS)}")
    design, seed = DESIGNS[order.design], _first(order.seed, file.seed, 1)
    replicates = _first(order.replicates, file.replicates, 1)
    # Blocks of whole replicates hold every row equally often, in any design.
    of_replicates = order.blocks if order.blocks is not None and replicates % order.blocks == 0 else None
    options = DesignOptions(
        runs=order.runs,
        centre=order.centre,
        fold=order.fold,
        generators=order.generators,
        fraction=order.fraction,
        alpha=order.alpha.value,
        seed=seed,
        blocks=None if of_replicates else order.blocks,
        nonregular=order.nonregular,
    )
    _refuse_foreign_options(design, options)
    if order.blocks and BLOCK in (*(factor.name for factor in file.factors), *file.responses):
        raise CommandError(f"--blocks: the sheet's column {BLOCK!r} is a name of the factors file; allowed: another")
    if "centre" in design.options:
        options = replace(options, centre=file.centre if order.centre is None else order.centre)
    points = _points(design, len(file.factors), options)
    rows = len(points.coded)
    if rows * replicates > MOST_RUNS:
        raise CommandError(f"{rows} rows × {replicates} replicates: allowed are {MOST_RUNS} runs")
    every = np.array([(row, replicate) for replicate in range(replicates) for row in range(rows)])
    if of_replicates:
        block = every[:, 1] * of_replicates // replicates
    else:
        block = points.block[every[:, 0]] if len(points.block) else points.block
    seeds = _first(file.first_seed, 1) + np.arange(len(every))
    turn = np.arange(len(every)) if order.standard_order else np.random.default_rng(seed).permutation(len(every))
    if len(block):
        turn = turn[np.argsort(block[turn], kind="stable")]
        block = block[turn]
    return RunPlan(design, points, every[turn], seeds[turn], seed, block)


def _points(design: Design, factors: int, options: DesignOptions) -> Points:
    """The rows; blocks that a design has not are refused with what there is for every design."""
    try:
        return design.points(factors, options)
    except StatisticsError as error:
        if options.blocks is None or not str(error).startswith("blocks"):
            raise
        raise CommandError(
            f"--{error}; or whole replicates in each: --replicates {options.blocks} --blocks {options.blocks}"
        ) from None


def _refuse_foreign_options(design: Design, options: DesignOptions) -> None:
    """An option of another design is a misunderstanding, not to be passed over."""
    for name in options.given():
        if name not in design.options:
            takers = ", ".join(other.name for other in DESIGNS.values() if name in other.options)
            other = f", or {options.blocks} replicates of any design" if name == "blocks" else ""
            raise CommandError(f"{OPTIONS[name]}: is not for {design.name}; it belongs to {takers}{other}")
    if options.runs is not None and options.runs > MOST_RUNS:
        raise CommandError(f"--runs {options.runs}: allowed are {MOST_RUNS}")


def _first(*values: int | None) -> int:
    return next(value for value in values if value is not None)


def sheet_text(plan: RunPlan, file: FactorsFile) -> str:
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
    own = [*COLUMNS, BLOCK] if len(plan.block) else COLUMNS
    writer.writerow([*own, *(factor.title for factor in file.factors), *file.responses])
    natural = region_of(file.factors).natural(plan.coded)
    for position, ((row, replicate), seed) in enumerate(zip(plan.sequence, plan.seeds, strict=True)):
        levels = [written(value) for value in natural[row]]
        block = [plan.block[position] + 1] if len(plan.block) else []
        writer.writerow([row + 1, replicate + 1, position + 1, seed, *block, *levels, *[""] * len(file.responses)])
    return stream.getvalue()


def written(value: float) -> str:
    """A level with twelve digits: rounding dust of the coding is gone, nothing that was meant is."""
    return np.format_float_positional(float(f"{value:.12g}"), trim="-")
