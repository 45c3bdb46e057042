"""What a design will see, against the closed forms of orthogonal designs and against simulation."""

import math

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.power import FTestAnovaPower

from doe.analysis.models import terms_of
from doe.analysis.named_factors import order_of_names, orders_of
from doe.analysis.power import precision, precision_of_names, smallest_effect, t_test_power
from doe.designs import box_behnken, factorial, plackett_burman
from doe.designs.optimal import codes
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


def test_the_term_that_is_told_worst_stands_for_its_kind():
    """A at ±1 and B at ±1/2 in four runs: Var(b_B) = sigma²/(4/4)."""
    (found,) = precision(factorial(2) * [1.0, 0.5], "AB", terms_of("AB", "linear"), 1.5)
    assert found.standard_error == pytest.approx(2 * 1.5, rel=1e-12)


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


def test_names_of_one_factor_have_the_power_of_the_one_way_layout():
    """Cohen 1988, ch. 8: two means apart by delta, the others midway, f² = delta²/(2 c sigma²)."""
    c, n, delta, sigma = 4, 5, 1.8, 1.2
    coded = np.repeat(codes(c), n)[:, None]
    (found,) = precision_of_names(coded, [c], ("A",), sigma, delta)
    assert (found.kind, found.terms, found.df, found.df_term) == ("name", 1, c * (n - 1), c - 1)
    assert found.standard_error == pytest.approx(sigma * math.sqrt(2 / n), rel=1e-12)
    size = delta / sigma / math.sqrt(2 * c)
    own = FTestAnovaPower()
    assert found.power == pytest.approx(own.power(size, c * n, 0.05, c), rel=1e-8)
    least = own.solve_power(None, c * n, 0.05, 0.8, c) * sigma * math.sqrt(2 * c)
    assert found.smallest == pytest.approx(least, rel=1e-6)
    assert found.chance(found.smallest) == pytest.approx(0.8, abs=1e-9)


@pytest.mark.parametrize(
    ("coded", "levels", "order"),
    [
        (box_behnken(3, 5).astype(float), (0, 0, 0), "quadratic"),
        (np.vstack([factorial(3)] * 2).astype(float), (2, 0, 2), "interactions"),
    ],
)
def test_numbers_and_two_names_have_the_power_of_the_t_test(coded, levels, order):
    terms = orders_of(levels)[order]
    assert terms == terms_of("ABC", order)
    plain, named = precision(coded, "ABC", terms, 1.3, 2.0), precision_of_names(coded, levels, terms, 1.3, 2.0)
    for one, other in zip(plain, named, strict=True):
        assert (one.kind, one.terms, one.df) == (other.kind, other.terms, other.df)
        numbers = [(x.standard_error, x.smallest, x.smallest_of_all, x.power) for x in (one, other)]
        assert numbers[1] == pytest.approx(numbers[0], rel=1e-9)


def test_promised_power_of_names_is_kept_by_simulated_experiments():
    """Three names crossed with a number, unequal numbers of runs and blocks: the F test of both columns."""
    of_run = np.array([0, 0, 0, 1, 1, 2, 2, 2, 0, 1, 2, 1, 0, 2])
    x = np.array([-1, 1, 0, -1, 1, -1, 1, 0, 1, -1, 1, 0, -1, 1], dtype=float)
    block = np.arange(14) % 2
    coded = np.column_stack([codes(3)[of_run], x])
    assert order_of_names(coded, (3, 0), block) == "quadratic"
    delta, trials = 2.5, 4000
    number, name = precision_of_names(coded, (3, 0), ("A", "B"), 1.0, delta, block=block)
    assert (number.kind, name.kind, name.df_term, name.df) == ("factor", "name", 2, 14 - 5)
    ends = np.eye(3)[of_run]
    others = np.column_stack([np.ones(14), x, np.where(block == 0, 1.0, -1.0)])
    full = np.column_stack([others, ends[:, :2]])

    def share_seen(one, other):
        y = delta * (ends[:, [other]] - ends[:, [one]]) / 2 + np.random.default_rng(7).standard_normal((14, trials))
        left = [(y - m @ np.linalg.lstsq(m, y, rcond=None)[0] for m in (others, full))][0]
        apart, within = ((one**2).sum(axis=0) for one in left)
        return (((apart - within) / 2) / (within / 9) > stats.f.ppf(0.95, 2, 9)).mean()

    # What is promised is that of the two names that are told apart least.
    shares = [share_seen(*pair) for pair in ((0, 1), (0, 2), (1, 2))]
    assert min(shares) == pytest.approx(name.power, abs=4 * math.sqrt(0.25 / trials))


@pytest.mark.parametrize("sigma, effect", [(0.0, 1.0), (-1.0, 1.0), (1.0, 0.0), (math.inf, 1.0), (math.nan, 1.0)])
def test_sigma_and_effect_must_be_positive(sigma, effect):
    with pytest.raises(StatisticsError, match="must be a positive number"):
        precision(factorial(2).astype(float), "AB", ("A", "B"), sigma, effect)


def test_terms_that_the_runs_cannot_separate_are_refused():
    with pytest.raises(StatisticsError, match="cannot separate"):
        precision(factorial(2).astype(float), "AB", terms_of("AB", "quadratic"), 1.0)
