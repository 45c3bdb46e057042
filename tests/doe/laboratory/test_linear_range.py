"""The straight part of made-up curves with a toe, a straight part and yield, whose slope is known."""

import numpy as np
import pytest
from scipy import stats

from doe.errors import StatisticsError
from doe.laboratory.linear_range import LEAST_SPAN, linear_range, noise_of, relative_noise

SLOPE = 1e6
"""Of every straight part [N/m]."""


def curve(points, toe, end, noise=0.0, seed=1, last=0.1):
    """Displacement [m], force [N]: the slope rises over ``toe``, is SLOPE until ``end`` and falls to ``last`` of it."""
    fine = np.linspace(0.0, 1.0, 4001)
    falling = np.maximum(last, 1.0 - (fine - end) / 0.3)
    slope = np.where(fine < toe, fine / max(toe, 1e-9), np.where(fine < end, 1.0, falling))
    whole = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(fine))])
    x = np.linspace(0.0, 1.0, points)
    force = np.interp(x, fine, whole)
    force = force + noise * force.max() * np.random.default_rng(seed).standard_normal(points)
    return 1e-3 * x, 1e-3 * SLOPE * force


SHAPES = [(0.0, 0.6), (0.1, 0.6), (0.3, 0.7), (0.1, 0.95), (0.4, 0.8), (0.02, 0.3)]


@pytest.mark.parametrize("points", [40, 200, 2000])
@pytest.mark.parametrize(("toe", "end"), SHAPES)
def test_the_slope_of_the_straight_part(toe, end, points):
    found = linear_range(*curve(points, toe, end))
    # The tolerance of the rule lets in the first part of a bend: 0.2 % of the span in a fifth of it.
    assert found.slope == pytest.approx(SLOPE, rel=2e-3)
    assert 1e-3 * toe - 5e-5 <= found.first_displacement < found.last_displacement <= 1e-3 * end + 5e-5
    assert found.share >= 0.6 * LEAST_SPAN
    assert not found.hertzian


@pytest.mark.parametrize(("toe", "end"), SHAPES)
def test_noise_moves_the_slope_by_what_it_must(toe, end):
    """0.3 % of the peak, 200 points: RMS error over ten draws below 0.5 % (by the line alone, 0.06 … 0.4 %)."""
    errors = [linear_range(*curve(200, toe, end, noise=0.003, seed=seed)).slope / SLOPE - 1.0 for seed in range(10)]
    assert np.sqrt(np.mean(np.square(errors))) < 5e-3


def test_the_line_and_its_error_are_those_of_scipy():
    x, force = curve(200, 0.1, 0.6, noise=0.003)
    found = linear_range(x, force)
    used = (x >= found.first_displacement) & (x <= found.last_displacement)
    other = stats.linregress(x[used], force[used])
    assert found.points == used.sum()
    assert (found.slope, found.standard_error) == (pytest.approx(other.slope), pytest.approx(other.stderr))
    assert found.r_squared == pytest.approx(other.rvalue**2)
    assert found.origin == pytest.approx(-other.intercept / other.slope)


def test_the_toe_is_where_the_line_meets_zero():
    # The slope rises linearly to 1 over the toe: half of it is lost.
    assert linear_range(*curve(200, 0.2, 0.8)).origin == pytest.approx(0.1e-3, rel=0.01)


def test_a_line_is_its_own_straight_part():
    x = np.linspace(0.0, 1e-3, 50)
    found = linear_range(x, 5e5 * x)
    assert found.slope == pytest.approx(5e5, rel=1e-12)
    assert found.r_squared == pytest.approx(1.0, abs=1e-12)
    assert found.share == pytest.approx(0.8, abs=0.05)


def test_unloading_and_standing_points_do_not_count():
    x, force = curve(100, 0.1, 0.9)
    back = np.concatenate([x, x[::-1]]), np.concatenate([force, 0.3 * force[::-1]])
    standing = np.repeat(x, 2), np.repeat(force, 2)
    alone = linear_range(x, force).slope
    assert linear_range(*back).slope == pytest.approx(alone, rel=1e-9)
    assert linear_range(*standing).slope == pytest.approx(alone, rel=1e-9)


@pytest.mark.parametrize("gap", [0.0, 2e-4])
def test_a_hertzian_contact_is_named(gap):
    x = np.linspace(0.0, 1e-3, 100)
    force = 1e6 * np.maximum(x - gap, 0.0) ** 1.5
    with pytest.raises(StatisticsError, match="Hertzian"):
        linear_range(x, force)
    # With noise the bend of its end hides: a slope is found there, and the curve is named all the same.
    noisy = force * (1.0 + 0.004 * np.random.default_rng(2).standard_normal(x.size))
    found = linear_range(x, noisy)
    assert found.hertzian
    assert found.last_displacement > 0.9e-3


def test_noise_is_that_of_a_point():
    x = np.linspace(0.0, 1.0, 4000)
    noise = 0.02 * np.random.default_rng(3).standard_normal(x.size)
    # The median of 4000 has a standard error of 2 %.
    assert noise_of(x, x + noise) == pytest.approx(0.02, rel=0.08)
    assert noise_of(x, 3.0 * x) == pytest.approx(0.0, abs=1e-12)
    # In proportion to the force; of the nine tenths above a tenth of the largest.
    assert relative_noise(x, 3.0 * x * (1.0 + noise)) == pytest.approx(0.02, rel=0.08)


@pytest.mark.parametrize(
    ("x", "force", "word"),
    [
        (np.linspace(0, 1, 5), np.linspace(0, 1, 5), "5 points"),
        (np.linspace(0, 1, 20), -np.linspace(0, 1, 20) - 1.0, "1 points"),
        (np.linspace(0, 1, 9), np.linspace(0, 1, 10), "equal numbers"),
        (np.linspace(0, 1, 12), np.exp(20.0 * np.linspace(0, 1, 12)), "no straight part"),
        ([], [], "0 points"),
    ],
)
def test_what_has_no_straight_part_is_refused(x, force, word):
    with pytest.raises(StatisticsError, match=word):
        linear_range(x, force)
