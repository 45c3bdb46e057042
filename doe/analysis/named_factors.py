"""Categorical factors (a solvent, a supplier, a machine) beside numerical ones: which act, and what each name gives.

y = sum over terms of columns times coefficients + e, by least squares. A factor of c names has c - 1 columns, contrasts
that sum to zero over its names; a number has x, and x^2; an interaction has all products of the columns of its factors.
A term is tested by all its columns t together: SS = b_t' [(X'X)^-1_tt]^-1 b_t on as many degrees of freedom, the
partial (Type III) sum of squares, which is the same for all contrasts that sum to zero. Blocks have fixed effects.

The mean of a name is the prediction for it, averaged with equal weight over the names of all other factors and blocks,
with every number in its middle (least-squares mean); its effect is the difference of that from the mean of all names
(sum coding). Source: Searle, Speed and Milliken 1980, Am. Stat. 34:216, doi 10.1080/00031305.1980.10483031.

For one combination of names the model is a second-order polynomial of the numbers alone: its settings for a target are
found like those of a surface (`doe.analysis.level_set`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, product
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.level_set import nearest_points
from doe.analysis.models import ORDERS, Order, ReducedModel, Reduction, eliminate, hierarchical
from doe.analysis.optimum import ResponseTarget, compatible_share, solution_range
from doe.analysis.replicates import valid_runs
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import Blocks, Surface, block_columns, least_squares, natural_coefficients, term_names
from doe.analysis.surface import used_blocks as blocks_of_runs
from doe.analysis.surface_anova import (
    FULL,
    AnovaRow,
    block_row,
    externally_studentized,
    lack_of_fit,
    ratio,
    tested,
    total_sum_of_squares,
)
from doe.designs.optimal import Terms, codes, model_terms
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]
LEAST_DF = 3
"""Degrees of freedom for the error, where no order is asked for."""
MOST_COMBINATIONS = 64
"""Most combinations of names that are all listed; if there are more, only those that were run are listed."""
MOST_SOLVED = 4
"""Most numerical factors for which the settings that give a target are searched for."""


@dataclass(frozen=True)
class NameMean(Record):
    """The mean response of a name of a factor with its 95 % interval, and its effect: mean less the mean of all names,
    with standard error and p (t test that it is zero); all but p in the unit of the response.
    """

    factor: str
    name: str
    mean: float
    low: float
    high: float
    effect: float
    standard_error: float
    p: float


@dataclass(frozen=True)
class NameSetting(Record):
    """The numbers that give the target with one combination of names; arrays of shape (numbers,), natural units.

    point: of all settings that give the target, the one nearest the reference, or where the model comes nearest to the
    target. predicted with its 95 % interval. solution_low, solution_high: range of each number while the model gives
    the target. compatible_share: share of the region where the mean differs from the target by no more than its 95 %
    margin.
    """

    reached: bool
    point: FloatArray
    predicted: float
    predicted_low: float
    predicted_high: float
    solution_low: FloatArray
    solution_high: FloatArray
    compatible_share: float


@dataclass(frozen=True)
class NameGroup(Record):
    """One combination of names: its number of runs, the prediction with all numbers in the middle (95 % interval), and
    its polynomial of the numbers, with the term layout of a `Surface`. setting: None without a target.
    """

    names: tuple[str, ...]
    runs: int
    mean: float
    low: float
    high: float
    included: BoolArray
    coefficients: FloatArray
    coefficients_natural: FloatArray
    setting: NameSetting | None = None


@dataclass(frozen=True)
class NamedFit(Record):
    """A fitted model of factors that are names and factors that are numbers.

    levels: names of each factor, () for a number. rows: as in `SurfaceAnova`, one per term with all its degrees of
    freedom. means: for factors that are terms of the model. groups: combinations of names. studentized: externally
    studentised residuals, per run. outliers: positions of runs beyond outlier_limit (p = 0.05 for the largest of all,
    Bonferroni).
    """

    levels: tuple[tuple[str, ...], ...]
    terms: tuple[str, ...]
    rows: tuple[AnovaRow, ...]
    sigma: float
    df_residual: int
    r_squared: float
    r_squared_adjusted: float
    r_squared_predicted: float
    press: float
    means: tuple[NameMean, ...]
    groups: tuple[NameGroup, ...]
    observed: FloatArray
    predicted: FloatArray
    row_of_run: IntArray
    studentized: FloatArray
    outlier_limit: float
    outliers: tuple[int, ...]
    block_names: tuple[str, ...] = ()
    block_effects: FloatArray = field(default_factory=lambda: np.zeros(0))
    reduced: ReducedModel | None = None


def term_of(column: str) -> str:
    """Return the term to which a column of `model_terms` belongs: "A*B" for "A[2]*B"."""
    return re.sub(r"\[\d+\]", "", column)


def columns_of(levels: Sequence[int], terms: Sequence[str]) -> Terms:
    """Return the columns of the intercept and of `terms`. levels: number of names per factor, 0 for a number.

    Raises StatisticsError for the square of a factor of names.
    """
    every = model_terms(levels, "quadratic")
    known = {term_of(name) for name in every.names}
    for term in terms:
        if term not in known:
            raise StatisticsError(f"terms: {term}: {term.removesuffix('^2')} has named levels and therefore no square")
    kept = [k for k, name in enumerate(every.names) if k == 0 or term_of(name) in terms]
    return Terms(every.functions[kept], tuple(every.names[k] for k in kept), every.levels)


@dataclass(frozen=True)
class _Runs:
    """The valid runs: coded points (n, k), values, row of the design, block of each; columns of the blocks."""

    points: FloatArray
    observed: FloatArray
    row: IntArray
    block: IntArray
    block_names: tuple[str, ...]
    levels: tuple[int, ...]

    def matrix(self, terms: Sequence[str]) -> FloatArray:
        """The model matrix: intercept and terms, then blocks."""
        columns = columns_of(self.levels, terms).matrix(self.points)
        return np.column_stack([columns, block_columns(self.block, len(self.block_names))])

    def residual(self, terms: Sequence[str]) -> tuple[float, int]:
        """Residual sum of squares with its degrees of freedom."""
        found = least_squares(self.matrix(terms), self.observed)
        return float(found.ssr), int(found.df_resid)

    def df(self, terms: Sequence[str]) -> int:
        """Degrees of freedom for the error; below zero if the runs cannot separate the terms."""
        model = self.matrix(terms)
        return len(model) - model.shape[1] if np.linalg.matrix_rank(model) == model.shape[1] else -1


def fit_named(
    coded: FloatArray,
    responses: FloatArray,
    region: Region,
    levels: Sequence[tuple[str, ...]],
    order: Order | None = None,
    terms: Sequence[str] = (),
    target: ResponseTarget | None = None,
    blocks: Blocks | None = None,
    reduction: Reduction | None = None,
) -> NamedFit:
    """Fit a model to every valid run.

    coded: (rows, k), for a factor of names the codes of `doe.designs.optimal`. responses: (rows, replicates), NaN where
    a run is missing. levels: names per factor, () for a number. The other arguments are those of
    `doe.analysis.analyse.analyse_design`; by default the highest order that leaves 3 degrees of freedom for the error,
    if any does.
    Raises StatisticsError where the runs do not support the model.
    """
    values, row, observed = valid_runs(responses, len(coded))
    none = ((), np.zeros(len(row), dtype=np.int64))
    block_names, block = none if blocks is None else blocks_of_runs(blocks, values)
    runs = _Runs(coded[row], observed, row, block, block_names, tuple(map(len, levels)))
    chosen = hierarchical(region.names, terms) if terms else _terms(runs, order)
    df = runs.df(chosen)
    if df < 1:
        raise StatisticsError(_unbearable(runs, chosen))
    reduced = None
    if reduction is not None:
        reduced = eliminate(chosen, reduction, runs.residual, len(row))
        chosen, df = reduced.terms, runs.df(reduced.terms)
    columns, model = columns_of(runs.levels, chosen), runs.matrix(chosen)
    found = least_squares(model, runs.observed)
    predicted = model @ found.params + runs.observed[0]
    total = total_sum_of_squares(runs.observed)
    residual = float(found.ssr)
    mse = residual / df if total > 0 else 0.0
    influence = found.get_influence()
    alone = bool((influence.hat_matrix_diag > FULL).any())
    press = math.inf if alone else float((influence.resid_press**2).sum())
    studentized = externally_studentized(influence, mse, df)
    limit = float(stats.t.ppf(1 - 0.025 / len(row), df - 1)) if df > 1 else math.nan
    size = len(columns.names)
    effects = found.params[size:]
    fit = NamedFit(
        levels=tuple(levels),
        terms=chosen,
        rows=_rows(runs, chosen, found, total, mse, df),
        sigma=math.sqrt(mse),
        df_residual=df,
        r_squared=ratio(total - residual, total),
        r_squared_adjusted=1 - ratio(mse * (len(row) - 1), total),
        r_squared_predicted=math.nan if alone else ratio(total - press, total),
        press=press,
        means=(),
        groups=(),
        observed=runs.observed,
        predicted=predicted,
        row_of_run=row,
        studentized=studentized,
        outlier_limit=limit,
        outliers=tuple(np.flatnonzero(np.abs(np.nan_to_num(studentized)) > limit).tolist()),
        block_names=block_names,
        block_effects=np.append(effects, -effects.sum()) if block_names else np.zeros(0),
        reduced=reduced,
    )
    coefficients, covariance = found.params[:size].copy(), mse * found.normalized_cov_params[:size, :size]
    coefficients[0] += runs.observed[0]
    return replace(
        fit,
        means=_means(fit, columns, coefficients, covariance, region.names),
        groups=tuple(_groups(fit, runs, columns, coefficients, covariance, region, target)),
    )


def orders_of(levels: Sequence[int]) -> dict[Order, tuple[str, ...]]:
    """Return the terms of each order."""
    return {one: tuple(dict.fromkeys(map(term_of, model_terms(levels, one).names[1:]))) for one in ORDERS}


def order_of_names(coded: FloatArray, levels: Sequence[int], block: IntArray | None = None) -> Order | None:
    """Return the highest order that runs at `coded`, (runs, k), support; None if they leave no error.

    levels: number of names per factor, 0 for a number. block: the block of each run, (runs,), from 0; None or empty
    without blocks. The highest order leaves 3 degrees of freedom for the error, if any does.
    """
    n = len(coded)
    own = np.zeros(n, dtype=np.int64) if block is None or not block.size else block
    names = () if block is None or not block.size else tuple(map(str, range(int(block.max()) + 1)))
    return _highest(_Runs(coded, np.zeros(n), np.arange(n), own, names, tuple(levels)))


def _highest(runs: _Runs) -> Order | None:
    df = {order: runs.df(terms) for order, terms in orders_of(runs.levels).items()}
    able = [order for order in df if df[order] >= 1]
    roomy = [order for order in able if df[order] >= LEAST_DF]
    return [None, *able, *roomy][-1]


def _terms(runs: _Runs, order: Order | None) -> tuple[str, ...]:
    """The terms of an order, or of the highest that the runs support."""
    return orders_of(runs.levels)[order or _highest(runs) or "linear"]


def _unbearable(runs: _Runs, terms: tuple[str, ...]) -> str:
    """Message on which terms the runs cannot separate, or that they leave no error."""
    columns = columns_of(runs.levels, terms)
    lost = dict.fromkeys(
        term_of(name)
        for name, told in zip(columns.names, columns.estimable(runs.points), strict=True)
        if not told and name != "intercept"
    )
    n, size = len(runs.observed), len(columns.names) + max(len(runs.block_names) - 1, 0)
    if lost:
        return f"responses: the {n} valid runs do not tell {', '.join(lost)} apart; allowed: fewer terms, or more runs"
    return f"responses: {n} valid runs leave no error for {size} columns of terms and blocks; {size + 1} are needed"


def _rows(runs: _Runs, terms: tuple[str, ...], found: Any, total: float, mse: float, df: int) -> tuple[AnovaRow, ...]:
    """The analysis of variance: blocks, model, terms, residual, lack of fit, pure error, total."""
    params, covariance = found.params, found.normalized_cov_params
    of_column = [term_of(name) for name in columns_of(runs.levels, terms).names]
    residual = mse * df
    blocks = block_row(runs.observed, runs.block, total) if runs.block_names else ()
    explained = max(0.0, total - residual - sum(one.sum_of_squares for one in blocks))
    tests = [tested("model", explained, len(of_column) - 1, mse, df)]
    for term in terms:
        own = [k for k, name in enumerate(of_column) if name == term]
        squares = float(params[own] @ np.linalg.solve(covariance[np.ix_(own, own)], params[own])) if total > 0 else 0.0
        tests.append(tested(term, squares, len(own), mse, df))
    _, point = np.unique(np.column_stack([runs.points, runs.block]), axis=0, return_inverse=True)
    n = len(runs.observed)
    return (
        *blocks,
        *tests,
        AnovaRow("residual", residual, df, mse, math.nan, math.nan),
        *lack_of_fit(runs.observed, point.reshape(-1).astype(np.int64), residual, df),
        AnovaRow("total", total, n - 1, total / (n - 1), math.nan, math.nan),
    )


def mean_contrasts(
    levels: Sequence[tuple[str, ...]], terms: Sequence[str], columns: Terms, letters: Sequence[str]
) -> list[tuple[str, str, FloatArray, FloatArray]]:
    """Return, for every name, its factor, the name, and the contrasts of the columns that give its mean and its effect.

    Contrasts sum to zero, so averaging removes all columns except those of the factor alone.
    """
    found = []
    for factor, names in enumerate(levels):
        if names and letters[factor] in terms:
            points = np.zeros((len(names), len(levels)))
            points[:, factor] = codes(len(names))
            own = columns.matrix(points) * [term_of(name) == letters[factor] for name in columns.names]
            intercept = np.arange(own.shape[1]) == 0
            found += [(letters[factor], name, one + intercept, one) for name, one in zip(names, own, strict=True)]
    return found


def _means(
    fit: NamedFit, columns: Terms, coefficients: FloatArray, covariance: FloatArray, letters: Sequence[str]
) -> tuple[NameMean, ...]:
    """The means of the names with their intervals."""
    t = float(stats.t.ppf(0.975, fit.df_residual))
    found = []
    for factor, name, at, effect in mean_contrasts(fit.levels, fit.terms, columns, letters):
        mean, half = float(at @ coefficients), t * math.sqrt(at @ covariance @ at)
        size, error = float(effect @ coefficients), math.sqrt(effect @ covariance @ effect)
        p = 2 * float(stats.t.sf(ratio(abs(size), error), fit.df_residual))
        found.append(NameMean(factor, name, mean, mean - half, mean + half, size, error, p))
    return tuple(found)


def _groups(
    fit: NamedFit,
    runs: _Runs,
    columns: Terms,
    coefficients: FloatArray,
    covariance: FloatArray,
    region: Region,
    target: ResponseTarget | None,
) -> list[NameGroup]:
    """Every combination of names with its polynomial of the numbers."""
    named = [k for k, names in enumerate(fit.levels) if names]
    free = [k for k, names in enumerate(fit.levels) if not names]
    numbers = Region(tuple(region.names[k] for k in free), region.centre[free], region.half_width[free], ())
    # Powers of the numbers in a column → the place of that monomial in a surface.
    powers = [(0,) * len(free), *map(tuple, np.eye(len(free), dtype=int).tolist())]
    powers += [tuple(int(k in pair) for k in range(len(free))) for pair in combinations(range(len(free)), 2)]
    powers += [tuple(2 * int(j == k) for k in range(len(free))) for j in range(len(free))]
    place = np.array([powers.index(tuple(one)) for one in columns.functions[:, free].tolist()])
    was_run, counts = np.unique(runs.points[:, named].round(9), axis=0, return_counts=True)
    count = {tuple(one): int(n) for one, n in zip(was_run.tolist(), counts, strict=True)}
    of_names = replace(columns, functions=np.where(np.isin(range(len(fit.levels)), named), columns.functions, 0))
    few = math.prod(len(fit.levels[k]) for k in named) <= MOST_COMBINATIONS
    grid = np.array(list(product(*(codes(len(fit.levels[k])) for k in named)))).round(9) if few else was_run
    found = []
    for combination in grid:
        point = np.zeros((1, len(fit.levels)))
        point[0, named] = combination
        turned = np.zeros((len(powers), len(columns.names)))
        turned[place, np.arange(len(columns.names))] = of_names.matrix(point)[0]
        surface = _surface(fit, numbers, turned @ coefficients, turned @ covariance @ turned.T)
        middle = np.zeros(len(free))
        mean, half = float(surface.predict(middle)), float(surface.half_width(middle))
        names = tuple(
            fit.levels[k][int(np.argmin(np.abs(codes(len(fit.levels[k])) - code)))]
            for k, code in zip(named, combination, strict=True)
        )
        setting = None
        if target is not None and len(free) <= MOST_SOLVED:
            setting = _setting(surface, target, numbers.coded(target.reference[free]))
        found.append(
            NameGroup(
                names=names,
                runs=count.get(tuple(combination.tolist()), 0),
                mean=mean,
                low=mean - half,
                high=mean + half,
                included=np.isin(np.arange(len(powers)), place),
                coefficients=surface.coefficients,
                coefficients_natural=surface.coefficients_natural,
                setting=setting,
            )
        )
    return found


def _surface(fit: NamedFit, numbers: Region, coefficients: FloatArray, covariance: FloatArray) -> Surface:
    """The polynomial of the numbers as a surface, for its predictions; it has no runs of its own."""
    none, no_run = np.zeros(0), np.zeros(0, dtype=np.int64)
    return Surface(
        region=numbers,
        terms=term_names(numbers.names),
        included=np.ones(len(coefficients), dtype=np.bool_),
        coefficients=coefficients,
        coefficients_natural=natural_coefficients(coefficients, numbers),
        information_inverse=covariance,
        mse=1.0,  # it is contained in the covariance
        df_residual=fit.df_residual,
        points=np.zeros((0, len(numbers.names))),
        row_of_run=no_run,
        point_of_run=no_run,
        observed=none,
        predicted=none,
        leverage=none,
        missing_runs=0,
    )


def _setting(surface: Surface, target: ResponseTarget, reference: FloatArray) -> NameSetting:
    """Where the polynomial gives the target; without numbers, whether the names alone give it to within its error."""
    k, region = len(surface.names), surface.region
    share = compatible_share(surface, target.value, target.standard_error)
    if not k:
        point, reached, low, high = np.zeros(0), share > 0, np.zeros(0), np.zeros(0)
    else:
        points, found = nearest_points(surface.coefficients[None], target.value, reference, np.ones(k))
        point, reached = points[0], bool(found[0])
        low, high = solution_range(surface, target.value)
    mean, half = float(surface.predict(point)), float(surface.half_width(point))
    at, solution_low, solution_high = (region.natural(one) for one in (point, low, high))
    return NameSetting(reached, at, mean, mean - half, mean + half, solution_low, solution_high, share)
