"""A design with its replicates in running order, and its sheet: a CSV file to fill in anywhere.

# design | box-behnken | …                          what it is
# factor | shear_modulus | 46.18 | 58.34 | MPa | 56.3      name, low, high, unit, reference
row,replicate,run,seed,shear_modulus [MPa],…,angle_of_repose_deg
3,1,1,3,46.18,…,

``# levels | solvent | water | ethanol`` declares a factor with named levels.

One line per run, in running order. ``row`` is the row of the design in standard order; ``seed`` is a different number
for every run, for an engine that draws at random. An empty cell is a missing run. Lines that begin with # are comments.
With blocks there is also a column ``block``, 1, 2, …: all runs of one block come before those of the next.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from doe.designs import DESIGNS, Design, DesignOptions, Points
from doe.errors import StatisticsError
from explorer.design.choices import Alpha, ModelOrder
from explorer.design.factors_file import DesignFactor, FactorsFile, coded_constraint, is_number, region_of
from explorer.design.filled_sheet import FinishedRuns, finished_runs, read_sheet
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
    "model": "--model",
    "constraints": "--constraint",
    "levels": "levels of a factor that is no number",
    "kept": "--augment",
    "lattice": "--lattice",
}
"""Option of a design → its spelling on the command line."""
COLUMNS = ("row", "replicate", "run", "seed")
BLOCK = "block"
"""Column of the block, in a sheet whose runs are made in blocks."""
SEPARATOR = " | "


@dataclass(frozen=True)
class DesignOrder:
    """What a user asked for; None means the value of the factors file, or else the default."""

    design: str
    _: KW_ONLY
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
    model: ModelOrder | None = None
    constraints: tuple[str, ...] = ()
    """In the factors' units, such as "A + B <= 1"."""
    lattice: int | None = None
    augment: Path | None = None
    """Sheet whose finished runs are kept."""


@dataclass(frozen=True)
class RunPlan:
    """A design and its runs.

    ``sequence`` (runs, 2): row of the points and replicate, from 0, in running order. ``seeds`` (runs,): a different
    one for every run. ``block`` (runs,): block of each run, from 0; empty if there are none. ``finished``: response
    cells of the kept runs, which come first.
    """

    design: Design
    points: Points
    sequence: npt.NDArray[np.int64]
    seeds: npt.NDArray[np.int64]
    seed: int
    block: npt.NDArray[np.int64]
    finished: tuple[tuple[str, ...], ...] = ()

    @property
    def coded(self) -> Array:
        """Rows in coded units, (rows, k), in standard order."""
        return self.points.coded

    @property
    def replicates(self) -> int:
        """Number of runs of each row."""
        return len(self.sequence) // len(self.coded)


def make_plan(order: DesignOrder, file: FactorsFile) -> RunPlan:
    """The design of an order; raises CommandError or StatisticsError for options that do not fit it."""
    if order.design not in DESIGNS:
        raise CommandError(f"design {order.design[:40]!r}; allowed: {', '.join(DESIGNS)}")
    design, seed = DESIGNS[order.design], _first(order.seed, file.seed, 1)
    replicates = _first(order.replicates, file.replicates, 1)
    kept = FinishedRuns(np.zeros((0, len(file.factors))), (), np.zeros(0))
    if order.augment is not None:
        if "kept" in design.options and (replicates > 1 or order.blocks):
            raise CommandError("--augment: the finished runs are not changed; allowed: --replicates 1 and no --blocks")
        kept = finished_runs(read_sheet(order.augment, file.factors), file.responses)
    # Blocks of whole replicates hold every row equally often, in any design.
    of_replicates = order.blocks if order.blocks is not None and replicates % order.blocks == 0 else None
    names = tuple(len(factor.levels) for factor in file.factors)
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
        lattice=order.lattice,
        model=(order.model or ModelOrder.QUADRATIC).value,
        constraints=tuple(coded_constraint(text, file.factors) for text in order.constraints),
        levels=names if any(names) and "levels" in design.options else (),
        kept=tuple(map(tuple, kept.coded.tolist())),
    )
    asked = (*options.given(), *(["model"] if order.model is not None else []))
    _refuse_foreign_options(design, options, asked)
    if order.blocks and BLOCK in (*(factor.name for factor in file.factors), *file.responses):
        raise CommandError(
            f"--blocks: the sheet needs the column {BLOCK!r}, a name in the factors file; rename it there"
        )
    if "centre" in design.options:
        options = replace(options, centre=file.centre if order.centre is None else order.centre)
    if design.mixture:
        _require_parts(file)
    points = _points(design, len(file.factors), options)
    _refuse_levels_between_names(design, file, points.coded)
    rows = len(points.coded)
    if rows * replicates > MOST_RUNS:
        raise CommandError(f"{rows} rows × {replicates} replicates; allowed: up to {MOST_RUNS} runs")
    every = np.array([(row, replicate) for replicate in range(replicates) for row in range(rows)])
    if of_replicates:
        block = every[:, 1] * of_replicates // replicates
    else:
        block = points.block[every[:, 0]] if len(points.block) else points.block
    seeds = _seeds(_first(file.first_seed, 1), len(every), kept.seeds)
    turn = np.arange(len(every)) if order.standard_order else np.random.default_rng(seed).permutation(len(every))
    if len(block):
        turn = turn[np.argsort(block[turn], kind="stable")]
        block = block[turn]
    if kept.cells:
        turn = np.concatenate([np.arange(len(kept.cells)), turn[turn >= len(kept.cells)]])
    return RunPlan(design, points, every[turn], seeds[turn], seed, block, kept.cells)


def _seeds(first: int, runs: int, finished: Array) -> npt.NDArray[np.int64]:
    """A seed for every run: finished runs, which come first, keep theirs; the others continue above the largest."""
    new = np.append(np.isnan(finished), np.ones(runs - len(finished), dtype=np.bool_))
    own = finished[~new[: len(finished)]].astype(np.int64)
    seeds = np.empty(runs, dtype=np.int64)
    seeds[~new] = own
    seeds[new] = max(first, own.max(initial=-1) + 1) + np.arange(int(new.sum()))
    return seeds


def _require_parts(file: FactorsFile) -> None:
    """Require equal widths low … high of all parts: a part is at its high when all others are at their lows."""
    rooms = [factor.high - factor.low for factor in file.factors]
    named = [factor.name for factor in file.factors if factor.levels]
    if named:
        raise CommandError(f"mixture: {named[0]} has named levels; allowed: parts with low and high")
    if max(rooms) - min(rooms) > 1e-9 * max(rooms):
        listed = ", ".join(f"{factor.name} {room:g}" for factor, room in zip(file.factors, rooms, strict=True))
        raise CommandError(
            f"mixture: high minus low differs between the parts ({listed}); allowed: for every part the whole minus "
            "the "
            "sum of all lows, as with 0 and 1, or with 0 and 100"
        )


def _refuse_levels_between_names(design: Design, file: FactorsFile, coded: Array) -> None:
    """Refuse a design that needs levels between or beyond the names of a factor."""
    for factor, column in zip(file.factors, coded.T, strict=True):
        if factor.levels and not np.isclose(column[:, None], factor.codes, atol=1e-9).any(axis=1).all():
            takers = ", ".join(other.name for other in DESIGNS.values() if "levels" in other.options)
            raise CommandError(
                f"{design.name}: needs levels of {factor.name} other than {', '.join(factor.levels)}; "
                f"allowed: {takers}, or a two-level design with two levels"
            )


def _points(design: Design, factors: int, options: DesignOptions) -> Points:
    """The rows. For blocks that a design does not have, the error names those that every design has."""
    try:
        return design.points(factors, options)
    except StatisticsError as error:
        if options.blocks is None or not str(error).startswith("blocks"):
            raise
        raise CommandError(
            f"--{error}; or whole replicates in each: --replicates {options.blocks} --blocks {options.blocks}"
        ) from None


def _refuse_foreign_options(design: Design, options: DesignOptions, asked: Iterable[str]) -> None:
    """Refuse an option of another design: ignoring it would hide a misunderstanding."""
    for name in asked:
        if name not in design.options:
            takers = ", ".join(other.name for other in DESIGNS.values() if name in other.options)
            other = f", or {options.blocks} replicates of any design" if name == "blocks" else ""
            raise CommandError(f"{OPTIONS[name]}: is not for {design.name}; allowed with: {takers}{other}")
    if options.runs is not None and options.runs > MOST_RUNS:
        raise CommandError(f"--runs {options.runs}; allowed: up to {MOST_RUNS}")


def _first(*values: int | None) -> int:
    return next(value for value in values if value is not None)


def sheet_content(plan: RunPlan, file: FactorsFile, workbook: bool, decimal_comma: bool) -> bytes:
    """The empty sheet as a file: a workbook (.xlsx), or CSV."""
    if workbook:
        return sheet_workbook(plan, file)
    # Without the mark at its start, a spreadsheet assumes a Windows encoding.
    return ("\ufeff" * decimal_comma + sheet_text(plan, file, decimal_comma)).encode()


def sheet_text(plan: RunPlan, file: FactorsFile, decimal_comma: bool = False) -> str:
    """The empty sheet as CSV; with decimal commas, semicolons separate the cells, as such spreadsheets expect."""
    comments, rows = _sheet(plan, file)
    stream = io.StringIO()
    stream.writelines(f"{line}\n" for line in comments)
    writer = csv.writer(stream, delimiter=";" if decimal_comma else ",", lineterminator="\n")
    writer.writerow(rows[0])
    for row in rows[1:]:
        writer.writerow([cell.replace(".", ",") if decimal_comma and is_number(cell) else cell for cell in row])
    return stream.getvalue()


def sheet_workbook(plan: RunPlan, file: FactorsFile) -> bytes:
    """The empty sheet as a workbook (.xlsx), in which numbers are stored as numbers."""
    # Imported only here: it takes a second, and few sheets are workbooks.
    import pandas

    comments, rows = _sheet(plan, file)
    cells: list[list[str | float | None]] = [[line, *[None] * (len(rows[0]) - 1)] for line in comments]
    cells += [[float(cell) if is_number(cell) else cell or None for cell in row] for row in rows]
    stream = io.BytesIO()
    pandas.DataFrame(cells, dtype=object).to_excel(stream, header=False, index=False, engine="openpyxl")
    return stream.getvalue()


def _sheet(plan: RunPlan, file: FactorsFile) -> tuple[list[str], list[list[str]]]:
    """The comments of the sheet, and its rows with the header first."""
    comments = [
        SEPARATOR.join(
            ["# design", plan.design.name, *plan.points.traits, *plan.points.generators, f"seed {plan.seed}"]
        )
    ]
    for factor in file.factors:
        if factor.levels:
            comments.append(SEPARATOR.join(["# levels", factor.name, *factor.levels]))
            continue
        numbers = [written(factor.low), written(factor.high)]
        comments.append(
            SEPARATOR.join(["# factor", factor.name, *numbers, factor.unit or "1", written(factor.reference)])
        )
    own = [*COLUMNS, BLOCK] if len(plan.block) else [*COLUMNS]
    rows = [[*own, *(factor.title for factor in file.factors), *file.response_titles]]
    natural = region_of(file.factors).natural(plan.coded)
    for position, ((row, replicate), seed) in enumerate(zip(plan.sequence, plan.seeds, strict=True)):
        block = [plan.block[position] + 1] if len(plan.block) else []
        levels = [level_text(factor, value) for factor, value in zip(file.factors, natural[row], strict=True)]
        answers = plan.finished[position] if position < len(plan.finished) else [""] * len(file.responses)
        rows.append([*map(str, [row + 1, replicate + 1, position + 1, seed, *block]), *levels, *answers])
    return comments, rows


def level_text(factor: DesignFactor, value: float) -> str:
    """A level in the factor's unit, or its name."""
    return factor.levels[int(np.argmin(np.abs(np.array(factor.codes) - value)))] if factor.levels else written(value)


def written(value: float) -> str:
    """A level with twelve digits: removes rounding errors of the coding, but nothing that was intended."""
    return np.format_float_positional(float(f"{value:.12g}"), trim="-")
