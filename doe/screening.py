"""Screening: which factors of a design move the response, judged by two error estimates side by side.

Model: mean response of row r = intercept + sum_j effect_j/2 x_rj, fitted by least squares to the row means. The
effect is the change from low to high, in the unit of the response: mean(+) - mean(-) of a two-level design without a
missing row. Sums of squares are partial (Type III) on the scale of row means: SS = runs/4 effect^2 for such a design.

Two errors: (a) what the factors leave unexplained, that is the dummy columns (Plackett and Burman 1946), with
few degrees of freedom and inflated by aliased interactions; (b) the replicates of each row (pure error).
Lenth's pseudo standard error (Lenth 1989, Technometrics 31:469) is given as a third view.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.errors import StatisticsError
from doe.multiple_tests import holm, lenth
from doe.power import smallest_effect
from doe.replicates import centred, require_matrix, row_moments
from doe.screening_result import (
    FALLBACK,
    SIGNIFICANT,
    Adjustment,
    Effect,
    EffectTest,
    ErrorEstimate,
    Screening,
    Selected,
)
from doe.surface import least_squares, with_intercept

FloatArray = npt.NDArray[np.float64]

__all__ = ["FALLBACK", "SIGNIFICANT", "Screening", "Selected", "analyse_screening", "select_factors"]


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
    are left out and named; the factors are then estimated by least squares on the rest, and the dummies are
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

    dummy_error, dummy_scale = error_of_dummies(levels[:, ~is_dummy], means, norms[~is_dummy], alpha)
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
            Effect(
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
        mean=mean,
        rows=int(design.shape[0]),
        missing_rows=tuple(int(row) for row in np.flatnonzero(~valid)),
        runs=int(counts.sum()),
        total_sum_of_squares=total,
        dummy_error=dummy_error,
        pure_error=pure_error,
        lenth=lenth(effects[used], alpha),
        unexplained_f=unexplained_f,
        unexplained_p=unexplained_p,
        notes=_notes(valid, dummy_error, pure_error, pure_sigma, total, unexplained_p),
    )


def select_factors(
    screening: Screening,
    n: int = 3,
    fallback: Sequence[str] = (),
    exclude: Sequence[str] = (),
    alpha: float = 0.05,
    adjust: Adjustment = "holm",
) -> tuple[Selected, ...]:
    """Return the `n` factors of the next stage, each with its reason.

    Significant factors come first by falling |t|, then `fallback` in its order; `exclude` holds factors that
    this set-up cannot test. Raises StatisticsError when both together give fewer than `n`, or a name is no
    factor.
    """
    known = {effect.name for effect in screening.effects if not effect.is_dummy}
    for name in (*fallback, *exclude):
        if name not in known:
            raise StatisticsError(f"'{name}' is no factor of the screening; allowed are {', '.join(sorted(known))}")
    chosen = [Selected(name, SIGNIFICANT) for name in screening.significant(alpha, adjust) if name not in exclude]
    for name in fallback:
        if name not in exclude and name not in {selected.name for selected in chosen}:
            chosen.append(Selected(name, FALLBACK))
    if len(chosen) < n:
        raise StatisticsError(
            f"fallback = {list(fallback)} leaves {len(chosen)} of {n} factors after {len(exclude)} exclusions"
            "; name more factors in the fallback list"
        )
    return tuple(chosen[:n])


def _notes(
    valid: npt.NDArray[np.bool_],
    dummy_error: ErrorEstimate | None,
    pure_error: ErrorEstimate | None,
    pure_sigma: float,
    total: float,
    unexplained_p: float,
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
            f"The dummy columns hold more than replicate noise (p = {unexplained_p:.3g}): interactions leak "
            "into the main effects."
        )
    return tuple(notes)


def _require_consistent(design: npt.NDArray[np.number[Any]], names: Sequence[str], dummies: Sequence[str]) -> None:
    if design.ndim != 2 or not (np.abs(design) <= 1).all():
        raise StatisticsError("design must be a matrix (rows, columns) of levels from -1 to +1")
    if len(names) != design.shape[1] or len(set(names)) != len(names):
        raise StatisticsError(f"names has {len(names)} entries; allowed are {design.shape[1]} different names")
    for name in dummies:
        if name not in names:
            raise StatisticsError(f"dummies names '{name}', which is no column of the design")
    if len(set(dummies)) == len(names):
        raise StatisticsError("dummies names every column; at least one column must carry a factor")


def _require_estimable(levels: FloatArray, valid: npt.NDArray[np.bool_]) -> None:
    """Refuse rows that cannot tell the factors apart; levels: the valid rows and factor columns."""
    model = with_intercept(levels)
    if np.linalg.matrix_rank(model) < model.shape[1]:
        missing = ", ".join(str(row + 1) for row in np.flatnonzero(~valid)) or "none missing"
        raise StatisticsError(
            f"responses: without rows {missing} (counted from 1) the {model.shape[0]} others cannot separate "
            f"{levels.shape[1]} factors and the mean; rerun one, or declare an untestable factor a dummy"
        )


def error_of_dummies(
    levels: FloatArray, means: FloatArray, norms: FloatArray, alpha: float
) -> tuple[ErrorEstimate | None, float]:
    """Return the error left by the factors on row means and its standard deviation (NaN without df)."""
    model = with_intercept(levels)
    df = model.shape[0] - model.shape[1]
    if df < 1:
        return None, math.nan
    sigma = math.sqrt(float(least_squares(model, means).mse_resid))
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

    An error of exactly zero tests nothing: t and p are NaN.
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
