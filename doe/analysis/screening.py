"""Screening: which factors of a design affect the response, tested against two error estimates side by side.

Model: mean response of row r = intercept + sum_j effect_j/2 x_rj, fitted by least squares to the row means. The
effect is the change from low to high, in the unit of the response: mean(+) - mean(-) of a two-level design without a
missing row. Sums of squares are partial (Type III) on the scale of row means: SS = runs/4 effect^2 for such a design.

Two errors: (a) what the factors leave unexplained, that is the dummy columns (Plackett and Burman 1946), with
few degrees of freedom and inflated by aliased interactions; (b) the replicates of each row (pure error).
Lenth's pseudo standard error (Lenth 1989, Technometrics 31:469), for designs without replicates, is given as a third
estimate. Many effects are tested at once, so p values are corrected by Holm's step-down method.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.power import smallest_effect
from doe.analysis.replicates import centred, require_matrix, row_moments
from doe.analysis.surface import least_squares, with_intercept
from doe.errors import StatisticsError
from doe.record import Record

__all__ = ["FALLBACK", "SIGNIFICANT", "Screening", "Selected", "analyse_screening", "select_factors"]

FloatArray = npt.NDArray[np.float64]
Adjustment = Literal["none", "holm"]
ErrorSource = Literal["replicates", "dummies"]

SIGNIFICANT = "significant"
FALLBACK = "fallback: not significant"


@dataclass(frozen=True)
class EffectTest(Record):
    """One effect against one error: t = effect/standard_error, f = t^2; p values raw and corrected for all
    factors.
    """

    standard_error: float
    t: float
    f: float
    p: float
    p_holm: float
    p_bonferroni: float


@dataclass(frozen=True)
class FactorEffect(Record):
    """One column of the design: effect in the unit of the response, partial sum of squares, share of the
    total.
    """

    name: str
    is_dummy: bool
    effect: float
    sum_of_squares: float
    contribution_percent: float
    by_dummies: EffectTest | None
    by_replicates: EffectTest | None

    def test_by(self, source: ErrorSource) -> EffectTest | None:
        """Return the test against an error; None if there is none."""
        return self.by_replicates if source == "replicates" else self.by_dummies


@dataclass(frozen=True)
class ErrorEstimate(Record):
    """An error estimate and the effects that it can detect. Margins and effects are in the unit of the response.

    `sigma` is the standard deviation of a row mean (source "dummies") or of one run (source "replicates");
    `margin` is the |effect| at which p = alpha, `margin_bonferroni` the same for all factors at once;
    `smallest_detectable_effect` is detected with probability 0.8. With unbalanced data every effect has its own
    standard error; `standard_error` is then the median.
    """

    source: ErrorSource
    sigma: float
    df: int
    standard_error: float
    t_limit: float
    t_limit_bonferroni: float
    margin: float
    margin_bonferroni: float
    smallest_detectable_effect: float
    smallest_detectable_effect_bonferroni: float


@dataclass(frozen=True)
class Lenth(Record):
    """Lenth's pseudo standard error with its individual and simultaneous 95 % margins, unit of the
    response.
    """

    pseudo_standard_error: float
    df: float
    margin: float
    simultaneous_margin: float


@dataclass(frozen=True)
class Screening(Record):
    """Effects of a two-level design. `mean` is the response at the centre (the intercept); `missing_rows` are row
    indices without a valid run; `notes` are sentences.
    """

    effects: tuple[FactorEffect, ...]
    mean: float
    rows: int
    missing_rows: tuple[int, ...]
    runs: int
    total_sum_of_squares: float
    dummy_error: ErrorEstimate | None
    pure_error: ErrorEstimate | None
    lenth: Lenth
    unexplained_f: float
    unexplained_p: float
    notes: tuple[str, ...]

    @property
    def error_source(self) -> ErrorSource | None:
        """Return the error that decides: the replicates if there are any, else the dummies; None without either."""
        return None if self.deciding_error is None else self.deciding_error.source

    @property
    def deciding_error(self) -> ErrorEstimate | None:
        """Return the estimate of the error that decides; None without replicates or dummies."""
        return self.pure_error or self.dummy_error

    def error(self, source: ErrorSource) -> ErrorEstimate | None:
        """Return the estimate of an error; None if the design gives none."""
        return self.pure_error if source == "replicates" else self.dummy_error

    def half_width(self, effect: FactorEffect) -> float:
        """Return half the 95 % interval of `effect`: t limit × its standard error; NaN if it was not tested."""
        error, test = self.deciding_error, self.deciding_test(effect)
        return math.nan if error is None or test is None else error.t_limit * test.standard_error

    def factor_effects(self) -> tuple[FactorEffect, ...]:
        """Return the effects of the factors that could be estimated, by falling size."""
        known = [effect for effect in self.effects if not effect.is_dummy and math.isfinite(effect.effect)]
        return tuple(sorted(known, key=lambda effect: -abs(effect.effect)))

    def deciding_test(self, effect: FactorEffect) -> EffectTest | None:
        """Return the test of `effect` against the error that decides."""
        return effect.by_replicates if self.pure_error is not None else effect.by_dummies

    def ranked(self) -> tuple[FactorEffect, ...]:
        """Return the factors (no dummies) by falling |t|; without any error, by falling |effect|."""

        def size(effect: FactorEffect) -> float:
            test = self.deciding_test(effect)
            value = abs(effect.effect) if test is None else abs(test.t)
            return value if math.isfinite(value) else (math.inf if value > 0 else -1.0)

        return tuple(sorted((e for e in self.effects if not e.is_dummy), key=size, reverse=True))

    def significant(
        self, alpha: float = 0.05, adjust: Adjustment = "holm", error: ErrorSource | None = None
    ) -> tuple[str, ...]:
        """Return the factors with p < alpha by falling |t|, against the error that decides unless one is named.

        The default corrects for the number of factors (Holm 1979), so that `alpha` is the probability of any false
        positive; "none" is the paper's way, with one false positive expected per 1/alpha factors.
        """
        found = []
        for effect in self.ranked():
            test = self.deciding_test(effect) if error is None else effect.test_by(error)
            if test is not None and (test.p_holm if adjust == "holm" else test.p) < alpha:
                found.append(effect.name)
        return tuple(found)


@dataclass(frozen=True)
class Selected(Record):
    """A factor taken to the next stage and why: "significant", "significant in" another target, or "fallback: not
    significant"."""

    name: str
    reason: str


def analyse_screening(
    design: npt.NDArray[np.number[Any]],
    names: Sequence[str],
    responses: FloatArray,
    dummies: Sequence[str],
    alpha: float = 0.05,
) -> Screening:
    """Estimate and test the main effects of a design.

    design: levels from -1 to +1, shape (rows, columns). names: one per column. responses: shape (rows, replicates),
    NaN where a run is missing. dummies: the names of columns that carry no factor. Rows without any valid run
    are left out and reported; the factors are then estimated by least squares on the rest, and the dummies are
    no longer estimable.

    Raises StatisticsError when shapes or names disagree, levels are beyond -1 … +1 or the rows left cannot
    separate the factors.
    """
    _require_consistent(design, names, dummies)
    values = require_matrix("responses", responses, rows=design.shape[0])
    means, counts, within = row_moments(values)
    valid = counts > 0
    is_dummy = np.array([name in set(dummies) for name in names])
    levels, counts = design[valid].astype(np.float64), counts[valid]
    mean, means = float(means[valid].mean()), centred(means[valid])
    _require_estimable(levels[:, ~is_dummy], valid)

    complete = bool(valid.all())
    used = np.ones_like(is_dummy) if complete else ~is_dummy
    found = least_squares(with_intercept(levels[:, used]), means)
    estimator = 2 * found.model.pinv_wexog[1:]
    effects = np.full(len(names), np.nan)
    effects[used] = 2 * found.params[1:]
    norms = np.full(len(names), np.nan)
    norms[used] = 4 * np.diag(found.normalized_cov_params)[1:]
    sums = effects**2 / norms
    total = float(means @ means)

    dummies_left = levels[:, is_dummy] if complete else levels[:, :0]
    dummy_error, dummy_scale = error_of_dummies(levels[:, ~is_dummy], dummies_left, means, norms[~is_dummy], alpha)
    spread = np.full(len(names), np.nan)
    spread[used] = np.sqrt((estimator**2 / counts).sum(axis=1))
    df_pure = int((counts - 1).sum())
    pure_sigma = math.sqrt(float(within.sum()) / df_pure) if df_pure else math.nan
    pure_error = (
        error_estimate("replicates", pure_sigma, df_pure, pure_sigma * spread[~is_dummy], alpha) if df_pure else None
    )
    by_dummies = effect_tests(effects, dummy_scale * np.sqrt(norms), dummy_error, is_dummy)
    by_replicates = effect_tests(effects, pure_sigma * spread, pure_error, is_dummy)
    unexplained_f, unexplained_p = unexplained_by_factors(levels[:, ~is_dummy], means, counts, pure_sigma, df_pure)

    return Screening(
        effects=tuple(
            FactorEffect(
                name=name,
                is_dummy=bool(is_dummy[j]),
                effect=float(effects[j]),
                sum_of_squares=float(sums[j]),
                contribution_percent=100 * float(sums[j]) / total if total > 0 else math.nan,
                by_dummies=None if is_dummy[j] else by_dummies[j],
                by_replicates=by_replicates[j],
            )
            for j, name in enumerate(names)
        ),
        mean=mean + float(means[0] + found.params[0]),  # the fit is of the differences from the first row
        rows=int(design.shape[0]),
        missing_rows=tuple(int(row) for row in np.flatnonzero(~valid)),
        runs=int(counts.sum()),
        total_sum_of_squares=total,
        dummy_error=dummy_error,
        pure_error=pure_error,
        lenth=lenth(effects[used], alpha),
        unexplained_f=unexplained_f,
        unexplained_p=unexplained_p,
        notes=_notes(
            *(valid, dummy_error, pure_error, pure_sigma, total, unexplained_p),
            leaks=unexplained_p < 0.05 and _leaks(levels, names, is_dummy),
        ),
    )


def select_factors(
    screening: Screening,
    n: int = 3,
    fallback: Sequence[str] = (),
    exclude: Sequence[str] = (),
    alpha: float = 0.05,
    adjust: Adjustment = "holm",
    further: Mapping[str, Screening] | None = None,
) -> tuple[Selected, ...]:
    """Return the `n` factors of the next stage, each with its reason.

    Significant factors come first, by falling |t|, the largest over all targets (`further`: analyses of the further
    targets by name), then `fallback` in its order. `exclude`: columns that this set-up cannot test, even if they were
    given up as dummies here and not in `further`. Raises StatisticsError if both together give fewer than `n`, or a
    name is not a factor.
    """
    known = {effect.name for effect in screening.effects if not effect.is_dummy or effect.name in exclude}
    for name in (*fallback, *exclude):
        if name not in known:
            raise StatisticsError(f"'{name}' is not a factor of the screening; allowed: {', '.join(sorted(known))}")
    sizes: dict[str, tuple[float, str]] = {}
    for target, one in {"": screening, **(further or {})}.items():
        found, reason = one.significant(alpha, adjust), f"{SIGNIFICANT} in {target}" if target else SIGNIFICANT
        for effect in one.effects:
            test = one.deciding_test(effect) if effect.name in found and effect.name not in exclude else None
            if test is not None:
                size, said = sizes.get(effect.name, (0.0, reason))
                sizes[effect.name] = max(size, abs(test.t)), said
    chosen = [Selected(name, sizes[name][1]) for name in sorted(sizes, key=lambda name: -sizes[name][0])]
    for name in fallback:
        if name not in exclude and name not in {selected.name for selected in chosen}:
            chosen.append(Selected(name, FALLBACK))
    if len(chosen) < n:
        raise StatisticsError(
            f"fallback = {list(fallback)} leaves {len(chosen)} of {n} factors after {len(exclude)} exclusions"
            "; name more factors in the fallback list"
        )
    return tuple(chosen[:n])


def error_of_dummies(
    levels: FloatArray, dummies: FloatArray, means: FloatArray, norms: FloatArray, alpha: float
) -> tuple[ErrorEstimate | None, float]:
    """Return the error of row means and its standard deviation (NaN without df): what the columns `dummies` explain
    beyond the factors. Without such columns it is all that the factors leave.
    """
    model = with_intercept(levels)
    df = model.shape[0] - model.shape[1]
    if df < 1:
        return None, math.nan
    squares = float(least_squares(model, means).ssr)
    if 0 < dummies.shape[1] < df:
        # In a fold-over, the rest of what the factors leave holds the interactions, from which the factors are clear.
        squares -= float(least_squares(np.hstack([model, dummies]), means).ssr)
        df = dummies.shape[1]
    sigma = math.sqrt(max(squares, 0.0) / df)
    return error_estimate("dummies", sigma, df, sigma * np.sqrt(norms), alpha), sigma


def error_estimate(
    source: Literal["dummies", "replicates"], sigma: float, df: int, standard_errors: FloatArray, alpha: float
) -> ErrorEstimate:
    """Return the limits of an error with `df` degrees of freedom; one standard error per factor."""
    factors, error = standard_errors.size, float(np.median(standard_errors))
    limit = float(stats.t.ppf(1 - alpha / 2, df))
    limit_all = float(stats.t.ppf(1 - alpha / 2 / factors, df))
    return ErrorEstimate(
        source,
        sigma,
        df,
        error,
        limit,
        limit_all,
        limit * error,
        limit_all * error,
        smallest_effect(error, df, alpha),
        smallest_effect(error, df, alpha / factors),
    )


def effect_tests(
    effects: FloatArray, errors: FloatArray, estimate: ErrorEstimate | None, is_dummy: npt.NDArray[np.bool_]
) -> list[EffectTest | None]:
    """Return one test per column; None where the effect or the error is not estimable.

    With an error of exactly zero nothing can be tested: t and p are NaN.
    """
    if estimate is None:
        return [None] * effects.size
    t = effects / np.where(errors > 0, errors, np.nan)
    p = 2 * stats.t.sf(np.abs(t), estimate.df)
    factors = int((~is_dummy).sum())
    p_holm = np.full(p.shape, np.nan)
    p_holm[~is_dummy] = holm(p[~is_dummy])
    p_bonferroni = np.where(is_dummy, np.nan, np.minimum(1.0, factors * p))
    return [
        None
        if np.isnan(effects[j])
        else EffectTest(
            float(errors[j]),
            float(t[j]),
            float(t[j] ** 2),
            float(p[j]),
            float(p_holm[j]),
            float(p_bonferroni[j]),
        )
        for j in range(effects.size)
    ]


def holm(p_values: FloatArray) -> FloatArray:
    """Return step-down adjusted p values (Holm 1979, Scand. J. Stat. 6:65), shape of the input; NaN stays
    NaN.
    """
    # The same numbers as statsmodels' multipletests, which runs the garbage collector at every call: 0.2 s each,
    # several times for every update of a running study.
    adjusted = np.full(p_values.shape, np.nan)
    order = [int(i) for i in np.argsort(p_values) if not np.isnan(p_values[i])]
    running = 0.0
    for rank, i in enumerate(order):
        running = max(running, min(1.0, (len(order) - rank) * float(p_values[i])))
        adjusted[i] = running
    return adjusted


def lenth(effects: FloatArray, alpha: float = 0.05) -> Lenth:
    """Return Lenth's pseudo standard error of m effects, shape (m,): PSE = 1.5 median{|c| : |c| < 2.5 s0}.

    s0 = 1.5 median|c|; df = m/3; margin = t(1 - alpha/2, df) PSE; the simultaneous margin uses
    (1 + (1 - alpha)^(1/m))/2 instead of 1 - alpha/2. Source: Lenth 1989.
    """
    sizes = np.abs(effects)
    first = 1.5 * float(np.median(sizes))
    kept = sizes[sizes < 2.5 * first]
    error = 1.5 * float(np.median(kept)) if kept.size else 0.0
    df = sizes.size / 3
    simultaneous = (1 + (1 - alpha) ** (1 / sizes.size)) / 2
    return Lenth(error, df, float(stats.t.ppf(1 - alpha / 2, df)) * error, float(stats.t.ppf(simultaneous, df)) * error)


def unexplained_by_factors(
    levels: FloatArray, means: FloatArray, counts: FloatArray, sigma: float, df_pure: int
) -> tuple[float, float]:
    """Return F and p of what the factors leave unexplained between rows against the pure error (lack of
    fit).
    """
    model = with_intercept(levels)
    df = model.shape[0] - model.shape[1]
    if df < 1 or df_pure < 1 or sigma == 0:
        return math.nan, math.nan
    f = float(least_squares(model, means, counts).mse_resid) / sigma**2
    return f, float(stats.f.sf(f, df, df_pure))


def _notes(
    valid: npt.NDArray[np.bool_],
    dummy_error: ErrorEstimate | None,
    pure_error: ErrorEstimate | None,
    pure_sigma: float,
    total: float,
    unexplained_p: float,
    leaks: bool,
) -> tuple[str, ...]:
    """Return what a reader of the effects must know, as sentences."""
    notes = []
    if not valid.all():
        rows = ", ".join(str(row + 1) for row in np.flatnonzero(~valid))
        df = 0 if dummy_error is None else dummy_error.df
        notes.append(
            f"Rows {rows} (counted from 1) have no valid run; the factors are fitted by least squares to the "
            f"other {int(valid.sum())} rows, which leaves {df} degrees of freedom between rows and no dummy "
            "effects."
        )
    if pure_error is None:
        notes.append("No row has two valid runs; significance rests on the dummy columns alone.")
    elif pure_sigma == 0:
        notes.append("All replicates of each row agree exactly (was the seed varied?); no effect can be tested.")
    if total == 0:
        notes.append("The response is the same in every row; no effect can be tested.")
    if unexplained_p < 0.05:
        notes.append(
            f"The dummy columns hold more than replicate noise (p = {unexplained_p:.3g}): interactions "
            f"{'leak into the main effects' if leaks else 'act; the main effects are clear of those of two factors'}."
        )
    return tuple(notes)


def _leaks(levels: FloatArray, names: Sequence[str], is_dummy: npt.NDArray[np.bool_]) -> bool:
    """Whether an interaction of two factors changes the estimate of a main effect; levels: the valid rows."""
    factors = levels[:, [not dummy and "*" not in name for name, dummy in zip(names, is_dummy, strict=True)]]
    products = [factors[:, i] * factors[:, j] for i, j in combinations(range(factors.shape[1]), 2)]
    if not products:
        return False
    carried = np.linalg.pinv(with_intercept(factors))[1:] @ np.column_stack(products)
    return bool(np.abs(carried).max() > 1e-9)


def _require_consistent(design: npt.NDArray[np.number[Any]], names: Sequence[str], dummies: Sequence[str]) -> None:
    if design.ndim != 2 or not (np.abs(design) <= 1).all():
        raise StatisticsError("design must be a matrix (rows, columns) of levels from -1 to +1")
    if len(names) != design.shape[1] or len(set(names)) != len(names):
        raise StatisticsError(f"names has {len(names)} entries; allowed are {design.shape[1]} different names")
    for name in dummies:
        if name not in names:
            raise StatisticsError(f"dummies names '{name}', which is not a column of the design")
    if len(set(dummies)) == len(names):
        raise StatisticsError("dummies names every column; at least one column must hold a factor")


def _require_estimable(levels: FloatArray, valid: npt.NDArray[np.bool_]) -> None:
    """Refuse rows that cannot separate the factors; levels: the valid rows and factor columns."""
    model = with_intercept(levels)
    if np.linalg.matrix_rank(model) < model.shape[1]:
        missing = ", ".join(str(row + 1) for row in np.flatnonzero(~valid))
        without, repeat = (f"without rows {missing} (counted from 1) ", "repeat one, or ") if missing else ("", "")
        raise StatisticsError(
            f"responses: {without}the {model.shape[0]} valid rows cannot separate {levels.shape[1]} factors and the "
            f"mean; {repeat}declare an untestable factor a dummy"
        )
