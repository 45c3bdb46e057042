"""Pilot: how noisy is one run, and how many replicates does a study need to see what it wants to see?

sigma is the standard deviation over seeds at one setting; its interval follows from (n - 1) s^2/sigma^2 ~
chi^2(n - 1). The spread at different settings is compared by Brown and Forsythe's test. Source: Brown and
Forsythe 1974, J. Am. Stat. Assoc. 69:364; power as in `doe.analysis.power`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.power import smallest_difference, smallest_main_effect
from doe.analysis.t_tests import Sample
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

BIAS_LIMIT_DEG = 5.0

"""An estimator that misses the angle of made-up piles by more, however they are filled, is not taken."""


@dataclass(frozen=True)
class Noise(Record):
    """Replicate standard deviation with its 95 % chi^2 interval, unit of the response."""

    mean: float
    sigma: float
    low: float
    high: float
    runs: int

    @property
    def half_width(self) -> float:
        """Return half the 95 % interval of the mean."""
        return Sample(self.mean, self.sigma, self.runs).half_width


@dataclass(frozen=True)
class EqualVariance(Record):
    """Brown–Forsythe test of equal spread over settings; f and p are NaN when nothing spreads."""

    f: float
    p: float
    sigmas: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Resolution(Record):
    """What `replicates` runs resolve with power 0.8 at level 0.05, unit of the response.

    difference: between two means of that many runs each. main_effect: of a two-level screening with that many
    runs per row, judged one at a time; main_effect_bonferroni: judged for all factors at once. NaN for one
    replicate.
    """

    replicates: int
    difference: float
    main_effect: float
    main_effect_bonferroni: float


def replicate_noise(values: npt.ArrayLike, level: float = 0.95) -> Noise:
    """Return sigma = sd of the values and its interval sqrt((n - 1) s^2/chi^2 quantile).

    NaN values are missing runs. Raises StatisticsError for fewer than two valid ones.
    """
    array = _valid("values", values)
    df, sigma = array.size - 1, float(array.std(ddof=1))
    low = sigma * math.sqrt(df / float(stats.chi2.ppf((1 + level) / 2, df)))
    high = sigma * math.sqrt(df / float(stats.chi2.ppf((1 - level) / 2, df)))
    return Noise(float(array.mean()), sigma, low, high, int(array.size))


def equal_variance(groups: Mapping[str, npt.ArrayLike]) -> EqualVariance:
    """Return the Brown–Forsythe test (Levene's with medians) over named settings.

    Raises StatisticsError for fewer than two settings or fewer than two valid runs at one.
    """
    if len(groups) < 2:
        raise StatisticsError(f"groups holds {len(groups)} setting(s); at least 2 are needed")
    samples = {name: _valid(name, values) for name, values in groups.items()}
    sigmas = tuple((name, float(values.std(ddof=1))) for name, values in samples.items())
    if all(sigma == 0 for _, sigma in sigmas):
        return EqualVariance(math.nan, math.nan, sigmas)
    f, p = stats.levene(*samples.values(), center="median")
    return EqualVariance(float(f), float(p), sigmas)


def resolution(sigma: float, replicates: int, rows: int = 28, factors: int = 24, efficiency: float = 1.0) -> Resolution:
    """Return what `replicates` runs resolve when one run scatters by `sigma`; see `doe.analysis.power.smallest_main_effect`."""
    return Resolution(
        replicates,
        smallest_difference(sigma, replicates),
        smallest_main_effect(sigma, replicates, rows, efficiency=efficiency),
        smallest_main_effect(sigma, replicates, rows, comparisons=factors, efficiency=efficiency),
    )


def _valid(name: str, values: npt.ArrayLike) -> FloatArray:
    array = np.asarray(values, dtype=np.float64).ravel()
    array = array[~np.isnan(array)]
    if array.size < 2:
        raise StatisticsError(f"{name} holds {array.size} valid run(s); at least 2 are needed")
    return array
