"""Steepest ascent: direction, clipping, bracket and the box around it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from doe.analysis.steepest_ascent import AscentFactor, ascent_path, bracket, region_around
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


def test_bracket_and_region_refuse_nonsense():
    with pytest.raises(StatisticsError, match="no valid step"):
        bracket([np.nan], 24.0)
    path = ascent_path(FACTORS, 24.0)
    with pytest.raises(StatisticsError, match="minimum_share"):
        region_around(path, bracket(np.arange(6.0), 2.5), 0.0)
