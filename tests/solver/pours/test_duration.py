"""A pour that is read at a given time: when it ends, how, and what belongs to its pile."""

import numpy as np
import pytest

from solver.params import ParameterError
from solver.pours.record import Outcome
from solver.pours.run import run_pour
from solver.scenes.material_file import with_settings
from solver.scenes.scene import with_values
from tests.explorer.beads import bead_scene
from tests.solver.pours.test_pour import COARSE
from tests.solver.rigs.test_rig_pours import BOX, CYLINDER

pytestmark = pytest.mark.usefixtures("taichi")

BEADS = with_values(bead_scene(4), {"insertion.region_radius": "20mm"})


@pytest.fixture(scope="module")
def at_rest():
    from solver import backend

    backend.init(threads=2)
    return run_pour(with_values(BEADS, {"numerics.max_time": 3.0}), 1)


# 0.15 s: in the funnel and in the air; 0.3037 s: between two samples.
@pytest.mark.parametrize("duration", [0.15, 0.3037])
def test_a_pour_runs_exactly_so_long(duration):
    record = run_pour(with_values(BEADS, {"numerics.duration": duration}), 1)
    assert (record.outcome, record.message) == (Outcome.MEASURED, "")
    assert record.outcome.valid
    # It ends with the first step at or after the moment.
    assert 0.0 <= record.trace.time[-1] - duration + 1e-12 < record.dt
    assert record.steps * record.dt == pytest.approx(record.trace.time[-1], rel=1e-12)


def test_until_then_it_is_the_same_pour(at_rest):
    record = run_pour(with_values(BEADS, {"numerics.duration": 0.3037}), 1)
    n = record.trace.time.size - 1
    assert n == 30
    assert np.array_equal(record.trace.time[:n], at_rest.trace.time[:n])
    assert np.array_equal(record.trace.kinetic_energy[:n], at_rest.trace.kinetic_energy[:n])


def test_what_is_still_in_the_funnel_is_not_in_the_pile():
    record = run_pour(with_values(BEADS, {"numerics.duration": 0.2}), 1)
    lying = record.bodies.position[:, 2] < BEADS.rig.outlet_height
    assert 0 < lying.sum() < 4
    assert record.pile.mass.size == lying.sum()


def test_a_bead_that_rolls_away_is_in_the_picture_of_that_moment():
    """A bead on a plate rolls for ever: no part of a pile at rest, but part of one that is read at a given time."""
    rolled = {"numerics.duration": 1.6, "rig.domain_half_width": 5.0}
    record = run_pour(with_values(bead_scene(4), rolled), 1)
    speed = np.linalg.norm(record.bodies.velocity, axis=1)
    assert speed.max() > BEADS.numerics.rest_speed
    assert np.hypot(*record.bodies.position[:, :2].T).max() > bead_scene(4).rig.inlet_diameter / 2
    assert record.pile.mass.size == 4


def test_a_jam_is_read_as_it_is():
    jam = {"rig.outlet_diameter": "16mm", "insertion.rate": "200g/s", "numerics.duration": 1.2}
    record = run_pour(with_values(COARSE, jam), 1)
    assert record.outcome == Outcome.MEASURED
    assert record.trace.discharged_mass[-1] < 0.9 * record.poured_mass


@pytest.mark.parametrize(("rig", "duration"), [(CYLINDER, 0.3), (BOX, 0.2)], ids=["cylinder", "box"])
def test_the_other_pours_are_read_at_a_given_time_too(rig, duration):
    record = run_pour(with_values(rig, {"numerics.duration": duration}), 1)
    assert record.outcome == Outcome.MEASURED
    assert record.trace.time[-1] == pytest.approx(duration, abs=record.dt)


def test_a_broken_run_keeps_its_name():
    record = run_pour(with_values(BEADS, {"numerics.duration": 1.0, "numerics.overlap_limit": 0.001}), 1)
    assert record.outcome == Outcome.OVERLAP_LIMIT


def test_a_drum_runs_for_its_own_time():
    with pytest.raises(ParameterError, match=r"numerics\.duration: 2 s; allowed in the rig rotating_drum"):
        with_settings(BEADS, {"rig.name": "rotating_drum", "numerics.duration": 2.0})


def test_a_duration_beyond_the_end_of_the_run_is_refused():
    with pytest.raises(ParameterError, match=r"numerics\.duration: 9 s .* allowed: up to 8 s"):
        with_values(BEADS, {"numerics.duration": 9.0})


def test_a_batch_may_hold_what_the_interval_after_it_feeds():
    """Beads due every 22.6 ms, batches every 50 ms: due up to then at the batch, or one interval earlier."""
    batches = {"numerics.sample_interval": 0.05, "numerics.duration": 0.2}
    after = run_pour(with_values(BEADS, batches), 1)
    before = run_pour(with_values(BEADS, batches | {"insertion.lead": 0.05}), 1)
    # By hand: due at 0, 22.6, 45.2, 67.9 ms.
    np.testing.assert_allclose(after.entries.time, [0.0, 0.05, 0.05, 0.1], atol=before.dt)
    np.testing.assert_allclose(before.entries.time, [0.0, 0.0, 0.0, 0.05], atol=before.dt)
