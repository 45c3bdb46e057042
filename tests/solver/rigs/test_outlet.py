"""What lies across an outlet: placed by hand, and in pours, with the mass that it holds up."""

import dataclasses

import numpy as np
import pytest

from solver.engine.world import Batch
from solver.pours.pour import Pour
from solver.pours.raw_pour import packed, unpacked
from solver.pours.record import Bodies, Outcome, Spheres
from solver.pours.run import capacity_for
from solver.rigs.outlet import RoundOutlet, Slot, _reaches_both_sides, obstruction, waiting
from solver.scenes.body import Members
from solver.scenes.scene import with_values
from tests.solver.pours.test_pour import COARSE

HEIGHT, HALF = 0.065, 0.015
ROUND, SLOT = RoundOutlet(HALF), Slot(HALF)
STICK = np.linspace(-0.029, 0.029, 12)
"""Places of a stick's spheres along it [m]."""


def placed(*sticks, above=()):
    """Bodies and spheres of sticks, each by its middle and direction, and of single balls of 1 g at ``above``."""
    lines = [np.array(middle) + STICK[:, None] * np.array(way) / np.linalg.norm(way) for middle, way in sticks]
    n, balls = len(sticks), np.array(above, dtype=float).reshape(-1, 3)
    centre = np.concatenate([*lines, balls])
    owner = np.concatenate([np.repeat(np.arange(n), STICK.size), n + np.arange(len(balls))]).astype(np.int32)
    position = np.concatenate([np.array([middle for middle, _ in sticks]).reshape(-1, 3), balls])
    number = n + len(balls)
    bodies = Bodies(
        component=np.array([0] * n + [1] * len(balls), dtype=np.int32),
        component_names=("stick", "ball"),
        mass=np.array([0.4e-3] * n + [1e-3] * len(balls)),
        scale=np.ones(number),
        position=position,
        quaternion=np.tile([1.0, 0.0, 0.0, 0.0], (number, 1)),
        velocity=np.zeros((number, 3)),
        inside=np.ones(number, dtype=bool),
    )
    return bodies, Spheres(centre, np.full(len(centre), 2.7e-3), owner)


def found(bodies, spheres, outlet=ROUND, keeps=False):
    return obstruction(outlet, HEIGHT, bodies, spheres, bodies.position[:, 2] > HEIGHT, keeps)


LEVEL = (0.0, 0.003, HEIGHT + 0.003)


@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, 0.0, 0.2)])
def test_a_stick_over_the_opening_is_across_it_and_holds_what_is_above(way):
    seen = found(*placed((LEVEL, way), above=[(0.0, 0.0, 0.08), (0.03, 0.0, 0.1)]))
    assert (seen.component, seen.mass) == ("stick", pytest.approx(0.4e-3))
    assert seen.above == pytest.approx(2e-3)


def test_a_stick_wedged_higher_up_tells_how_high():
    way = (1.0, 0.0, 0.0)
    assert found(*placed((LEVEL, way))).height == 0.0
    # Its lowest point: the middle of its spheres less their radius, over the edge.
    assert found(*placed(((0.0, 0.003, HEIGHT + 0.04), way))).height == pytest.approx(0.04 - 2.7e-3)


def test_a_stick_alone_holds_nothing():
    assert found(*placed((LEVEL, (0.0, 1.0, 0.0)))).above == 0.0


@pytest.mark.parametrize(
    ("middle", "way"),
    [
        ((0.0, 0.0, HEIGHT - 0.02), (0.0, 0.0, 1.0)),  # stands in the outlet, its middle below
        ((0.022, 0.0, HEIGHT + 0.02), (0.3, 0.0, 1.0)),  # leans on the wall, its middle beside the opening
        ((0.0145, 0.0, HEIGHT + 0.003), (0.0, 1.0, 0.0)),  # lies along the edge, a stick that is much longer
        ((0.0, 0.0, HEIGHT - 0.01), (1.0, 0.0, 0.0)),  # below the edge, on the heap
    ],
)
def test_a_stick_that_could_fall_or_lets_pass_is_not_across(middle, way):
    assert found(*placed((middle, way), above=[(0.0, 0.0, 0.12)])) is None


def test_a_stick_that_lies_on_others_which_hang_is_part_of_an_arch():
    on_top = ((0.0, 0.0, HEIGHT + 0.02), (1.0, 0.0, 0.0))
    arch = [(0.006, 0.0, HEIGHT + 0.005), (-0.006, 0.0, HEIGHT + 0.005)]
    assert found(*placed(on_top, above=arch)) is None
    assert found(*placed(on_top, above=[(0.0, 0.0, HEIGHT + 0.03)])).above == pytest.approx(1e-3)


def test_balls_are_an_arch_however_many():
    ring = [(0.008 * np.cos(a), 0.008 * np.sin(a), HEIGHT + 0.004) for a in np.arange(0.0, 6.0, 1.0)]
    assert found(*placed(above=ring)) is None


def test_over_a_slot_the_way_across_counts_and_what_lies_beside_it_belongs_there():
    over, beside = (0.0, 0.03, HEIGHT + 0.02), (0.05, 0.0, HEIGHT + 0.004)
    across = found(*placed((LEVEL, (1.0, 0.0, 0.0)), above=[over, beside]), outlet=SLOT, keeps=True)
    assert across.above == pytest.approx(1e-3)
    assert found(*placed((LEVEL, (0.0, 1.0, 0.0)), above=[over]), outlet=SLOT, keeps=True) is None


def test_a_bent_body_across_a_slot_reaches_both_edges_wherever_along_it():
    """Its middle is off the line between the ends, along the slot; across it, they are on opposite sides."""
    ends, middle = np.array([[-HALF, 0.06], [HALF, 0.06]]), np.zeros(2)
    assert _reaches_both_sides(SLOT, ends, np.full(2, 1e-3), middle)
    assert not _reaches_both_sides(SLOT, np.array([[HALF, 0.06], [HALF, -0.06]]), np.full(2, 1e-3), middle)


def test_what_lies_beside_a_slot_is_no_arch_under_the_body_across_it():
    raised, above = (0.0, 0.0, HEIGHT + 0.009), (0.0, 0.0, HEIGHT + 0.02)
    beside = (0.08, 0.0, HEIGHT + 0.003)
    across = found(*placed((raised, (1.0, 0.0, 0.0)), above=[above, beside]), outlet=SLOT, keeps=True)
    assert (across.component, across.above) == ("stick", pytest.approx(1e-3))


def test_the_height_over_a_slot_is_that_above_its_edge():
    """The container ends 45 mm below the edge."""
    middle = (0.0, 0.0, HEIGHT + 0.045 + 0.003)
    assert found(*placed((middle, (1.0, 0.0, 0.0))), outlet=Slot(HALF, 0.045), keeps=True).height == 0.0
    wedged = found(*placed(((0.0, 0.0, HEIGHT + 0.085), (1.0, 0.0, 0.0))), outlet=Slot(HALF, 0.045), keeps=True)
    assert wedged.height == pytest.approx(0.04 - 2.7e-3)


def test_bodies_over_the_outlet_wait_there_and_those_beside_it_do_not():
    bodies, _ = placed(above=[(0.0, 0.03, HEIGHT + 0.02), (0.02, 0.0, HEIGHT + 0.02), (0.0, 0.0, HEIGHT - 0.02)])
    held = bodies.position[:, 2] > HEIGHT
    assert [waiting(outlet, HEIGHT, bodies, held) for outlet in (SLOT, ROUND)] == [1, 0]
    # A heap below that reaches into a deep slot, but not to its edge, keeps nothing back.
    assert waiting(Slot(HALF, 0.03), HEIGHT, bodies, held) == 0


BALL = Members(((0.0, 0.0, 0.0),), (13.5e-3,), 1e-3, (7.3e-8,) * 3)
"""Passes the outlet, but not beside a petiole in the neck."""


def stopped(rig_values):
    """The finished pour of a petiole across the neck of a shallow funnel, with two balls on it: put there by hand."""
    petiole = next(body for body in COARSE.bodies if body.name == "petiole")
    charge = petiole.mass + 2 * BALL.mass
    bodies = (
        dataclasses.replace(COARSE.bodies[0], shape=BALL, mass_fraction=2 * BALL.mass / charge),
        dataclasses.replace(petiole, mass_fraction=petiole.mass / charge),
    )
    values = {"rig.mass": charge, "insertion.rate": 10.0, "rig.cone_height": 0.02}
    scene = with_values(dataclasses.replace(COARSE, bodies=bodies), values | rig_values)
    pour = Pour(Batch(capacity_for([scene], 1)), 0, scene, 1)
    placed = False
    while n := pour.steps_due():
        pour.after(n, pour.batch.advance(np.array([n], dtype=np.int32))[0])
        if pour.supply.missing == 0 and not placed:
            placed, upright = True, np.array([1.0, 0.0, 0.0, 0.0])
            (stick,) = np.flatnonzero(pour.supply.order == 1)
            pour.batch.enter(0, stick, np.array([0.0, 0.0, 0.076]), upright, np.zeros(3), np.zeros(3))
            for b, y in zip(np.flatnonzero(pour.supply.order == 0), (-0.014, 0.014), strict=True):
                pour.batch.enter(0, b, np.array([0.0, y, 0.1]), upright, np.zeros(3), np.zeros(3))
    return pour


@pytest.mark.usefixtures("taichi")
@pytest.mark.parametrize("allowed", [1, 5])
def test_a_petiole_in_the_neck_obstructs_the_outlet_however_many_bodies_may_hang(allowed):
    pour = stopped({"numerics.hanging_bodies": allowed})
    record = pour.record()
    assert record.outcome == Outcome.OBSTRUCTED
    assert not record.outcome.valid
    told = "one petiole (0.428 g) lies across the outlet of the funnel and holds up 2 g, 82 % of the charge"
    assert record.message == told
    kept = unpacked(packed(record))
    assert (kept.outcome, kept.message) == (record.outcome, told)


@pytest.mark.usefixtures("taichi")
def test_a_changed_friction_lets_an_obstructed_pour_go_on():
    pour = stopped({})
    pour.ramp_to(with_values(pour.scene, {"pair.petiole.rigid_sieve_plate.static_friction": 0.0}))
    assert pour.outcome == pour.ended[0] == Outcome.RUNNING
    assert pour.steps_due() > 0
