"""What a design will see, against the closed forms of orthogonal designs and against simulation."""

import math

import numpy as np
import pytest
from scipy import stats

from doe.analysis.models import terms_of
from doe.analysis.power import precision, smallest_effect, t_test_power
from doe.designs import box_behnken, factorial, plackett_burman
from doe.errors import StatisticsError


def test_main_effect_of_a_two_level_design_has_its_closed_form():
    """SE = 2 sigma/√N, df = N - 1 - k."""
    names = "ABCDEF"
    (found,) = precision(plackett_burman(12)[:, :6].astype(float), names, terms_of(names, "linear"), 1.5, 3.0)
    assert found.standard_error == pytest.approx(2 * 1.5 / math.sqrt(12), rel=1e-12)
    assert found.df == 5
    assert found.smallest == pytest.approx(smallest_effect(found.standard_error, 5), rel=1e-9)
    assert found.smallest_of_all == pytest.approx(smallest_effect(found.standard_error, 5, 0.05 / 6), rel=1e-9)
    assert found.power == pytest.approx(t_test_power(3.0, found.standard_error, 5), rel=1e-12)


def test_box_behnken_has_the_variances_of_its_table():
    """Box and Behnken 1960, 3 factors, 5 centre runs: sigma²/8 for a slope, sigma²/4 for a product."""
    factor, interaction, square = precision(box_behnken(3, 5).astype(float), "ABC", terms_of("ABC", "quadratic"), 1.0)
    assert factor.standard_error == pytest.approx(2 / math.sqrt(8), rel=1e-12)
    assert interaction.standard_error == pytest.approx(2 / math.sqrt(4), rel=1e-12)
    assert square.kind == "square"
    assert (factor.terms, interaction.terms, square.terms) == (3, 3, 3)
    assert math.isnan(factor.power)


def test_promised_power_is_kept_by_simulated_experiments():
    design = np.vstack([factorial(2)] * 3).astype(float)
    effect, trials = 1.4, 4000
    factor, _ = precision(design, "AB", terms_of("AB", "interactions"), 1.0, effect)
    model = np.column_stack([np.ones(12), design, design[:, 0] * design[:, 1]])
    y = (design[:, [0]] * effect / 2) + np.random.default_rng(6).standard_normal((12, trials))
    coefficients, residual = np.linalg.lstsq(model, y, rcond=None)[:2]
    t = coefficients[1] / np.sqrt(residual / 8 / 12)
    seen = (np.abs(t) > stats.t.ppf(0.975, 8)).mean()
    assert seen == pytest.approx(factor.power, abs=4 * math.sqrt(0.25 / trials))  # four standard errors of a share


def test_a_saturated_design_promises_nothing():
    (found,) = precision(plackett_burman(8).astype(float), "ABCDEFG", terms_of("ABCDEFG", "linear"), 1.0, 2.0)
    assert found.df == 0
    assert math.isnan(found.smallest)
    assert math.isnan(found.power)


@pytest.mark.parametrize("sigma, effect", [(0.0, 1.0), (-1.0, 1.0), (1.0, 0.0), (math.inf, 1.0), (math.nan, 1.0)])
def test_sigma_and_effect_must_be_positive(sigma, effect):
    with pytest.raises(StatisticsError, match="must be a positive number"):
        precision(factorial(2).astype(float), "AB", ("A", "B"), sigma, effect)


def test_terms_that_the_runs_cannot_separate_are_refused():
    with pytest.raises(StatisticsError, match="cannot separate"):
        precision(factorial(2).astype(float), "AB", terms_of("AB", "quadratic"), 1.0)
