"""Lack of fit of a polynomial where points were run more than once. Source: Box and Draper 1987, ch. 3."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import stats

FloatArray = npt.NDArray[np.float64]

LEAST_PURE_DF = 10


def lack_of_fit_variance(
    settings: FloatArray, values: FloatArray, residuals: FloatArray, leverage: FloatArray, level: float = 0.01
) -> FloatArray:
    """Return the mean squared bias of the model over the rows, per summary, shape (d,).

    settings: (n, s), equal rows are replicates. values, residuals: (n, d). leverage: (n,), of those rows in the fit.
    With MS_lof = (SSE - SSpe)/df_lof and MS_pe = SSpe/df_pe: bias^2 = (MS_lof - MS_pe) df_lof/n where F = MS_lof/MS_pe
    exceeds its limit at level/d, else zero; zero too below 10 pure degrees of freedom.
    """
    n, d = values.shape
    distinct, point = np.unique(settings, axis=0, return_inverse=True)
    point = point.reshape(-1)
    counts = np.bincount(point)
    means = np.stack([np.bincount(point, weights=values[:, i]) / counts for i in range(d)], axis=1)
    pure_df = n - len(distinct)
    lack_df = float((1 - leverage).sum()) - pure_df
    if pure_df < LEAST_PURE_DF or lack_df < 1:
        return np.zeros(d)
    pure = ((values - means[point]) ** 2).sum(axis=0)
    lack = np.maximum((residuals**2).sum(axis=0) - pure, 0.0) / lack_df
    pure_mean = pure / pure_df
    limit = stats.f.isf(level / d, lack_df, pure_df)
    return np.where(lack > limit * pure_mean, (lack - pure_mean) * lack_df / n, 0.0)
