"""Pilot statistics against SciPy, statsmodels and simulated coverage."""

import math

import numpy as np
import pytest
from scipy import stats

from doe.analysis.pilot import equal_variance, replicate_noise, resolution
from doe.errors import StatisticsError

GENERATOR = np.random.default_rng(11)
CENTRE = GENERATOR.normal(24.0, 5.0, 20)


def test_sigma_interval_by_chi_squared():
    """(n - 1) s^2/chi^2: for n = 20 the factors on s are 0.7605 and 1.4606 (chi^2(19) quantiles 32.852,
    8.907).
    """
    noise = replicate_noise(CENTRE)
    assert noise.sigma == pytest.approx(CENTRE.std(ddof=1))
    assert noise.low / noise.sigma == pytest.approx(math.sqrt(19 / 32.852), abs=1e-4)
    assert noise.high / noise.sigma == pytest.approx(math.sqrt(19 / 8.907), abs=1e-4)


def test_sigma_interval_covers_at_its_level():
    draws = np.random.default_rng(5).normal(0, 2.0, (1000, 10))
    covered = sum(noise.low <= 2.0 <= noise.high for noise in map(replicate_noise, draws))
    low, high = stats.binom.interval(0.999, 1000, 0.95)
    assert low <= covered <= high


def test_brown_forsythe_by_its_definition():
    """One-way ANOVA of the distances from each group's median."""
    groups = {"centre": CENTRE, "soft": GENERATOR.normal(20, 5, 10), "hard": GENERATOR.normal(27, 9, 10)}
    distances = [np.abs(values - np.median(values)) for values in groups.values()]
    found = equal_variance(groups)
    assert (found.f, found.p) == pytest.approx(tuple(stats.f_oneway(*distances)))
    assert dict(found.sigmas)["hard"] == pytest.approx(groups["hard"].std(ddof=1))


def test_equal_values_have_no_spread_to_compare():
    assert math.isnan(equal_variance({"a": [1.0, 1.0], "b": [2.0, 2.0]}).p)


def test_more_replicates_resolve_smaller_effects():
    resolutions = [resolution(5.0, n) for n in (1, 2, 3, 5, 10)]
    assert math.isnan(resolutions[0].main_effect)
    effects = [r.main_effect for r in resolutions[1:]]
    assert effects == sorted(effects, reverse=True)
    assert all(r.main_effect_bonferroni > r.main_effect for r in resolutions[1:])


def test_half_the_efficiency_takes_twice_the_information():
    """SE = 2 sigma/√(efficiency × rows × replicates), with the same degrees of freedom."""
    whole, half = (resolution(5.0, 3, 28, 24, efficiency) for efficiency in (1.0, 0.5))
    assert half.main_effect == pytest.approx(math.sqrt(2) * whole.main_effect)
    assert half.main_effect_bonferroni == pytest.approx(math.sqrt(2) * whole.main_effect_bonferroni)
    assert half.difference == whole.difference


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: replicate_noise([1.0, np.nan]), "values holds 1 valid run"),
        (lambda: equal_variance({"a": [1.0, 2.0]}), "at least 2 are needed"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(StatisticsError, match=message):
        call()
