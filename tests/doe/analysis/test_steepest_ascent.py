"""Steepest ascent: direction, clipping, bracket and the box around it."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from doe.analysis.steepest_ascent import (
    AscentFactor,
    FirstOrder,
    approach,
    ascent_path,
    bracket,
    joint_path,
    region_around,
)
from doe.errors import StatisticsError

FACTORS = (
    AscentFactor("shear_modulus", 40.0, 70.0, 2.0),
    AscentFactor("static_friction", 0.4, 0.8, 4.0),
    AscentFactor("restitution", 0.5, 0.7, -1.0),
)


def test_steps_are_proportional_to_the_effects():
    path = ascent_path(FACTORS, centre_response=24.0, steps=5)
    assert path.base == "static_friction"
    assert path.direction == pytest.approx([0.5, 1.0, -0.25])
    assert path.natural[:, 1] == pytest.approx([0.4, 0.5, 0.6, 0.7, 0.8])
    assert path.natural[0] == pytest.approx([55 - 7.5, 0.4, 0.6 + 0.025])
    assert path.predicted == pytest.approx(24 + np.array([-1, -0.5, 0, 0.5, 1]) * (1 + 4 + 0.25) / 2 / 1.0)


@given(
    effects=st.lists(st.floats(-10, 10), min_size=1, max_size=5).filter(lambda e: max(map(abs, e)) > 1e-3),
    steps=st.integers(2, 12),
)
def test_the_path_rises_and_stays_in_range(effects, steps):
    factors = [AscentFactor(f"F{i}", 1.0 * i, 2.0 * i + 1, effect) for i, effect in enumerate(effects)]
    path = ascent_path(factors, 20.0, steps)
    assert (np.diff(path.predicted) > 0).all()
    assert (path.natural >= path.low - 1e-9).all()
    assert (path.natural <= path.high + 1e-9).all()


def test_bracket_interpolates_the_sign_change():
    found = bracket([18.95, 22.63, 24.05, 25.33, 26.77, 30.89], 24.68)
    assert (found.lower, found.upper, found.nearest) == (2, 3, 2)
    assert found.position == pytest.approx(2 + (24.68 - 24.05) / (25.33 - 24.05))


@pytest.mark.parametrize(
    ("means", "passes"), [([1.0, 2.0, 3.0], 1), ([2.0, 3.0], 1), ([1.0, 3.0, 1.0], 2), ([1.0, 2.0, 3.0, 1.0], 2)]
)
def test_a_step_that_meets_the_target_is_one_passage(means, passes):
    found = bracket(means, 2.0)
    assert found.crossings == passes
    assert ("It passes" in found.statement) == (passes > 1)


def test_the_printed_relative_errors_of_the_paper_refer_to_23_68():
    """Processes 2022, 10, 185, Table 7: its errors follow from its angles to the digit with 23.68, not
    24.68.
    """
    angles = [18.95, 22.63, 24.05, 25.33, 26.77, 30.89]
    printed = [19.97, 4.43, 1.56, 6.97, 13.05, 30.45]
    # Half a unit in the last printed digit.
    assert bracket(angles, 23.68).relative_errors_percent == pytest.approx(printed, abs=0.0051)
    assert bracket(angles, 24.68).relative_errors_percent[2:4] == pytest.approx([2.55, 2.63], abs=0.0051)


def test_of_several_crossings_the_closest_counts():
    found = bracket([20.0, 26.0, 24.0, 25.0], 24.5)
    assert found.crossings == 3
    assert (found.lower, found.upper) == (2, 3)
    assert "3 times" in found.statement


def test_an_unreached_target_gives_the_nearest_step_and_says_so():
    found = bracket([18.0, 20.0, np.nan, 21.0], 24.68)
    assert not found.reached
    assert found.lower == found.upper == found.nearest == 3
    assert "does not reach 24.68: every step stays below it; the nearest is step 4 with 21" in found.statement


def test_a_missing_step_is_passed_over():
    found = bracket([20.0, np.nan, 26.0], 23.0)
    assert (found.lower, found.upper) == (0, 2)
    assert found.position == pytest.approx(1.0)


def test_a_bracket_within_noise_is_not_resolved():
    assert bracket([20.0, 26.0], 23.0, [1.0, 1.0]).resolved is True
    noisy = bracket([20.0, 26.0], 23.0, [2.0, 1.0])
    assert noisy.resolved is False
    assert "noise" in noisy.statement


def test_the_region_is_centred_on_the_bracket():
    path = ascent_path(FACTORS, 24.0, steps=5)
    region = region_around(path, bracket([20, 22, 24, 26, 28], 25.0))
    assert region.centre == pytest.approx([55 + 3.75 / 2, 0.65, 0.6 - 0.0125 / 2])
    # One step of static_friction is a quarter of its range; the two others are widened to that share.
    assert region.half_width == pytest.approx([7.5, 0.1, 0.05])
    assert region.coded(region.natural([0.3, -1, 1])) == pytest.approx([0.3, -1, 1])


def test_the_region_reaches_one_step_to_each_side():
    """A third of the range of the base factor; a sixth and a twelfth of the others are widened to a quarter."""
    path = ascent_path(FACTORS, 24.0, steps=4)
    region = region_around(path, bracket([20, 22, 24, 26], 23.0))
    assert region.half_width == pytest.approx([0.25 * 30.0, 0.4 / 3, 0.25 * 0.2])
    assert [note.split()[3] for note in region.notes if "widened" in note] == ["shear_modulus", "restitution"]


@given(
    position=st.floats(0, 5),
    effects=st.tuples(*[st.floats(-5, 5)] * 3).filter(lambda e: max(map(abs, e)) > 1e-3),
    share=st.floats(0.01, 0.5),
)
def test_the_region_never_leaves_the_ranges(position, effects, share):
    factors = [AscentFactor(f.name, f.low, f.high, e) for f, e in zip(FACTORS, effects, strict=True)]
    path = ascent_path(factors, 24.0)
    region = region_around(path, bracket(20 + np.arange(6.0), 20 + position), share)
    slack = 1e-9 * (path.high - path.low)
    assert (region.half_width > 0).all()
    assert (region.centre - region.half_width >= path.low - slack).all()
    assert (region.centre + region.half_width <= path.high + slack).all()


def test_a_shifted_centre_is_noted():
    path = ascent_path(FACTORS, 24.0, steps=5)
    region = region_around(path, bracket([10, 11, 12, 13, 14], 25.0))
    assert region.centre[1] == pytest.approx(0.7)
    assert any("centre of static_friction" in note for note in region.notes)


@pytest.mark.parametrize(
    "factors, options, message",
    [
        ((), {}, "factors is empty"),
        ((AscentFactor("a", 1, 1, 1.0),), {}, "low = 1 must be below"),
        ((AscentFactor("a", 0, 1, float("nan")),), {}, "must be finite"),
        ((AscentFactor("a", 0, 1, 0.0),), {}, "no direction"),
        (FACTORS, {"steps": 1}, "steps = 1"),
    ],
)
def test_bad_input_is_named(factors, options, message):
    with pytest.raises(StatisticsError, match=message):
        ascent_path(factors, 24.0, **options)


LOW, HIGH = [0.0, 10.0], [1.0, 30.0]
NAMES = ("a", "b")


def first_order(mean, slopes, goal, spread=1e-3, weight=1.0):
    """The model of a target by its slopes per half range."""
    return FirstOrder(mean, 2.0 * np.array(slopes), goal, spread, weight)


def test_several_targets_are_walked_to_together():
    # 20 + 2a + 2b = 21 and 40 + a - 3b = 42.5 at a = 1, b = -0.5. Along the first one's effects, (1, 1), the second
    # falls by 2 where it has to rise.
    models = [first_order(20.0, [2.0, 2.0], 21.0), first_order(40.0, [1.0, -3.0], 42.5)]
    path = joint_path(NAMES, LOW, HIGH, models, steps=5)
    assert path.direction == pytest.approx([1.0, -0.5], abs=1e-5)
    assert path.natural[-1] == pytest.approx([1.0, 15.0], abs=1e-4)
    assert path.predicted == pytest.approx([19.0, 19.5, 20.0, 20.5, 21.0], abs=1e-4)
    alone = ascent_path([AscentFactor("a", 0.0, 1.0, 4.0), AscentFactor("b", 10.0, 30.0, 4.0)], 20.0, steps=5)
    assert alone.direction == pytest.approx([1.0, 1.0])
    assert 40.0 + alone.coded[-1] @ [1.0, -3.0] == pytest.approx(38.0)


@pytest.mark.parametrize(("goal", "sign"), [(23.0, 1.0), (17.0, -1.0)])
def test_towards_one_target_it_is_the_walk_of_steepest_ascent(goal, sign):
    path = joint_path(NAMES, LOW, HIGH, [first_order(20.0, [1.0, -3.0], goal, spread=0.7)], steps=5)
    alone = ascent_path([AscentFactor("a", 0.0, 1.0, 2.0), AscentFactor("b", 10.0, 30.0, -6.0)], 20.0, steps=5)
    assert path.direction == pytest.approx(sign * alone.direction)


def test_the_misfit_of_the_first_order_models_falls_towards_the_end_of_the_walk():
    models = [
        first_order(20.0, [2.0, 1.0, 0.5], 22.0, spread=0.5),
        first_order(40.0, [1.0, -3.0, 0.2], 39.0, spread=1.5, weight=2.0),
        first_order(5.0, [0.1, 0.3, -0.4], 5.2, spread=0.2),
    ]
    path = joint_path("abc", [-1.0] * 3, [1.0] * 3, models, steps=3)

    def misfit(x):
        return sum(m.weight * ((m.mean + m.effects @ x / 2 - m.goal) / m.spread) ** 2 for m in models) + x @ x

    # x* lies on the walk, and J is least there: no direction leads down from it.
    share = minimize_scalar(lambda a: misfit(a * path.direction)).x
    at = share * path.direction
    assert share > 0
    for step in np.vstack([np.eye(3), -np.eye(3)]) * 1e-3:
        assert misfit(at + step) > misfit(at)


def test_what_is_within_noise_turns_the_walk_little():
    # The same slopes but for 0.1, and misses that 0.1 would have to explain: without damping a = -49, b = 50.
    models = [first_order(20.0, [1.0, 1.0], 21.0, spread=1.0), first_order(40.0, [1.1, 1.0], 36.1, spread=1.0)]
    path = joint_path(NAMES, [-1.0, -1.0], [1.0, 1.0], models)
    assert path.direction[0] == pytest.approx(-1.0)
    assert path.direction[1] < -0.5


def test_the_walk_comes_nearest_to_all_targets_between_its_steps():
    steps = np.arange(6.0)
    # The first is met at step index 2.5, the second at 3.5, both with a slope of one standard error a step.
    means, goals = np.array([10.0 + steps, 50.0 - 2.0 * steps]), [12.5, 43.0]
    spreads = np.array([np.ones(6), 2.0 * np.ones(6)])

    def found(*weights):
        return approach(means, goals, spreads, weights, [2.0, 4.0])

    even = found(1.0, 1.0)
    assert even.position == pytest.approx(3.0)
    assert even.missed == pytest.approx([0.5, 0.5])
    assert even.misfit == pytest.approx((steps - 2.5) ** 2 + (steps - 3.5) ** 2)
    assert even.desirability[3] == pytest.approx(np.sqrt(0.75 * 0.75))
    assert even.desirability[0] == 0.0
    assert (even.reached, even.resolved) == (True, True)
    heavy = found(3.0, 1.0)
    assert heavy.position == pytest.approx(2.75)
    assert heavy.desirability[3] == pytest.approx(0.75)
    # A step at which one target has no run is passed over; noise of four times the size tells no place.
    means[1, 3] = np.nan
    assert found(1.0, 1.0).position == pytest.approx(3.0)
    spreads *= 4.0
    assert (found(1.0, 1.0).reached, found(1.0, 1.0).resolved) == (True, False)
    means[1] += 40.0
    far = found(1.0, 1.0)
    assert not far.reached
    assert re.search(r"by at most \S+ standard errors \(y\)\. The path does not meet", far.words(("x", "y")))
    means[1] = np.nan
    with pytest.raises(StatisticsError, match="for every target"):
        found(1.0, 1.0)


@pytest.mark.parametrize(
    ("standardised", "resolved"),
    [
        (np.arange(6.0) - 2.5, True),  # J rises to 6.25 on both sides
        (0.8 * (np.arange(6.0) - 2.5), True),  # to 4
        (0.75 * (np.arange(6.0) - 2.5), False),  # to 3.52, below 3.84
        (np.arange(6.0) - 4.5, False),  # to 20 on one side alone
        (np.array([-0.5, 3.0]), False),  # what is beyond the least on one side tells nothing of the other
        (np.array([-2.0, 3.0]), True),
    ],
)
def test_a_place_is_told_where_the_misfit_rises_on_both_sides(standardised, resolved):
    """By more than 3.84, the 95 % point of chi-squared with one degree of freedom."""
    found = approach([20.0 + standardised], [20.0], np.ones((1, standardised.size)), [1.0], [2.0])
    assert found.resolved is resolved


@pytest.mark.parametrize(("missed", "reached"), [(1.9, True), (2.1, False), (-2.1, False)])
def test_every_target_has_to_be_met_within_two_standard_errors(missed, reached):
    steps = np.arange(6.0)
    found = approach([steps, np.full(6, 50.0 + missed)], [2.5, 50.0], np.ones((2, 6)), [1.0, 1.0], [2.0, 2.0])
    assert found.missed == pytest.approx([0.0, missed])
    assert found.reached is reached


def test_bracket_and_region_refuse_nonsense():
    with pytest.raises(StatisticsError, match="no valid step"):
        bracket([np.nan], 24.0)
    path = ascent_path(FACTORS, 24.0)
    with pytest.raises(StatisticsError, match="minimum_share"):
        region_around(path, bracket(np.arange(6.0), 2.5), 0.0)
