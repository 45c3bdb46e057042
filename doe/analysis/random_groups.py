"""Groups drawn at random (days, batches, whole plots, seeds): how much do they scatter, and which terms act besides?

y = X b + u_group + e with u ~ N(0, s_u^2), e ~ N(0, s^2), V = s^2 I + s_u^2 ZZ'. X: the columns of the terms
(`doe.analysis.named_factors`) and of fixed blocks. A fixed block concerns these particular groups; a random one
concerns the population from which they were drawn, and is the error against which a factor is tested that is constant
within a group (a split plot).

The variances maximise the restricted likelihood (REML, Patterson and Thompson 1971, Biometrika 58:545): with the
ratio r = s_u^2/s^2 and P = V^-1 - V^-1 X (X'V^-1 X)^-1 X'V^-1, r is the root of its score, and s^2 = y'Py s^2/(n - p).
In balanced data they equal those from the expected mean squares, as long as that of the groups is not negative.
Intervals: all values with a profile deviance within chi^2(0.95, 1) of the least. Test of s_u = 0: the difference of the
deviances against an equal mixture of chi^2(0) and chi^2(1) (Self and Liang 1987, J. Am. Stat. Assoc. 82:605).

Terms: F test of the generalised least squares estimate. Degrees of freedom of its error by Satterthwaite (1946,
Biometrics Bull. 2:110): for a contrast c, 2 (c'Fc)^2/Var(c'Fc) with F = (X'V^-1 X)^-1 and the variance from the
expected information of (s^2, s_u^2); for several columns as in Fai and Cornelius 1996 and R's lmerTest. In balanced
data these are the exact tests.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats
from scipy.optimize import brentq, minimize_scalar

from doe.analysis.models import Order, hierarchical
from doe.analysis.named_factors import LEAST_DF, NameMean, columns_of, mean_contrasts, orders_of, term_of
from doe.analysis.replicates import valid_runs
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import Blocks, block_columns, used_blocks
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
RATIOS = np.geomspace(1e-7, 1e7, 141)
"""Values of s_u^2/s^2 among which the largest likelihood is searched for, before it is refined."""
DROP = float(stats.chi2.ppf(0.95, 1))


@dataclass(frozen=True)
class Component(Record):
    """A variance with its 95 % interval, in the squared unit of the response. share: its share of the sum of both."""

    name: str
    variance: float
    low: float
    high: float
    share: float

    @property
    def sd(self) -> float:
        """Standard deviation."""
        return math.sqrt(self.variance)


@dataclass(frozen=True)
class RandomTest(Record):
    """Test of a term against its own error: F with df and df_error degrees of freedom."""

    source: str
    df: int
    df_error: float
    f: float
    p: float


@dataclass(frozen=True)
class Estimate(Record):
    """A coefficient, coded: its standard error with degrees of freedom, and p (t test that it is zero)."""

    term: str
    value: float
    standard_error: float
    df: float
    p: float


@dataclass(frozen=True)
class RandomFit(Record):
    """A fitted model with groups drawn at random.

    components: "between groups", "within". p_groups: test of s_u = 0. deviance: -2 ln of the restricted likelihood with
    all constants, for the coded columns of sum-to-zero contrasts. effects: predicted effects of the groups (shrunk
    towards zero). coefficients: intercept and terms of one column; means: for the names of factors of names. observed,
    predicted: per run, without and with the group's effect.
    """

    levels: tuple[tuple[str, ...], ...]
    terms: tuple[str, ...]
    groups: tuple[str, ...]
    runs_of_group: IntArray
    effects: FloatArray
    components: tuple[Component, Component]
    p_groups: float
    deviance: float
    tests: tuple[RandomTest, ...]
    coefficients: tuple[Estimate, ...]
    means: tuple[NameMean, ...]
    observed: FloatArray
    predicted: FloatArray
    predicted_in_group: FloatArray
    row_of_run: IntArray


class _Likelihood:
    """The restricted likelihood of two variances, from sums over the groups; the values less their mean."""

    def __init__(self, model: FloatArray, observed: FloatArray, group: IntArray) -> None:
        self.origin = float(observed.mean())
        self.model, self.values = model, observed - self.origin
        self.sizes = np.bincount(group).astype(np.float64)
        self.model_sums = np.stack([np.bincount(group, weights=column) for column in model.T], axis=1)
        self.value_sums = np.bincount(group, weights=self.values)
        self.df = len(observed) - model.shape[1]

    def solved(self, ratio: float) -> tuple[FloatArray, FloatArray, float]:
        """(X'V^-1 X)^-1, coefficients and y'Py in units of s^2 = 1."""
        weight = ratio / (1 + ratio * self.sizes)
        inner = self.model.T @ self.model - self.model_sums.T @ (weight[:, None] * self.model_sums)
        inverse: FloatArray = np.asarray(np.linalg.inv(inner))
        right = self.model.T @ self.values - self.model_sums.T @ (weight * self.value_sums)
        coefficients = inverse @ right
        residual = self.values - self.model @ coefficients
        sums = self.value_sums - self.model_sums @ coefficients
        return inverse, coefficients, float(residual @ residual - weight @ sums**2)

    def deviance(self, within: float, between: float) -> float:
        """-2 ln of the restricted likelihood."""
        ratio = between / within
        inverse, _, squares = self.solved(ratio)
        logs = np.log1p(ratio * self.sizes).sum() - np.linalg.slogdet(inverse)[1]
        return float(self.df * math.log(2 * math.pi * within) + logs + squares / within)

    def profile(self, ratio: float) -> float:
        """The deviance at a ratio, with the best s^2."""
        within = self.solved(ratio)[2] / self.df
        return self.deviance(within, ratio * within)

    def score(self, ratio: float) -> float:
        """Derivative of the profile: tr(Z'PZ) - df |Z'Py|^2/(y'Py), in units of s^2 = 1."""
        _, coefficients, squares = self.solved(ratio)
        sums = (self.value_sums - self.model_sums @ coefficients) / (1 + ratio * self.sizes)
        return float(np.trace(self.projected(ratio)) - self.df * float(sums @ sums) / squares)

    def projected(self, ratio: float) -> FloatArray:
        """Z'PZ in units of s^2 = 1."""
        shrunk = self.model_sums / (1 + ratio * self.sizes)[:, None]
        return np.asarray(np.diag(self.sizes / (1 + ratio * self.sizes)) - shrunk @ self.solved(ratio)[0] @ shrunk.T)

    def best_ratio(self) -> float:
        """The ratio that maximises the likelihood; 0 if no scatter of the groups increases it."""
        found = [self.profile(ratio) for ratio in RATIOS]
        least = int(np.argmin(found))
        if least in (0, len(RATIOS) - 1) or found[least] >= self.profile(0.0):
            return 0.0 if least < len(RATIOS) - 1 else float(RATIOS[-1])
        return float(brentq(self.score, RATIOS[least - 1], RATIOS[least + 1], xtol=1e-300, rtol=1e-13))


@dataclass(frozen=True)
class _Runs:
    """The valid runs: coded points (n, k), values, row of the design, group of each; columns of fixed blocks.

    levels: number of names per factor, 0 for a number.
    """

    points: FloatArray
    observed: FloatArray
    row: IntArray
    names: tuple[str, ...]
    group: IntArray
    fixed: FloatArray
    levels: tuple[int, ...]

    def matrix(self, terms: Sequence[str]) -> FloatArray:
        """The model matrix: intercept and terms, then blocks."""
        return np.column_stack([columns_of(self.levels, terms).matrix(self.points), self.fixed])

    def spare(self, terms: Sequence[str]) -> int:
        """The lesser of the degrees of freedom between and within groups; -1 if the terms cannot be separated."""
        model = self.matrix(terms)
        indicator = (self.group[:, None] == np.arange(len(self.names))).astype(np.float64)
        rank, both = np.linalg.matrix_rank(model), np.linalg.matrix_rank(np.column_stack([model, indicator]))
        return int(min(both - rank, len(model) - both)) if rank == model.shape[1] else -1


def fit_random(
    coded: FloatArray,
    responses: FloatArray,
    region: Region,
    levels: Sequence[tuple[str, ...]],
    groups: Blocks,
    order: Order | None = None,
    terms: Sequence[str] = (),
    blocks: Blocks | None = None,
) -> RandomFit:
    """Fit a model to every valid run; groups are drawn at random, blocks are fixed. Other arguments as in `fit_named`.

    The default is the highest order that leaves 3 degrees of freedom, if any does, both between and within groups.
    Raises StatisticsError if the runs do not support the model, or the groups leave no scatter to compare.
    """
    values, row, observed = valid_runs(responses, len(coded))
    fixed = np.zeros((len(row), 0))
    if blocks is not None:
        block_names, block = used_blocks(blocks, values)
        fixed = block_columns(block, len(block_names))
    runs = _Runs(coded[row], observed, row, *used_blocks(groups, values), fixed, tuple(map(len, levels)))
    chosen = _terms(runs, hierarchical(region.names, terms) if terms else None, order)
    likelihood = _Likelihood(runs.matrix(chosen), observed, runs.group)
    dust = 8 * np.finfo(np.float64).eps * float(np.abs(observed).max())
    if math.sqrt(max(likelihood.solved(0.0)[2], 0.0) / likelihood.df) <= dust:
        raise StatisticsError("responses: the terms explain the runs exactly; without scatter nothing can be tested")
    ratio = likelihood.best_ratio()
    inverse, coefficients, squares = likelihood.solved(ratio)
    within = squares / likelihood.df
    least = likelihood.deviance(within, ratio * within)
    gain = max(0.0, likelihood.profile(0.0) - least)
    coefficients = coefficients.copy()
    coefficients[0] += likelihood.origin
    errors = _Errors(likelihood, ratio, within, inverse)
    fixed_part = likelihood.model @ coefficients
    sums = np.bincount(runs.group, weights=observed - fixed_part)
    effects = ratio / (1 + ratio * likelihood.sizes) * sums
    columns = columns_of(runs.levels, chosen)
    of_column = [term_of(name) for name in columns.names]
    single = [k for k, name in enumerate(of_column) if of_column.count(name) == 1]
    at = np.eye(len(of_column))
    return RandomFit(
        levels=tuple(levels),
        terms=chosen,
        groups=runs.names,
        runs_of_group=np.bincount(runs.group),
        effects=effects,
        components=_components(likelihood, within, ratio * within),
        p_groups=float(stats.chi2.sf(gain, 1)) / 2 if gain > 0 else 1.0,
        deviance=least,
        tests=tuple(
            errors.test(term, coefficients, [k for k, name in enumerate(of_column) if name == term]) for term in chosen
        ),
        coefficients=tuple(Estimate(of_column[k], *errors.estimate(at[k], coefficients)) for k in single),
        means=_means(mean_contrasts(levels, chosen, columns, region.names), errors, coefficients),
        observed=observed,
        predicted=fixed_part,
        predicted_in_group=fixed_part + effects[runs.group],
        row_of_run=row,
    )


def _terms(runs: _Runs, given: tuple[str, ...] | None, order: Order | None) -> tuple[str, ...]:
    """The given terms, those of an order, or of the highest that the runs support; raises StatisticsError for none."""
    orders = orders_of(runs.levels)
    if given is not None:
        chosen = given
    elif order is not None:
        chosen = orders[order]
    else:
        able = [one for one in orders.values() if runs.spare(one) >= 1]
        chosen = [orders["linear"], *able, *(one for one in able if runs.spare(one) >= LEAST_DF)][-1]
    if runs.spare(chosen) < 1:
        raise StatisticsError(
            f"responses: {len(runs.row)} valid runs in {len(runs.names)} groups are too few to separate "
            f"{', '.join(chosen)} from one another and from the groups, and to estimate the scatter between and within "
            "groups; allowed: fewer terms, or more groups"
        )
    return chosen


def _components(likelihood: _Likelihood, within: float, between: float) -> tuple[Component, Component]:
    """Both variances with their intervals."""
    return (
        Component("between groups", between, *_interval(likelihood, within, between, 1), between / (between + within)),
        Component("within", within, *_interval(likelihood, within, between, 0), within / (between + within)),
    )


def _means(
    contrasts: Iterable[tuple[str, str, FloatArray, FloatArray]], errors: _Errors, coefficients: FloatArray
) -> tuple[NameMean, ...]:
    """The mean of every name with its interval, and its effect."""
    found = []
    for factor, name, mean_at, effect_at in contrasts:
        mean, error, df, _ = errors.estimate(mean_at, coefficients)
        half = float(stats.t.ppf(0.975, df)) * error
        effect, effect_error, _, p = errors.estimate(effect_at, coefficients)
        found.append(NameMean(factor, name, mean, mean - half, mean + half, effect, effect_error, p))
    return tuple(found)


class _Errors:
    """Standard errors of contrasts of the coefficients, with their degrees of freedom."""

    def __init__(self, likelihood: _Likelihood, ratio: float, within: float, inverse: FloatArray) -> None:
        self.covariance = within * inverse
        shrunk = likelihood.model_sums / (1 + ratio * likelihood.sizes)[:, None]
        by_between = inverse @ shrunk.T @ shrunk @ inverse
        self.slopes = ((self.covariance - ratio * within * by_between) / within, by_between)
        if ratio == 0:  # at its bound the variance of the groups is not estimated, and the error is that of all runs
            self.variances = np.diag([2 * within**2 / likelihood.df, 0.0])
            return
        projected = likelihood.projected(ratio)
        trace, square = float(np.trace(projected)), float((projected**2).sum())
        mixed = trace - ratio * square
        information = np.array([[likelihood.df - ratio * (trace + mixed), mixed], [mixed, square]]) / (2 * within**2)
        self.variances = np.linalg.inv(information)

    def of(self, contrast: FloatArray) -> tuple[float, float]:
        """Standard error and degrees of freedom."""
        variance = float(contrast @ self.covariance @ contrast)
        slope = np.array([contrast @ one @ contrast for one in self.slopes])
        return math.sqrt(variance), 2 * variance**2 / float(slope @ self.variances @ slope)

    def estimate(self, at: FloatArray, coefficients: FloatArray) -> tuple[float, float, float, float]:
        """Value, standard error, degrees of freedom and p of a contrast of the terms."""
        contrast = np.append(at, np.zeros(len(coefficients) - len(at)))
        value, error, df = float(contrast @ coefficients), *self.of(contrast)
        return value, error, df, 2 * float(stats.t.sf(abs(value) / error, df))

    def test(self, source: str, coefficients: FloatArray, own: list[int]) -> RandomTest:
        """F test of several coefficients together."""
        value, axes = np.linalg.eigh(self.covariance[np.ix_(own, own)])
        contrasts = np.zeros((len(own), len(coefficients)))
        contrasts[:, own] = axes.T
        f = float(((contrasts @ coefficients) ** 2 / value).mean())
        df = np.array([self.of(contrast)[1] for contrast in contrasts])
        total = float((df[df > 2] / (df[df > 2] - 2)).sum())
        if np.ptp(df) <= 1e-6 * df.max():
            error_df = float(df.mean())
        else:
            error_df = 2 * total / (total - len(own)) if total > len(own) else 2.0
        return RandomTest(source, len(own), error_df, f, float(stats.f.sf(f, len(own), error_df)))


def _interval(likelihood: _Likelihood, within: float, between: float, which: int) -> tuple[float, float]:
    """Ends of the interval of one variance whose deviance, minimised over the other, is within DROP of the least."""
    best, scale = (within, between)[which], within + between
    least = likelihood.deviance(within, between)

    def rise(value: float) -> float:
        def deviance(log_other: float) -> float:
            other = scale * math.exp(log_other)
            return likelihood.deviance(*((value, other) if which == 0 else (other, value)))

        found = minimize_scalar(deviance, bounds=(-16.0, 12.0), method="bounded", options={"xatol": 1e-7})
        alone = likelihood.deviance(value, 0.0) if which == 0 else math.inf
        return min(float(found.fun), alone) - least - DROP

    low, high = 0.0, max(best, 1e-3 * scale)
    while rise(high) < 0 and high < 1e12 * scale:
        high *= 2
    upper = float(brentq(rise, max(best, 1e-9 * scale), high, rtol=1e-7))
    floor = 1e-9 * scale
    if best > floor and rise(floor) > 0:
        low = float(brentq(rise, floor, best, rtol=1e-7))
    return low, upper
