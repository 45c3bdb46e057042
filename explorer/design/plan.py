"""A design with its replicates in the order in which it is run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from doe.designs import (
    box_behnken,
    central_composite,
    factorial,
    fold_over,
    latin_hypercube,
    plackett_burman,
    sobol,
)
from doe.designs.factorial import standard_generators
from doe.designs.plackett_burman import smallest_size
from explorer.design.factors_file import FactorsFile
from explorer.design.kinds import Alpha, Kind
from explorer.errors import CommandError

Array = npt.NDArray[np.float64]
MOST_RUNS = 20_000


@dataclass(frozen=True)
class PlanOrder:
    """What a user asked for; None: as the factors file says, else the usual value."""

    kind: Kind
    runs: int | None = None
    replicates: int | None = None
    centre: int | None = None
    seed: int | None = None
    fold: bool = False
    generators: tuple[str, ...] = ()
    fraction: int = 0
    alpha: Alpha = Alpha.ROTATABLE
    standard_order: bool = False


@dataclass(frozen=True)
class Plan:
    """Rows of the design in coded units, (rows, k), in standard order; ``sequence`` (runs, 2): row and replicate, from
    0, in the order in which they are run. ``seeds`` (runs,): a different one for every run.
    """

    kind: Kind
    coded: Array
    sequence: npt.NDArray[np.int64]
    seeds: npt.NDArray[np.int64]
    seed: int
    generators: tuple[str, ...] = ()
    traits: tuple[str, ...] = field(default=())

    @property
    def replicates(self) -> int:
        """Runs of each row."""
        return len(self.sequence) // len(self.coded)


def make_plan(order: PlanOrder, file: FactorsFile) -> Plan:
    """The design of an order; raises CommandError or StatisticsError for options that do not fit it."""
    _refuse_foreign_options(order)
    seed = _first(order.seed, file.seed, 1)
    replicates = _first(order.replicates, file.replicates, 1)
    coded, generators, traits = _designs()[order.kind](order, file, seed)
    if len(coded) * replicates > MOST_RUNS:
        raise CommandError(f"{len(coded)} rows × {replicates} replicates: allowed are {MOST_RUNS} runs")
    every = np.array([(row, replicate) for replicate in range(replicates) for row in range(len(coded))])
    seeds = _first(file.first_seed, 1) + np.arange(len(every))
    turn = np.arange(len(every)) if order.standard_order else np.random.default_rng(seed).permutation(len(every))
    return Plan(order.kind, coded, every[turn], seeds[turn], seed, generators, traits)


def _designs() -> dict[Kind, Callable[[PlanOrder, FactorsFile, int], tuple[Array, tuple[str, ...], tuple[str, ...]]]]:
    return {
        Kind.PLACKETT_BURMAN: _plackett_burman,
        Kind.BOX_BEHNKEN: _box_behnken,
        Kind.CENTRAL_COMPOSITE: _central_composite,
        Kind.FACTORIAL: _factorial,
        Kind.LHS: _latin_hypercube,
        Kind.SOBOL: _sobol,
    }


def _plackett_burman(order: PlanOrder, file: FactorsFile, seed: int) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    k = len(file.factors)
    size = smallest_size(k) if order.runs is None else order.runs
    table = plackett_burman(size)
    if k > size - 1:
        raise CommandError(
            f"--runs {size}: has {size - 1} columns for {k} factors; allowed: at least {smallest_size(k)}"
        )
    rows = fold_over(table) if order.fold else table
    traits = (f"{size} runs, {size - 1 - k} columns without a factor", *(("folded over",) if order.fold else ()))
    return _with_centre(rows[:, :k], _first(order.centre, file.centre, 0)), (), traits


def _box_behnken(order: PlanOrder, file: FactorsFile, seed: int) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    design = box_behnken(len(file.factors), _first(order.centre, file.centre, 5))
    return design.astype(np.float64), (), ()


def _central_composite(
    order: PlanOrder, file: FactorsFile, seed: int
) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    design = central_composite(len(file.factors), _first(order.centre, file.centre, 5), order.alpha.value)
    return design, (), (f"{order.alpha.value}, axial points at ±{np.abs(design).max():.4g}",)


def _factorial(order: PlanOrder, file: FactorsFile, seed: int) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    k = len(file.factors)
    generators = order.generators or (standard_generators(k, order.fraction) if order.fraction else ())
    rows = factorial(k, generators)
    name = f"2^({k}−{len(generators)})" if generators else f"2^{k}"
    return _with_centre(rows, _first(order.centre, file.centre, 0)), tuple(generators), (name,)


def _latin_hypercube(order: PlanOrder, file: FactorsFile, seed: int) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    k = len(file.factors)
    return latin_hypercube(k, _runs(order, 10 * k), seed), (), ()


def _sobol(order: PlanOrder, file: FactorsFile, seed: int) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    k = len(file.factors)
    return sobol(k, _runs(order, 2 ** int(np.ceil(np.log2(10 * k)))), seed), (), ()


def _with_centre(levels: npt.NDArray[np.int64], centre: int) -> Array:
    return np.vstack([levels, np.zeros((centre, levels.shape[1]), dtype=np.int64)]).astype(np.float64)


def _runs(order: PlanOrder, usual: int) -> int:
    runs = usual if order.runs is None else order.runs
    if runs > MOST_RUNS:
        raise CommandError(f"--runs {runs}: allowed are {MOST_RUNS}")
    return runs


def _refuse_foreign_options(order: PlanOrder) -> None:
    """An option of another design is a misunderstanding, not to be passed over."""
    belongs = {
        "--runs": (order.runs is not None, (Kind.PLACKETT_BURMAN, Kind.LHS, Kind.SOBOL)),
        "--fold": (order.fold, (Kind.PLACKETT_BURMAN,)),
        "--generator": (bool(order.generators), (Kind.FACTORIAL,)),
        "--fraction": (bool(order.fraction), (Kind.FACTORIAL,)),
        "--alpha": (order.alpha != Alpha.ROTATABLE, (Kind.CENTRAL_COMPOSITE,)),
        "--centre": (order.centre is not None, tuple(kind for kind in Kind if kind not in (Kind.LHS, Kind.SOBOL))),
    }
    for option, (given, kinds) in belongs.items():
        if given and order.kind not in kinds:
            raise CommandError(f"{option}: is not for {order.kind}; it belongs to {', '.join(kinds)}")
    if order.generators and order.fraction:
        raise CommandError("--fraction: has generators of its own; allowed: --fraction or --generator")


def _first(*values: int | None) -> int:
    return next(value for value in values if value is not None)
