"""What a design can detect, computed before it is run: power, smallest resolved effect, and the replicates needed.

Notation: sigma = standard deviation of one run; SE = standard error of the effect under test; an effect delta
is tested by t = estimate/SE against Student's t, and under delta that t is noncentral with shift delta/SE.
Source: Cohen 1988, Statistical Power Analysis, ch. 2; computed by statsmodels.

A factor of three or more names is tested by all t columns of its term together: F = SS/(t s²) is noncentral with
λ = (delta/SE)². The change delta is the difference between two names with the others midway between them, the pattern
that is hardest to detect (Cohen 1988, ch. 8), for the pair of names for which this is worst; then
1/SE² = |(I - P) v|²/sigma², with v a change of 1 at every run and P the projection onto the columns of all other terms.
With equal numbers of runs SE is the standard error of the difference of two means. With t = 1 this is the t test above.

The change of the response is counted from low to high for a factor and for an interaction (2 b), from the centre to the
ends for a square (b). Its SE in a design is sigma sqrt([(X'X)^-1]_jj), times two for 2 b.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations

import numpy as np
import numpy.typing as npt
from scipy import optimize, stats

from doe.analysis.named_factors import columns_of, term_of
from doe.analysis.surface import block_columns, included_terms, second_order_terms, term_names, with_intercept
from doe.designs.design import factor_letters
from doe.designs.optimal import codes
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

MAX_REPLICATES = 100_000


@dataclass(frozen=True)
class TermPrecision(Record):
    """Least precise term of a kind ("factor", "name", "interaction", "square"); unit of sigma. "name": a factor of
    three or more names. df_term: number of columns by which the term is tested together.

    smallest: change that is detected with power `power_wanted` at p < alpha; all: the same for all terms at once
    (Bonferroni). power: power for `effect`; NaN without one. NaN if no degree of freedom is left for the error.
    """

    kind: str
    terms: int
    standard_error: float
    df: int
    smallest: float
    smallest_of_all: float
    effect: float
    power: float
    df_term: int = 1

    def chance(self, change: float) -> float:
        """Return the power to detect a change of that size at p < 0.05."""
        return term_power(change, self.standard_error, self.df, self.df_term)


def precision(
    coded: FloatArray,
    names: Sequence[str],
    terms: Sequence[str],
    sigma: float,
    effect: float = math.nan,
    alpha: float = 0.05,
    block: npt.NDArray[np.int64] | None = None,
) -> tuple[TermPrecision, ...]:
    """Return how precisely runs at `coded`, shape (runs, factors), estimate each kind of term of the model.

    terms: as in `doe.analysis.surface.term_names`. sigma: standard deviation of one run, unit of the response.
    block: the block of each run, (runs,), from 0; None or empty if there are no blocks.
    Raises StatisticsError for a sigma or an effect that is not positive, or terms that the runs cannot separate.
    """
    _require_noise(sigma, effect)
    included = included_terms(names, terms)
    model = _with_blocks(second_order_terms(coded)[:, included], block)
    errors = sigma * np.sqrt(np.diag(np.linalg.inv(model.T @ model)))
    df = model.shape[0] - model.shape[1]
    kinds = [_kind(term) for term, is_in in zip(term_names(names), included, strict=True) if is_in]
    errors = errors[: len(kinds)]
    found = []
    for kind in ("factor", "interaction", "square"):
        of_kind = [error for error, own in zip(errors, kinds, strict=True) if own == kind]
        if not of_kind:
            continue
        error = float(max(of_kind)) * (1.0 if kind == "square" else 2.0)
        known = df >= 1 and math.isfinite(effect)
        found.append(
            TermPrecision(
                kind=kind,
                terms=len(of_kind),
                standard_error=error,
                df=df,
                smallest=smallest_effect(error, df, alpha),
                smallest_of_all=smallest_effect(error, df, alpha / (len(kinds) - 1)),
                effect=effect,
                power=t_test_power(effect, error, df, alpha) if known else math.nan,
            )
        )
    return tuple(found)


def precision_of_names(
    coded: FloatArray,
    levels: Sequence[int],
    terms: Sequence[str],
    sigma: float,
    effect: float = math.nan,
    alpha: float = 0.05,
    block: npt.NDArray[np.int64] | None = None,
) -> tuple[TermPrecision, ...]:
    """Return the same as `precision` for designs with factors that are names.

    levels: number of names per factor, 0 for a number; coded: for a factor of names the codes of `doe.designs.optimal`.
    terms: as in `doe.analysis.named_factors.orders_of`. Other arguments and errors as in `precision`.
    """
    _require_noise(sigma, effect)
    columns = columns_of(levels, terms)
    model = _with_blocks(columns.matrix(coded), block)
    own = [term_of(name) for name in columns.names]
    df = model.shape[0] - model.shape[1]
    worst: dict[str, TermPrecision] = {}
    for term in terms:
        of_term = np.array([name == term for name in own] + [False] * (model.shape[1] - len(own)))
        others = model[:, ~of_term]
        changes = _changes(coded, levels, term)
        seen = changes - others @ np.linalg.lstsq(others, changes, rcond=None)[0]
        error, df_term = sigma / math.sqrt(float((seen**2).sum(axis=0).min())), int(of_term.sum())
        known = df >= 1 and math.isfinite(effect)
        found = TermPrecision(
            kind="name" if "*" not in term and df_term > 1 else _kind(term),
            terms=1,
            standard_error=error,
            df=df,
            smallest=smallest_effect(error, df, alpha, df_term=df_term),
            smallest_of_all=smallest_effect(error, df, alpha / len(terms), df_term=df_term),
            effect=effect,
            power=term_power(effect, error, df, df_term, alpha) if known else math.nan,
            df_term=df_term,
        )
        before = worst.get(found.kind, found)
        # Without degrees of freedom for the error, there is no smallest change by which to compare.
        poorer = max(before, found, key=lambda one: (np.nan_to_num(one.smallest), one.standard_error))
        worst[found.kind] = replace(poorer, terms=before.terms + (found.kind in worst))
    return tuple(worst[kind] for kind in ("factor", "name", "interaction", "square") if kind in worst)


def _with_blocks(terms: FloatArray, block: npt.NDArray[np.int64] | None) -> FloatArray:
    """The model of `terms`, shape (runs, terms), with blocks; StatisticsError if the runs cannot separate them."""
    model = terms
    if block is not None and block.size:
        model = np.column_stack([model, block_columns(block, int(block.max()) + 1)])
    if np.linalg.matrix_rank(model) < model.shape[1]:
        raise StatisticsError(f"the {len(model)} runs cannot separate the {model.shape[1]} columns of the model")
    return model


def _changes(coded: FloatArray, levels: Sequence[int], term: str) -> FloatArray:
    """Every change of 1 by `term` at the runs, shape (runs, changes), in the pattern described above."""
    letters = factor_letters(len(levels))
    if term.endswith("^2"):
        return coded[:, [letters.index(term.removesuffix("^2"))]] ** 2
    changes = np.full((len(coded), 1), 0.5)
    for letter in term.split("*"):
        factor = letters.index(letter)
        patterns = coded[:, [factor]]
        if names := levels[factor]:
            of_run = np.abs(coded[:, [factor]] - codes(names)).argmin(axis=1)
            ends = np.eye(names)[of_run]
            patterns = np.column_stack([ends[:, b] - ends[:, a] for a, b in combinations(range(names), 2)])
        changes = (changes[:, :, None] * patterns[:, None, :]).reshape(len(coded), -1)
    return changes


def term_power(effect: float, standard_error: float, df: float, df_term: int, alpha: float = 0.05) -> float:
    """Return the probability that the test of a term by `df_term` columns together rejects at level `alpha`.

    `effect` and `standard_error` are delta and SE as defined above; the noncentral F has the shift (effect/SE)².
    """
    if df_term == 1:
        return t_test_power(effect, standard_error, df, alpha)
    return float(stats.ncf.sf(stats.f.isf(alpha, df_term, df), df_term, df, (effect / standard_error) ** 2))


def t_test_power(effect: float, standard_error: float, df: float, alpha: float = 0.05) -> float:
    """Return the probability that a two-sided t test at level `alpha` rejects if the true effect is `effect`.

    `effect` and `standard_error` share one unit; `df` are the degrees of freedom of the error estimate.
    """
    from statsmodels.stats.power import ttest_power

    shift = abs(effect) / standard_error
    beyond, opposite = (ttest_power(shift, 1, alpha / 2, df, alternative=side) for side in ("larger", "smaller"))
    # The far tail is NaN once it underflows; it is then zero to double precision.
    return float(min(1.0, beyond + (opposite if np.isfinite(opposite) else 0.0)))


def smallest_effect(
    standard_error: float, df: float, alpha: float = 0.05, power: float = 0.8, df_term: int = 1
) -> float:
    """Return the effect that a two-sided t test detects with probability `power`, in the unit of `standard_error`.

    df_term: number of columns by which a term is tested together; several are tested by F (`term_power`). NaN without
    degrees of freedom; zero if the standard error is zero.
    """
    if df < 1 or not math.isfinite(standard_error):
        return math.nan
    return standard_error * _smallest_shift(df, alpha, power, df_term) if standard_error > 0 else 0.0


def smallest_difference(sigma: float, replicates: int, alpha: float = 0.05, power: float = 0.8) -> float:
    """Return the difference of two means of `replicates` runs each that a pooled t test resolves. Unit of
    `sigma`.
    """
    return smallest_effect(sigma * math.sqrt(2 / replicates), 2 * replicates - 2, alpha, power)


def smallest_main_effect(
    sigma: float,
    replicates: int,
    rows: int = 28,
    alpha: float = 0.05,
    power: float = 0.8,
    comparisons: int = 1,
    efficiency: float = 1.0,
) -> float:
    """Return the main effect, the change from low to high, that a design of `rows` x `replicates` runs resolves.

    SE = 2 sigma/sqrt(efficiency x rows x replicates), see `main_effect_efficiency`; the error has
    rows x (replicates - 1) degrees of freedom (pure error), so the answer is NaN for one replicate. `comparisons`
    divides alpha (Bonferroni).
    """
    standard_error = 2 * sigma / math.sqrt(efficiency * rows * replicates)
    return smallest_effect(standard_error, rows * (replicates - 1), alpha / comparisons, power)


def main_effect_efficiency(design: FloatArray) -> float:
    """Return the information on the least precise main effect of a design as a share of that in as many rows at ±1.

    design: coded points, shape (rows, factors). At worst Var(2 b_j) = 4 sigma²/(efficiency x rows); 1 for orthogonal
    two-level designs, less if rows lie in the middle or factors are correlated. Raises StatisticsError if the rows
    cannot separate the factors.
    """
    model = with_intercept(design)
    if np.linalg.matrix_rank(model) < model.shape[1]:
        raise StatisticsError(f"{len(design)} rows cannot tell {design.shape[1]} factors and the mean apart")
    worst = float(np.diag(np.linalg.inv(model.T @ model))[1:].max())
    # Rounding of the inverse must not count as a loss: orthogonal designs have exactly 1.
    return round(1.0 / (len(design) * worst), 12)


def smallest_linear_effect(
    sigma: float, replicates: int, design: FloatArray, alpha: float = 0.05, power: float = 0.8
) -> float:
    """Return the change from low to high of one factor, 2 b_i, that a second-order model of `design` resolves.

    design: coded points, shape (points, factors), each run `replicates` times. SE = 2 sigma sqrt(v/replicates)
    with v the largest diagonal entry of (X'X)^-1 for a linear term, since some designs estimate factors with different
    precision; the error is the residual of the model.
    """
    model = second_order_terms(design)
    variance = float(np.diag(np.linalg.inv(model.T @ model))[1 : 1 + design.shape[1]].max())
    df = model.shape[0] * replicates - model.shape[1]
    return smallest_effect(2 * sigma * math.sqrt(variance / replicates), df, alpha, power)


def replicates_for_difference(effect: float, sigma: float, alpha: float = 0.05, power: float = 0.8) -> int:
    """Return the least runs per group with which a two-sample comparison resolves `effect` (unit of `sigma`).

    Raises StatisticsError unless effect > 0 and sigma > 0.
    """
    _require_positive(effect=effect, sigma=sigma)
    return _least_replicates(
        2, lambda n: t_test_power(effect, sigma * math.sqrt(2 / n), 2 * n - 2, alpha) >= power, effect, sigma
    )


def replicates_for_main_effect(
    effect: float,
    sigma: float,
    rows: int = 28,
    alpha: float = 0.05,
    power: float = 0.8,
    comparisons: int = 1,
    efficiency: float = 1.0,
) -> int:
    """Return the least replicates per row (at least 2) with which a design resolves a main effect.

    Arguments as in `smallest_main_effect`. Raises StatisticsError unless effect > 0 and sigma > 0.
    """
    _require_positive(effect=effect, sigma=sigma)

    def enough(n: int) -> bool:
        standard_error = 2 * sigma / math.sqrt(efficiency * rows * n)
        return t_test_power(effect, standard_error, rows * (n - 1), alpha / comparisons) >= power

    return _least_replicates(2, enough, effect, sigma)


def replicates_for_linear_effect(
    effect: float, sigma: float, design: FloatArray, alpha: float = 0.05, power: float = 0.8
) -> int:
    """Return the least replicates per point with which a second-order model resolves a change from low to high.

    Arguments as in `smallest_linear_effect`. Raises StatisticsError unless effect > 0 and sigma > 0.
    """
    _require_positive(effect=effect, sigma=sigma)

    def enough(n: int) -> bool:
        return smallest_linear_effect(sigma, n, design, alpha, power) <= effect

    return _least_replicates(1, enough, effect, sigma)


@lru_cache(maxsize=4096)
def _smallest_shift(df: float, alpha: float, power: float, df_term: int) -> float:
    """Return the effect in standard errors; cached, as the same few are needed again and again."""

    def shortfall(shift: float) -> float:
        return term_power(shift, 1.0, df, df_term, alpha) - power

    upper = 2.0
    while shortfall(upper) < 0:
        upper *= 2
    return float(optimize.brentq(shortfall, 0.0, upper))


def _least_replicates(least: int, enough: Callable[[int], bool], effect: float, sigma: float) -> int:
    """Return the smallest n >= `least` with enough(n), by doubling and bisection (power grows with n)."""
    upper = least
    while not enough(upper):
        upper *= 2
        if upper > MAX_REPLICATES:
            raise StatisticsError(
                f"effect = {effect:g} at sigma = {sigma:g} needs more than {MAX_REPLICATES} replicates; "
                "allowed is a larger effect"
            )
    lower = max(least, upper // 2)
    while lower < upper:
        middle = (lower + upper) // 2
        lower, upper = (lower, middle) if enough(middle) else (middle + 1, upper)
    return lower


def _require_noise(sigma: float, effect: float) -> None:
    for name, value in (("sigma", sigma), ("effect", effect)):
        if not (value > 0 or (name == "effect" and math.isnan(value))) or math.isinf(value):
            raise StatisticsError(f"{name} = {value:g} must be a positive number")


def _require_positive(**values: float) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise StatisticsError(f"{name} = {value} must be a positive number")


def _kind(term: str) -> str:
    if term == "intercept":
        return term
    return "square" if term.endswith("^2") else "interaction" if "*" in term else "factor"
