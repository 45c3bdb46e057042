"""Power against statsmodels and against the table computed for two-level designs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from statsmodels.stats.power import TTestIndPower

from doe.analysis import power
from doe.designs import box_behnken
from doe.errors import StatisticsError

BOX_BEHNKEN = box_behnken(3, centre=5).astype(float)


@pytest.mark.parametrize("n, effect", [(3, 2.0), (10, 1.0), (10, 0.3)])
def test_power_agrees_with_statsmodels(n, effect):
    own = power.t_test_power(effect, math.sqrt(2 / n), 2 * n - 2)
    # Both integrate the same noncentral t; the difference is quadrature error.
    assert own == pytest.approx(TTestIndPower().power(effect, n, 0.05), abs=1e-9)


@pytest.mark.parametrize("effect", [0.5, 1.0, 2.0])
def test_replicates_agree_with_statsmodels(effect):
    exact = TTestIndPower().solve_power(effect, power=0.8, alpha=0.05)
    assert power.replicates_for_difference(effect, 1.0) == math.ceil(exact)


@pytest.mark.parametrize("n", [2, 3, 12])
def test_the_smallest_difference_agrees_with_statsmodels(n):
    # Both search for a root; the looser of them stops at 1e-6 or so.
    exact = TTestIndPower().solve_power(nobs1=n, power=0.8, alpha=0.05)
    assert power.smallest_difference(1.7, n) == pytest.approx(1.7 * exact, rel=1e-5)


@pytest.mark.parametrize("replicates, chance", [(2, 0.95), (3, 0.995)])
def test_screening_power_for_one_sigma(replicates, chance):
    """SE = 2 sigma/sqrt(28 r): 0.95 and 0.995 for r = 2 and 3, to the digits of the design table."""
    achieved = power.t_test_power(1.0, 2 / math.sqrt(28 * replicates), 28 * (replicates - 1))
    assert achieved == pytest.approx(chance, abs=0.006)


@settings(max_examples=25, deadline=None)
@given(sigma=st.floats(0.01, 100), replicates=st.integers(2, 30))
def test_the_smallest_effect_is_found_with_the_stated_power(sigma, replicates):
    effect = power.smallest_main_effect(sigma, replicates)
    error = 2 * sigma / math.sqrt(28 * replicates)
    # brentq stops at 2e-12 of the shift, far below this tolerance in power.
    assert power.t_test_power(effect, error, 28 * (replicates - 1)) == pytest.approx(0.8, abs=1e-8)


@settings(max_examples=25, deadline=None)
@given(ratio=st.floats(0.1, 5))
def test_the_replicates_for_a_main_effect_are_the_least_that_do(ratio):
    n = power.replicates_for_main_effect(ratio, 1.0)
    assert power.smallest_main_effect(1.0, n) <= ratio * (1 + 1e-9)
    assert n == 2 or power.smallest_main_effect(1.0, n - 1) > ratio * (1 - 1e-9)


def test_error_of_a_linear_term_in_the_box_behnken_design():
    """8 of its 12 edge points hold a factor at ±1, so Var(b) = σ²/(8 n) and SE(2 b) = 2 σ/√(8 n)."""
    error, df = 2 * 1.5 / math.sqrt(8 * 3), 17 * 3 - 10
    assert power.smallest_linear_effect(1.5, 3, BOX_BEHNKEN) == pytest.approx(power.smallest_effect(error, df))


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_of_a_design_that_tells_factors_unlike_the_worst_one_counts(order):
    """3² points of which B moves by half: Var(b_B) = σ²/(6 n/4), and four times the information on A."""
    levels = (-1.0, 0.0, 1.0)
    design = np.array([(a, b / 2) for a in levels for b in levels])[:, order]
    error = 2 * 1.5 / math.sqrt(6 * 3 / 4)
    assert power.smallest_linear_effect(1.5, 3, design) == pytest.approx(power.smallest_effect(error, 9 * 3 - 6))
    # σ² times 1/4 and 1 of the information of as many rows at ±1; here Σ x² is 6 and 6/4 of 9.
    assert power.main_effect_efficiency(design) == pytest.approx(6 / 4 / 9)


@pytest.mark.parametrize("effect", [0.4, 1.0, 3.0])
def test_the_replicates_for_a_linear_term_are_the_least_that_do(effect):
    n = power.replicates_for_linear_effect(effect, 1.0, BOX_BEHNKEN)
    assert power.smallest_linear_effect(1.0, n, BOX_BEHNKEN) <= effect
    assert n == 1 or power.smallest_linear_effect(1.0, n - 1, BOX_BEHNKEN) > effect


def test_one_replicate_resolves_nothing_and_no_noise_resolves_everything():
    assert math.isnan(power.smallest_main_effect(1.0, 1))
    assert power.smallest_difference(0.0, 3) == 0.0


@pytest.mark.parametrize("effect, sigma", [(0.0, 1.0), (1.0, 0.0), (math.nan, 1.0)])
def test_an_impossible_question_is_refused(effect, sigma):
    with pytest.raises(StatisticsError, match="must be a positive number"):
        power.replicates_for_difference(effect, sigma)


def test_an_effect_lost_in_noise_is_refused_with_a_limit():
    with pytest.raises(StatisticsError, match="needs more than 100000 replicates"):
        power.replicates_for_difference(1e-4, 1.0)
