"""Replicates in one line: mean, standard deviation, interval of the mean, normality, outliers.

Nothing is removed: an outlier is named, and the mean without it stands beside the mean. Who leaves a reading out does
so in the file, where it can be seen. Normality is Shapiro and Wilk's W (1965, Biometrika 52:591); ten replicates can
show gross departures only.

Outliers are found by Grubbs's test, and its extension to several, the generalised extreme studentised deviate:

    R_i = max |x − mean| / s  of what is left after i − 1 removals
    λ_i = (n − i) t / √((n − i − 1 + t²)(n − i + 1)),  t the 1 − α/(2(n − i + 1)) point of Student's t, n − i − 1 df

The number of outliers is the largest i with R_i > λ_i. With one removal at most it is Grubbs's two-sided test, which is
exact for any n; with several it needs about 15 values. Sources: Grubbs 1969, Technometrics 11:1; Rosner 1983,
Technometrics 25:165.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.errors import StatisticsError
from doe.record import Record

ENOUGH_FOR_SEVERAL = 15
DISTINCT, FEW = 3, 5
"""Least number of different values that are tested for normality; up to ``FEW`` replicates also for outliers."""
LARGEST_SHARE = 0.2
"""Of the values, that may be outliers where there are enough to look for several."""
NEGLIGIBLE = 1e-12
"""Spread relative to the largest value that is rounding."""


@dataclass(frozen=True)
class ReplicateSummary(Record):
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


def summarise(values: npt.ArrayLike, level: float = 0.95) -> ReplicateSummary:
    """The summary of replicates; StatisticsError without any or with one that is not finite."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1 or array.size == 0 or not np.isfinite(array).all():
        raise StatisticsError(f"values: shape {array.shape}; allowed: a row of finite numbers")
    n, mean = array.size, float(array.mean())
    sd = float(array.std(ddof=1)) if n > 1 else math.nan
    error = sd / math.sqrt(n)
    half = float(stats.t.ppf(0.5 + 0.5 * level, n - 1)) * error if n > 1 else math.nan
    distinct = np.unique(array).size >= DISTINCT
    spreads = distinct and sd > NEGLIGIBLE * float(np.abs(array).max())
    w, p = map(float, stats.shapiro(array)) if spreads else (math.nan, math.nan)
    # Of few readings those that are rounded to the same number make the other an outlier, however near it is.
    found = outliers(array) if n > FEW or distinct else ()
    kept = np.delete(array, list(found))
    return ReplicateSummary(
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


def outliers(values: npt.ArrayLike, level: float = 0.05) -> tuple[int, ...]:
    """Indices of the outliers at ``level``, the farthest first."""
    n = np.asarray(values).size
    found = deviates(values, most_outliers(n))
    beyond = [i for i, (_, deviate) in enumerate(found) if deviate > critical_deviate(n, i, level)]
    return tuple(index for index, _ in found[: beyond[-1] + 1]) if beyond else ()


def most_outliers(n: int) -> int:
    """How many of ``n`` values may be named outliers: one below 15, a fifth of them from there on, none of two."""
    if n < 3:
        return 0
    return 1 if n < ENOUGH_FOR_SEVERAL else int(LARGEST_SHARE * n)


def deviates(values: npt.ArrayLike, most: int) -> tuple[tuple[int, float], ...]:
    """Index and R of the farthest value, of the farthest of the rest, … ``most`` of them."""
    array = np.asarray(values, dtype=np.float64)
    left, found = list(range(array.size)), []
    for _ in range(most):
        rest = array[left]
        spread = float(rest.std(ddof=1))
        if spread <= NEGLIGIBLE * float(np.abs(rest).max()):
            break
        distance = np.abs(rest - rest.mean()) / spread
        k = int(distance.argmax())
        found.append((left[k], float(distance[k])))
        del left[k]
    return tuple(found)


def critical_deviate(n: int, removed: int, level: float = 0.05) -> float:
    """λ for the deviate found after ``removed`` removals from ``n`` values."""
    left = n - removed
    t = float(stats.t.ppf(1.0 - level / (2.0 * left), left - 2))
    return (left - 1) * t / math.sqrt((left - 2 + t * t) * left)
