"""A population is what other seeds gave of exactly one scene; what one pour, and what more pours, tell of a change."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.power import TTestIndPower

from doe.population import PLANNED, Population, compared
from doe.store import Store
from solver import load_material, pour_key, with_values
from tests.doe.test_store import RUN

ANGLE = "angle_of_repose_deg"
SCENE = load_material("sunflower_extract")
OTHER = with_values(SCENE, {"pair.seed.seed.static_friction": 0.9})


def stored(scene, seed, angle, outcome="at_rest", variant=""):
    found = {} if angle is None else {ANGLE: angle}
    return dataclasses.replace(
        RUN, key=pour_key(scene, seed, variant), seed=seed, outcome=outcome, observables=found, raw=b""
    )


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "runs.sqlite")
    yield opened
    opened.close()


def population(*values):
    return Population(ANGLE, tuple(range(1, len(values) + 1)), values)


def test_it_holds_every_seed_of_the_scene_and_nothing_of_another_one(store):
    for run in (
        stored(SCENE, 12, 20.0),
        stored(SCENE, 3, 16.0),
        stored(SCENE, 4, 90.0, outcome="jammed"),
        stored(SCENE, 5, None),
        stored(SCENE, 6, 30.0, variant="misread"),
        stored(OTHER, 3, 40.0),
        stored(OTHER, 8, 41.0),
    ):
        store.add(run)
    found = Population.of(store.pours_of(SCENE), ANGLE)
    assert found == Population(ANGLE, (3, 12), (16.0, 20.0), void=2)
    assert (found.sample.mean, found.sample.sd) == (18.0, pytest.approx(math.sqrt(8)))
    assert Population.of(store.pours_of(OTHER), ANGLE).values == (40.0, 41.0)


def test_an_angle_of_zero_is_a_value(store):
    store.add(stored(SCENE, 1, 0.0))
    assert Population.of(store.pours_of(SCENE), ANGLE).values == (0.0,)


def test_a_store_of_another_physics_has_no_pours_of_any_scene(store):
    store.add(stored(SCENE, 1, 20.0))
    store.physics += 1
    assert list(store.pours_of(SCENE)) == []


def test_the_interval_is_that_of_the_mean():
    found = population(16.0, 18.0, 23.0)
    low, high = found.interval
    # t(0.975, 2) = 4.30265 (tables); sd = sqrt(13) of 16, 18, 23 about 19.
    assert (low + high) / 2 == pytest.approx(19.0)
    assert (high - low) / 2 == pytest.approx(4.30265 * math.sqrt(13.0 / 3.0), rel=1e-5)
    assert all(math.isnan(end) for end in population(16.0).interval)
    # Two values: t(0.975, 1) = 12.7062 (tables).
    low, high = population(16.0, 18.0).interval
    assert (low, high) == pytest.approx((17.0 - 12.7062, 17.0 + 12.7062), abs=1e-3)


def test_few_former_pours_tell_nothing_about_chance():
    assert compared(population(), 20.0, population(18.0)) is None
    assert compared(population(), 20.0, population(18.0, 18.0)) is None
    assert compared(population(), math.nan, population(18.0, 19.0)) is None


def test_one_more_pour_of_the_same_setting_is_called_different_in_5_percent():
    """By counting: normal draws, seven former ones and one more."""
    random = np.random.default_rng(5)
    draws = random.normal(20.0, 4.0, (4000, 8))
    found = [compared(population(), row[7], population(*row[:7])).distinguishable for row in draws]
    assert np.mean(found) == pytest.approx(0.05, abs=0.012)


def test_with_several_pours_of_both_it_is_welchs_test():
    former, new = (18.0, 21.0, 24.0, 25.0), (14.0, 15.0, 19.0)
    found = compared(population(*new), math.nan, population(*former))
    test = stats.ttest_ind(new, former, equal_var=False).confidence_interval(0.95)
    assert found.difference == pytest.approx(16.0 - 22.0)
    assert found.difference - found.half_width == pytest.approx(test.low)
    assert (found.pours, found.former) == (3, 4)
    assert found.distinguishable == (test.high < 0 or test.low > 0)


def test_pours_of_both_settings_say_how_far_seeds_scatter():
    """By hand: squares 30 about 22 and 14 about 16, five degrees of freedom; the effect size by statsmodels."""
    found = compared(population(14.0, 15.0, 19.0), math.nan, population(18.0, 21.0, 24.0, 25.0))
    size = TTestIndPower().solve_power(nobs1=PLANNED, power=0.8, alpha=0.05)
    # Its search for a root stops at 1e-6 or so.
    assert found.resolved == pytest.approx(size * math.sqrt(44.0 / 5.0), rel=1e-5)


def test_the_difference_that_more_pours_would_show_is_shown_by_80_percent_of_them():
    """By counting: two settings that far apart, so many pours of each, a pooled t test at 5 %."""
    former = population(*np.random.default_rng(1).normal(20.0, 5.0, 30))
    sd, resolved = former.sample.sd, compared(population(), 20.0, former).resolved
    random = np.random.default_rng(2)
    one, two = (random.normal(mean, sd, (4000, PLANNED)) for mean in (0.0, resolved))
    assert np.mean(stats.ttest_ind(one, two, axis=1).pvalue < 0.05) == pytest.approx(0.8, abs=0.02)
