"""A pour that is brought back repeats the same bits, wherever it was kept and whatever happened since."""

import dataclasses

import numpy as np
import pytest

from solver.engine.moving_state import LOADED_ONCE, SCRATCH
from solver.engine.state import BODY, MEMBER, state
from solver.engine.world import Batch
from solver.pours.checkpoint import keep, put_back
from solver.pours.pour import Pour
from solver.pours.record import Outcome
from solver.pours.run import capacity_for
from solver.scenes.material_file import with_settings
from solver.scenes.scene import with_values
from tests.solver.pours.test_checkpoint import GATED, HEAP, same

pytestmark = pytest.mark.usefixtures("taichi")


def drive(pour, until=np.inf, at_most=None):
    """Run ``pour`` to the first moment of decision at or after ``until`` [s], in launches of ``at_most`` steps."""
    while steps := pour.steps_due(at_most):
        decided = pour.after(steps, pour.batch.advance(np.array([steps], dtype=np.int32))[0])
        if decided and pour.time >= until:
            break
    return pour


@pytest.mark.parametrize("scene", [HEAP, GATED], ids=["pour_through", "fill_then_open"])
@pytest.mark.parametrize("at", [0.06, 0.4])
def test_what_follows_is_the_same_twice(scene, at):
    """Kept while bodies enter, so that the random numbers matter, and while they pile up and contacts have springs."""
    pour = drive(Pour(Batch(capacity_for([scene], 1)), 0, scene, 5), until=at)
    kept = keep(pour)
    first = drive(pour).record()
    assert first.outcome != Outcome.RUNNING
    put_back(pour, kept)
    assert (pour.time, pour.outcome) == (kept.time, Outcome.RUNNING)
    same(drive(pour, at_most=37).record(), first)


def test_a_moment_within_a_change_of_stiffness_repeats_whatever_the_launches():
    stiffer = with_values(HEAP, {"material.seed.shear_modulus": 2 * HEAP.material("seed").shear_modulus})
    pour = drive(Pour(Batch(capacity_for([HEAP], 1)), 0, HEAP, 5), until=0.3)
    pour.ramp_to(stiffer)
    for _ in range(3):
        steps = pour.steps_due(11)
        pour.after(steps, pour.batch.advance(np.array([steps], dtype=np.int32))[0])
    kept = keep(pour)
    assert kept.decided["_ramp"] is not None
    first = drive(pour, until=0.6).record()
    put_back(pour, kept)
    same(drive(pour, until=0.6, at_most=7).record(), first)


def test_going_back_past_a_change_brings_the_old_parameters_back():
    pour = drive(Pour(Batch(capacity_for([HEAP], 1)), 0, HEAP, 5), until=0.3)
    kept = keep(pour)
    first = drive(pour, until=0.5).record()
    put_back(pour, kept)
    slippery = with_values(HEAP, {"pair.seed.seed.static_friction": 0.0, "pair.seed.plate.static_friction": 0.0})
    pour.ramp_to(slippery)
    other = drive(pour, until=0.5).record()
    assert not np.array_equal(other.bodies.position, first.bodies.position)
    put_back(pour, kept)
    assert pour.scene == kept.scene
    same(drive(pour, until=0.5).record(), first)


@pytest.mark.slow
def test_a_moment_from_before_effects_were_compiled_in():
    pour = drive(Pour(Batch(capacity_for([HEAP], 1)), 0, HEAP, 5), until=0.3)
    kept = keep(pour)
    first = drive(pour, until=0.4).record()
    put_back(pour, kept)
    pour.move_to(Batch(dataclasses.replace(pour.batch.capacity, effects=True)))
    pour.ramp_to(with_values(HEAP, {"effect.rolling_resistance.rolling_friction": 0.3}))
    rolling = drive(pour, until=0.4)
    assert not np.array_equal(rolling.record().bodies.position, first.bodies.position)
    later = keep(rolling)
    second = drive(rolling, until=0.5).record()
    put_back(pour, later)
    same(drive(pour, until=0.5).record(), second)
    put_back(pour, kept)
    same(drive(pour, until=0.4).record(), first)


def test_moving_surfaces_go_back_too():
    small = {"rig.name": "lifting_cylinder", "rig.mass": "6g", "insertion.rate": "60g/s"}
    scene = with_settings(HEAP, small)
    pour = Pour(Batch(capacity_for([scene], 1)), 0, scene, 5)
    while pour.gate_shut:
        drive(pour, until=pour.time)
    drive(pour, until=pour.time + 0.03)
    kept, poses, end = keep(pour), pour.surface_poses(), pour.time + 0.1
    drive(pour, until=end)
    first = pour.bodies().position, pour.surface_poses()
    assert not np.array_equal(first[1], poses)
    put_back(pour, kept)
    np.testing.assert_array_equal(pour.surface_poses(), poses)
    drive(pour, until=end, at_most=50)
    np.testing.assert_array_equal(pour.bodies().position, first[0])
    np.testing.assert_array_equal(pour.surface_poses(), first[1])


def test_what_is_not_kept_does_not_change():
    batch = Batch(capacity_for([HEAP], 1))
    pour = drive(Pour(batch, 0, HEAP, 5), until=0.05)
    arrays, tables = state(batch.capacity), {"body": BODY, "member": MEMBER}
    assert set(BODY) | set(MEMBER) >= LOADED_ONCE | SCRATCH

    def loaded():
        places = [(group, name) for group, table in tables.items() for name in table if name in LOADED_ONCE]
        return {place: getattr(getattr(arrays, place[0]), place[1]).to_numpy() for place in places}

    early = loaded()
    drive(pour, until=0.4)
    for place, late in loaded().items():
        np.testing.assert_array_equal(early[place], late, err_msg=".".join(place))
