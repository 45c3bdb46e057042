"""Replicates in one line: mean, standard deviation, interval of the mean, normality, outliers.

Nothing is removed: an outlier is named, and the mean without it stands beside the mean. Who leaves a reading out does
so in the file, where it can be seen. Normality is Shapiro and Wilk's W (1965, Biometrika 52:591); ten replicates can
show gross departures only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.errors import StatisticsError
from doe.laboratory.outliers import ENOUGH_FOR_SEVERAL, NEGLIGIBLE, outliers
from doe.record import Record


@dataclass(frozen=True)
class Summary(Record):
    """Statistics of ``n`` replicates, unit of the values; NaN where n is too small or nothing spreads.

    low, high: 95 % interval of the mean by Student's t. outliers: indices, the farthest first; mean_without: the mean
    of the others.
    """

    n: int
    mean: float
    sd: float
    standard_error: float
    low: float
    high: float
    least: float
    largest: float
    shapiro_w: float
    shapiro_p: float
    outliers: tuple[int, ...]
    outlier_test: str
    mean_without: float


def summarise(values: npt.ArrayLike, level: float = 0.95) -> Summary:
    """The summary of replicates; StatisticsError without any or with one that is not finite."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1 or array.size == 0 or not np.isfinite(array).all():
        raise StatisticsError(f"values: shape {array.shape}; allowed: a row of finite numbers")
    n, mean = array.size, float(array.mean())
    sd = float(array.std(ddof=1)) if n > 1 else math.nan
    error = sd / math.sqrt(n)
    half = float(stats.t.ppf(0.5 + 0.5 * level, n - 1)) * error if n > 1 else math.nan
    spreads = n >= 3 and sd > NEGLIGIBLE * float(np.abs(array).max())
    w, p = map(float, stats.shapiro(array)) if spreads else (math.nan, math.nan)
    found = outliers(array)
    kept = np.delete(array, list(found))
    return Summary(
        n=n,
        mean=mean,
        sd=sd,
        standard_error=error,
        low=mean - half,
        high=mean + half,
        least=float(array.min()),
        largest=float(array.max()),
        shapiro_w=w,
        shapiro_p=p,
        outliers=found,
        outlier_test="generalised ESD" if n >= ENOUGH_FOR_SEVERAL else "Grubbs",
        mean_without=float(kept.mean()),
    )
