"""The outside effects against closed forms, on pours of a dozen bodies."""

import numpy as np
import pytest

from doe.validation import outside
from doe.validation.laboratory import TREFOILS, read_laboratory
from solver import body_counts, observe, with_values

SEED = 3


@pytest.fixture(scope="module")
def scene():
    low = read_laboratory(TREFOILS).declared.fit[-1].scene
    return with_values(low, {"rig.mass": 0.0014, "numerics.duration": 0.3})


@pytest.fixture(scope="module")
def record(taichi, scene):
    return outside.driven(scene, SEED)


def read(record):
    return {name: found.value for name, found in observe(record).items()}


def test_a_pour_that_nothing_acts_on_is_any_pour(record, scene):
    from solver import run_pour

    usual = run_pour(scene, SEED)
    assert np.array_equal(usual.bodies.position, record.bodies.position)


def test_cut_into_short_launches_it_is_the_same_pour(record, scene):
    again = outside.driven(scene, SEED, lambda batch, pour, passed: None, outside.KICK)
    assert np.array_equal(again.bodies.position, record.bodies.position)


def test_a_misread_scale_multiplies_lengths_and_leaves_the_clock(record):
    before, after = read(record), read(outside.magnified(record, 1.1))
    for name in ("footprint_r50_m", "footprint_r90_m", "centroid_x_m"):
        assert after[name] == pytest.approx(1.1 * before[name], rel=1e-12)
    for name in ("discharge_t10_s", "discharge_t90_s", "residual_mass_kg"):
        assert after[name] == before[name]


def test_what_sticks_is_left_in_the_funnel_and_counts_as_poured(record):
    assert read(record)["residual_mass_kg"] == 0.0
    stuck = 0.05 * record.poured_mass
    after = outside.with_stuck(record, stuck)
    assert read(after)["residual_mass_kg"] == pytest.approx(stuck, rel=1e-9)
    assert read(after)["discharge_t90_s"] > read(record)["discharge_t90_s"]


def test_broken_bodies_weigh_what_they_weighed(scene):
    before, after = scene, outside.broken(scene, 0.25)
    ((whole,), (kept, lobes)) = body_counts(before), body_counts(after)
    mass = before.bodies[0].shape.mass
    # Whole numbers of bodies: half a trefoil before, half a trefoil and half a lobe after.
    assert kept * mass + lobes * mass / 3 == pytest.approx(whole * mass, abs=(0.5 + 0.5 + 0.5 / 3) * mass)
    assert lobes == pytest.approx(3 * 0.25 * whole, abs=1)


def test_the_plate_swings_about_a_fixed_height(taichi, scene):
    heights = []

    def act(batch, pour, passed):
        outside.vibrate(batch, pour, passed, 0.02)
        heights.append(batch.surface_state(0)[outside.PLATE, 2])

    outside.driven(scene, SEED, act, outside.HALF_PERIOD)
    # A half period is a whole number of steps but for one.
    swing = 0.02 * outside.HALF_PERIOD
    assert np.ptp(heights) == pytest.approx(swing, rel=0.02)
    assert abs(heights[-1]) <= 1.02 * swing


def test_the_attraction_gives_its_impulse_to_bodies_near_the_plate(taichi, scene):
    seen, total = [], []

    def act(batch, pour, passed):
        before = batch.bodies(0, pour.entered)
        outside.attract(batch, pour, passed, 0.5)
        assert passed <= 0.02 * (1.0 + 1e-9)
        total.append(passed)
        seen.append((before, batch.bodies(0, pour.entered)))

    last = outside.driven(scene, SEED, act, 0.02)
    # Launches are also cut at samples: impulses over the time that passed add up to those over the whole pour.
    assert sum(total) == pytest.approx(last.trace.time[-1], rel=1e-6)
    before, after = (np.concatenate(part) for part in zip(*seen, strict=True))
    near = before[:, 2] < 3 * outside.REACH
    given = -0.5 * 9.81 * np.exp(-before[near, 2] / outside.REACH)
    given *= np.concatenate([np.full(len(one), step) for (one, _), step in zip(seen, total, strict=True)])[near]
    assert near.any()
    assert not near.all()
    assert after[near, 9] - before[near, 9] == pytest.approx(given, rel=1e-6)
    assert np.array_equal(after[:, :9], before[:, :9])
    assert np.array_equal(after[~near], before[~near])
