"""The plate is tapped and shaken, a body is pulled: closed forms, their energy, and the same bits however it is run."""

import dataclasses
import math

import numpy as np
import pytest

from solver.engine.world import SUMMARY_COLUMNS, Batch
from solver.params import ParameterError
from solver.pours.checkpoint import checkpoint_of, keep, put_back
from solver.pours.disturbance import PIECES, Pull, Shake, Tap
from solver.pours.parameter_ramp import RAMP_TIME
from solver.pours.pour import Pour
from solver.pours.record import Outcome
from solver.pours.run import capacity_for
from solver.rigs import Funnel
from solver.scenes.body import Body, Members
from solver.scenes.insertion import Insertion
from solver.scenes.material import Material, Pair
from solver.scenes.scene import Scene, with_rig, with_values
from tests.solver.pours.test_checkpoint import HEAP, same
from tests.solver.pours.test_rewind import drive

pytestmark = pytest.mark.usefixtures("taichi")

G = 9.81
TAP = Tap(amplitude=5e-4, duration=0.02)
SHAKE = Shake(amplitude=1e-3, frequency=25.0, periods=4)
MASS, FRICTION = 2e-3, 0.4


def slab(**values):
    """One slab on four feet, 16 mm apart, that falls onto the plate and cannot roll."""
    feet = tuple((x, y, 0.0) for x in (-0.008, 0.008) for y in (-0.008, 0.008))
    shape = Members(feet, (2e-3,) * 4, MASS, (1e-6, 1e-6, 1e-6))
    rubber = Material("rubber", density=1000.0, shear_modulus=1e8, poisson_ratio=0.3)
    scene = Scene(
        title="slab",
        materials=(rubber, Material("steel", density=7800.0, shear_modulus=1e8, poisson_ratio=0.3)),
        bodies=(Body("slab", "rubber", 1.0, shape, 1000.0),),
        pairs=(Pair("slab", "slab", FRICTION, 0.2), Pair("slab", "steel", FRICTION, 0.2)),
        rig=Funnel(wall="steel", mass=MASS, outlet_diameter=0.07, cone_height=0.02, outlet_height=0.02),
        insertion=Insertion(rate=1.0),
    )
    return with_values(scene, values)


@pytest.fixture
def resting():
    """The slab at rest on the plate."""
    pour = drive(Pour(Batch(capacity_for([slab()], 1)), 0, slab(), 1))
    assert pour.ended[0] == Outcome.AT_REST
    return pour


def advance(pour, seconds):
    """Run on by ``seconds`` to the nearest step, whatever is decided on the way."""
    left = round(seconds / pour.dt)
    while left > 0 and (steps := pour.steps_due(left)) > 0:
        pour.after(steps, pour.batch.advance(np.array([steps], dtype=np.int32))[0])
        left -= steps


def test_letting_go_of_nothing_disturbs_nothing(resting):
    resting.pull(None)
    assert not resting.disturbed
    assert resting.ended[0] == Outcome.AT_REST
    assert resting.steps_due() == 0


def test_the_plate_ends_where_it_began_though_steps_grow_in_its_last_piece(resting):
    softer = with_values(slab(), {"material.rubber.shear_modulus": 1e6, "material.steel.shear_modulus": 1e6})
    before, piece = resting.dt, TAP.duration / PIECES
    resting.ramp_to(softer)
    # The ramp, as long as the tap, ends in the tap's last piece.
    assert TAP.duration == RAMP_TIME
    advance(resting, 0.4 * piece)
    resting.move_plate(TAP)
    while resting.disturbance:
        steps = resting.steps_due()
        resting.after(steps, resting.batch.advance(np.array([steps], dtype=np.int32))[0])
    assert resting.dt > 5.0 * before
    # What one step more or less makes at the speed of the last piece.
    speed = TAP.amplitude * 2.0 * math.pi / TAP.duration
    assert abs(resting.surface_poses()[0, 2]) < resting.dt * speed


@pytest.mark.parametrize(("motion", "axis"), [(TAP, 2), (SHAKE, 0)], ids=["tap", "shake"])
def test_the_plate_follows_its_displacement_and_ends_where_it_began(resting, motion, axis):
    resting.move_plate(motion)
    began, seen = resting.time, []
    while resting.disturbance:
        steps = resting.steps_due()
        resting.after(steps, resting.batch.advance(np.array([steps], dtype=np.int32))[0])
        seen.append((resting.time - began, resting.surface_poses()[0, axis]))
    time, place = np.array(seen).T
    wanted = np.array([motion.displacement(min(t, motion.duration))[axis] for t in time])
    # Ends of pieces lie on the curve, moments of decision between them on its chords: off by (π/PIECES)²/2 at most.
    assert np.abs(place - wanted).max() < 0.5 * (2 * math.pi / PIECES) ** 2 * motion.amplitude
    assert np.ptp(place) == pytest.approx(motion.amplitude * (1 if axis == 2 else 2), rel=0.01)
    assert abs(place[-1]) < 1e-15
    assert time[-1] == pytest.approx(motion.duration, abs=resting.dt)
    advance(resting, 0.01)
    assert abs(resting.surface_poses()[0, axis]) < 1e-15


def test_peaks_are_those_of_the_displacement():
    for motion in (TAP, SHAKE):
        time = np.linspace(0.0, motion.duration, 20001)[:-1]
        place = np.array([sum(motion.displacement(t)) for t in time])
        velocity = np.gradient(place, time)
        assert np.abs(velocity).max() == pytest.approx(motion.largest_velocity, rel=1e-3)
        assert np.abs(np.gradient(velocity, time))[2:-2].max() == pytest.approx(motion.largest_acceleration, rel=1e-3)


def test_a_tap_faster_than_gravity_throws_the_slab_and_a_slow_one_does_not(resting):
    heights = []
    for motion in (TAP, Tap(amplitude=5e-4, duration=0.2)):
        assert (motion.largest_acceleration > G) == (motion is TAP)
        resting.move_plate(motion)
        gap = 0.0
        while resting.disturbance:
            advance(resting, 1e-3)
            gap = max(gap, resting.bodies().position[0, 2] - 2e-3 - resting.surface_poses()[0, 2])
        heights.append(gap)
        drive(resting)
    assert heights[0] > 1e-4
    assert heights[1] < 1e-5


def test_a_pull_weaker_than_friction_moves_nothing_and_a_stronger_one_by_coulombs_law(resting):
    before = resting.bodies().position[0].copy()
    resting.pull(Pull(0, (0.9 * FRICTION * MASS * G, 0.0, 0.0)))
    advance(resting, 0.1)
    assert np.linalg.norm(resting.bodies().position[0] - before) < 2e-5
    force = 1.5 * FRICTION * MASS * G
    resting.pull(Pull(0, (force, 0.0, 0.0)))
    begin, seconds = resting.bodies().position[0, 0], 0.1
    advance(resting, seconds)
    # x = a t²/2 with a = F/m − μ g.
    assert resting.bodies().position[0, 0] - begin == pytest.approx(
        0.5 * (force / MASS - FRICTION * G) * seconds**2, rel=0.02
    )
    # Let go, it stands still again after v/(μ g), and the pour comes to rest.
    resting.pull(None)
    drive(resting)
    assert resting.ended[0] == Outcome.AT_REST
    assert resting.disturbance == ""
    assert resting.disturbed


def test_in_free_fall_a_pull_is_an_acceleration_and_its_work_is_counted():
    """Before anything touches: constant acceleration, and kinetic + potential energy gain what the pull puts in."""
    scene = slab()
    pour = Pour(Batch(capacity_for([scene], 1)), 0, scene, 1)
    force = (2e-3, 0.0, 3.0 * MASS * G)
    pour.pull(Pull(0, force))
    kinetic, potential, work = (SUMMARY_COLUMNS.index(name) for name in ("kinetic", "potential", "wall_work"))
    first, begin = pour.batch.measure(0)[0], pour.batch.bodies(0, 1)[0]
    advance(pour, 0.02)
    last, end = pour.batch.measure(0)[0], pour.batch.bodies(0, 1)[0]
    gained = (end[7:10] - begin[7:10]) / (round(0.02 / pour.dt) * pour.dt)
    np.testing.assert_allclose(gained, np.array(force) / MASS - [0.0, 0.0, G], rtol=1e-9, atol=1e-9)
    rise = (last[kinetic] + last[potential]) - (first[kinetic] + first[potential])
    assert last[work] == pytest.approx(rise, rel=1e-3)
    assert abs(last[work]) > 1e-4


def disturbed(at_most=None):
    """A heap that was shaken and one of whose bodies is pulled, in the middle of both."""
    pour = drive(Pour(Batch(capacity_for([HEAP], 1)), 0, HEAP, 3), until=0.4, at_most=at_most)
    pour.move_plate(SHAKE)
    pour.pull(Pull(3, (0.0, 0.0, 5e-3)))
    return drive(pour, until=pour.time + 0.05, at_most=at_most)


def test_a_moment_within_a_shake_and_a_pull_repeats_whatever_the_launches():
    pour = disturbed()
    kept = keep(pour)
    assert pour.disturbance.startswith("the plate is shaken")
    first = drive(pour, until=0.8).record()
    pour.pull(None)
    drive(pour, until=0.9)
    put_back(pour, kept)
    assert "body no. 4 is pulled" in pour.disturbance
    same(drive(pour, until=0.8, at_most=7).record(), first)
    same(drive(disturbed(at_most=13), until=0.8).record(), first)


def test_brought_back_before_it_nothing_was_disturbed():
    pour = drive(Pour(Batch(capacity_for([HEAP], 1)), 0, HEAP, 3), until=0.4)
    kept = keep(pour)
    plain = drive(pour, until=0.7).record()
    put_back(pour, kept)
    pour.move_plate(TAP)
    pour.pull(Pull(3, (0.0, 0.0, 5e-3)))
    other = drive(pour, until=0.7).record()
    assert not np.array_equal(other.bodies.position, plain.bodies.position)
    put_back(pour, kept)
    assert not pour.disturbed
    same(drive(pour, until=0.7).record(), plain)


@pytest.mark.slow
def test_a_pull_goes_along_into_a_batch_with_effects():
    pour = disturbed()
    expected = drive(pour, until=0.6).record()
    pour = disturbed()
    pour.move_to(Batch(dataclasses.replace(pour.batch.capacity, effects=True)))
    moved = drive(pour, until=0.6).record()
    np.testing.assert_allclose(moved.bodies.position, expected.bodies.position, atol=1e-4)
    assert moved.bodies.position[3, 2] > 0.05  # pulled with ten times its weight


def test_what_cannot_be_done_is_refused(resting):
    drum = with_rig(HEAP, "rotating_drum")
    turning = Pour(Batch(capacity_for([drum], 1)), 0, drum, 1)
    with pytest.raises(ParameterError, match="has no plate"):
        turning.move_plate(TAP)
    with pytest.raises(ParameterError, match=r"no body 2; 1 have entered"):
        resting.pull(Pull(1, (0.0, 0.0, 1e-3)))
    resting.move_plate(TAP)
    with pytest.raises(ParameterError, match="already moving"):
        resting.move_plate(TAP)
    with pytest.raises(ParameterError, match="no checkpoint while the plate is tapped"):
        checkpoint_of(resting)
    for make in (lambda: Tap(1.0, 0.02), lambda: Shake(1e-3, math.nan), lambda: Pull(0, (0.0, 99.0, 0.0))):
        with pytest.raises(ParameterError, match="is outside"):
            make()
