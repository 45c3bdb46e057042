"""t tests of means from summaries (mean, sd, n), and the equivalence test built on them.

Source: Welch 1947, Biometrika 34:28; Schuirmann 1987, J. Pharmacokinet. Biopharm. 15:657 (TOST).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.errors import StatisticsError
from doe.record import Record


@dataclass(frozen=True)
class Sample(Record):
    """Mean, standard deviation and size of a sample; mean and sd in the unit of the response."""

    mean: float
    sd: float
    n: int

    @staticmethod
    def of(values: npt.ArrayLike) -> Sample:
        """Return the summary of single values, ignoring NaN; sd is NaN for one value.

        Raises StatisticsError without a valid value.
        """
        array = np.asarray(values, dtype=np.float64).ravel()
        array = array[~np.isnan(array)]
        if array.size == 0:
            raise StatisticsError("simulated holds no valid run")
        sd = float(array.std(ddof=1)) if array.size > 1 else math.nan
        return Sample(float(array.mean()), sd, int(array.size))

    @property
    def standard_error(self) -> float:
        """Return the standard error sd/√n of the mean; NaN for fewer than two values."""
        return self.sd / math.sqrt(self.n) if self.n else math.nan

    @property
    def half_width(self) -> float:
        """Return half the 95 % interval of the mean, t(0.975, n − 1) sd/√n; NaN for fewer than two values."""
        return float(stats.t.ppf(0.975, self.n - 1)) * self.standard_error if self.n > 1 else math.nan


@dataclass(frozen=True)
class DifferenceTest(Record):
    """t test of difference = first - second with a confidence interval of that difference at `level`."""

    difference: float
    standard_error: float
    df: float
    t: float
    p: float
    level: float
    low: float
    high: float


@dataclass(frozen=True)
class EquivalenceTest(Record):
    """Two one-sided tests: p is the larger of the two; low, high = (1 - 2 alpha) interval of the difference."""

    margin: float
    p: float
    level: float
    low: float
    high: float
    equivalent: bool


def welch_test(first: Sample, second: Sample, level: float = 0.95) -> DifferenceTest:
    """Return the two-sample t test for unequal variances, df by Welch–Satterthwaite.

    SE^2 = s1^2/n1 + s2^2/n2. Raises StatisticsError when a sample has n < 2 or no sd.
    """
    _require_spread(first, second)
    a, b = first.sd**2 / first.n, second.sd**2 / second.n
    df = (a + b) ** 2 / (a**2 / (first.n - 1) + b**2 / (second.n - 1)) if a + b > 0 else math.nan
    return _difference(first.mean - second.mean, math.sqrt(a + b), df, level)


def pooled_test(first: Sample, second: Sample, level: float = 0.95) -> DifferenceTest:
    """Return Student's two-sample t test for equal variances, df = n1 + n2 - 2.

    Raises StatisticsError when a sample has n < 2 or no sd.
    """
    _require_spread(first, second)
    df = first.n + second.n - 2
    variance = ((first.n - 1) * first.sd**2 + (second.n - 1) * second.sd**2) / df
    error = math.sqrt(variance * (1 / first.n + 1 / second.n))
    return _difference(first.mean - second.mean, error, df, level)


def one_sample_test(sample: Sample, mean: float, level: float = 0.95) -> DifferenceTest:
    """Return the t test of a sample against a mean that is taken as exact, df = n - 1.

    Raises StatisticsError when the sample has n < 2.
    """
    _require_spread(sample)
    return _difference(sample.mean - mean, sample.standard_error, sample.n - 1, level)


def equivalence_test(difference: DifferenceTest, margin: float, alpha: float = 0.05) -> EquivalenceTest:
    """Return the two one-sided tests of |difference| < margin from a difference test (Welch's for unequal
    variances).

    Equivalent when p < alpha, which is the same as the (1 - 2 alpha) interval lying within +-margin.
    Raises StatisticsError unless margin > 0.
    """
    if not margin > 0:
        raise StatisticsError(f"margin = {margin} must be positive")
    error, df = difference.standard_error, difference.df
    if error > 0:
        below = float(stats.t.sf((difference.difference + margin) / error, df))
        above = float(stats.t.cdf((difference.difference - margin) / error, df))
        p = max(below, above)
        half = float(stats.t.ppf(1 - alpha, df)) * error
    else:
        p, half = (math.nan, math.nan)
    return EquivalenceTest(
        margin, p, 1 - 2 * alpha, difference.difference - half, difference.difference + half, bool(p < alpha)
    )


def _difference(difference: float, error: float, df: float, level: float) -> DifferenceTest:
    """Return the t test of a difference; without any spread, t, p and the interval are NaN."""
    if not error > 0:
        return DifferenceTest(difference, error, df, math.nan, math.nan, level, math.nan, math.nan)
    t = difference / error
    half = float(stats.t.ppf((1 + level) / 2, df)) * error
    p = 2 * float(stats.t.sf(abs(t), df))
    return DifferenceTest(difference, error, df, t, p, level, difference - half, difference + half)


def _require_spread(*samples: Sample) -> None:
    for sample in samples:
        if sample.n < 2 or not sample.sd >= 0:
            raise StatisticsError(f"n = {sample.n}, sd = {sample.sd}: a t test needs n >= 2 and a standard deviation")
