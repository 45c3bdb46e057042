"""The two errors of a screening and the tests of its effects against them.

Shapes: levels (rows, factors) and means, counts (rows,) of the rows with a valid run; one effect per column.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.multiple_tests import holm
from doe.power import smallest_effect
from doe.screening_result import EffectTest, ErrorEstimate
from doe.surface import least_squares

FloatArray = npt.NDArray[np.float64]


def with_intercept(levels: FloatArray) -> FloatArray:
    """Return the model matrix (rows, 1 + columns): a column of ones, then the levels."""
    return np.column_stack([np.ones(levels.shape[0]), levels])


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
