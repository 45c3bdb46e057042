"""Holm and Lenth against statsmodels and a hand computation."""

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.multitest import multipletests

from doe.analysis.screening import holm, lenth


@pytest.mark.parametrize("tests", [1, 2, 24, 27])
def test_holm_agrees_with_statsmodels(tests):
    p_values = np.random.default_rng(tests).uniform(size=tests) ** 3
    adjusted = multipletests(p_values, method="holm")[1]
    assert holm(p_values) == pytest.approx(adjusted, abs=1e-12)


def test_holm_leaves_untestable_effects_out_of_the_count():
    assert holm(np.array([0.01, np.nan, 0.04]))[[0, 2]] == pytest.approx([0.02, 0.04])


def test_lenth_by_hand():
    """|c| = 1, 2, 3, 4, 20: s0 = 4.5; 20 is left out (> 11.25); PSE = 1.5 x 2.5 = 3.75; df = 5/3."""
    found = lenth(np.array([1.0, -2.0, 3.0, -4.0, 20.0]))
    assert found.pseudo_standard_error == pytest.approx(3.75)
    assert found.margin == pytest.approx(3.75 * stats.t.ppf(0.975, 5 / 3))
    assert found.simultaneous_margin > found.margin


def test_lenth_leaves_out_what_is_two_and_a_half_times_the_first_error():
    """|c| = 1, 2, 3, 4 and s0 = 4.5: 12 is above 11.25, 11 is not, and then PSE = 1.5 x 3."""
    assert lenth(np.array([1.0, 2.0, 3.0, 4.0, 12.0])).pseudo_standard_error == pytest.approx(3.75)
    assert lenth(np.array([1.0, 2.0, 3.0, 4.0, 11.0])).pseudo_standard_error == pytest.approx(4.5)


def test_lenth_s_margins_of_fifteen_effects_are_those_of_his_table():
    """Lenth 1989, for 16 runs: 2.57 PSE for one effect, 5.22 PSE for all of them."""
    found = lenth(np.arange(1.0, 16.0))
    assert found.margin / found.pseudo_standard_error == pytest.approx(2.57, abs=0.005)
    assert found.simultaneous_margin / found.pseudo_standard_error == pytest.approx(5.22, abs=0.005)


def test_lenth_of_nothing_is_nothing():
    assert lenth(np.zeros(27)).margin == 0.0
