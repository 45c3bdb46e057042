"""What is a heap and what a flat layer: made-up piles on either side of both limits, and pours of beans."""

import dataclasses
import io
import json

import numpy as np
import pytest

from doe.store import observables_of, read_off
from solver.observables.heap import told, why_no_heap
from solver.observables.reading import PileReading
from solver.observables.surface import body_thickness, grain_thickness
from solver.pours.raw_pour import packed, unpacked
from solver.pours.record import Outcome, Pile, Spheres
from solver.pours.run import run_pour
from solver.rigs import RIGS
from solver.scenes.scene import with_values
from tests.solver.beans import heap, two_layers
from tests.solver.observables.made_up import balls, empty_pile, joined, seeds_in_cone

REST = (Outcome.AT_REST, "")
RADIUS = 3e-3


def stacked(layers):
    """Square layers of balls, each above the gaps of the one below, the topmost of 4 balls and wider by one below."""
    places = []
    for level in range(layers):
        n = layers + 1 - level
        across = (np.arange(n) - 0.5 * (n - 1)) * 2 * RADIUS
        x, y = np.meshgrid(across, across)
        places.append(np.column_stack([x.ravel(), y.ravel(), np.full(n * n, RADIUS * (1 + np.sqrt(2) * level))]))
    return balls(np.concatenate(places), RADIUS)


@pytest.fixture(scope="module")
def layer(taichi):
    return run_pour(two_layers(), 7)


def test_two_layers_of_beans_are_no_heap_whatever_angle_they_are_read_at(layer):
    assert layer.outcome == Outcome.NO_HEAP
    assert not layer.outcome.valid
    assert layer.message == "a flat layer 12.00 mm high; a heap has 2.5 grain thicknesses, 15.16 mm"
    assert layer.ended == REST
    # An angle of a proper heap, by where two beans happen to lie.
    assert read_off(packed(layer), observables_of)["angle_of_repose_deg"] > 20.0


@pytest.mark.slow
@pytest.mark.usefixtures("taichi")
def test_beans_that_stay_piled_up_are_a_heap():
    record = run_pour(heap(), 3)
    assert (record.outcome, record.message) == REST
    assert unpacked(packed(record)).outcome == Outcome.AT_REST


def test_the_raw_pour_keeps_how_the_motion_ended_and_tells_the_same(layer):
    kept = unpacked(packed(layer))
    assert (kept.outcome, kept.message, kept.ended) == (layer.outcome, layer.message, layer.ended)
    with np.load(io.BytesIO(packed(layer))) as file:
        assert json.loads(bytes(file["head"]))["outcome"] == "at_rest"


@pytest.mark.usefixtures("taichi")
def test_a_pour_read_at_a_given_time_is_read_as_it_stands():
    record = run_pour(with_values(two_layers(), {"numerics.duration": 1.5}), 3)
    assert record.outcome == Outcome.MEASURED


def test_three_layers_of_balls_are_below_the_limit_and_four_above_it():
    """Heights by hand: 6 mm times 1 + 1/sqrt(2) = 1.71, 1 + 2/sqrt(2) = 2.41, and 3.12 with four; in whole pixels."""
    for layers, height in ((2, "10.25"), (3, "14.50")):
        why = f"a flat layer {height} mm high; a heap has 2.5 grain thicknesses, 15.00 mm"
        assert why_no_heap(stacked(layers)) == why
    assert why_no_heap(stacked(4)) == ""


def test_a_heap_exactly_at_the_limit_is_one():
    """15 mm are 2.5 diameters of 6 mm, and 60 pixels: rounding must not decide."""
    places = [[x, 0.0, 3e-3] for x in np.arange(-4, 5) * 6e-3] + [[x, 0.0, 8e-3] for x in np.arange(-3.5, 4) * 6e-3]
    limit = [[x, 0.0, 12e-3] for x in np.arange(-2, 3) * 6e-3]
    assert why_no_heap(balls(np.array(places + limit), RADIUS)) == ""
    below = [[x, 0.0, z - 0.3e-3] for x, _, z in limit]
    assert "a flat layer" in why_no_heap(balls(np.array(places + below), RADIUS))


def tower(*heights):
    """Balls above each other, one column of them beside the next."""
    return balls(np.array([[6e-3 * k, 0.0, 3e-3 + 6e-3 * j] for k, high in enumerate(heights) for j in range(high)]))


def test_a_tower_of_balls_is_too_few_grains_though_high_enough():
    """The line over its step leans on two balls; a straight tower has no flank at all."""
    assert np.nanmedian(PileReading(tower(4, 2)).flank_grains) == 2
    assert why_no_heap(tower(4, 2)) == "a flank's line is fitted to 2 grains (median), and needs 3"
    assert why_no_heap(tower(4)) == "no flank of it can be fitted"


def test_the_grains_of_a_flank_are_those_whose_tops_the_line_goes_through():
    """Nine columns of balls, each 3 mm lower than the last: tops at 30, 27, ... 6 mm. The window reaches from the last
    at least 24 mm high, the third, to the last at least 6 mm high, the ninth."""
    places = [[5.5e-3 * k, 0.0, 27e-3 - 3e-3 * k - 6e-3 * j] for k in range(9) for j in range(5 - k // 2)]
    _, right = PileReading(balls(np.array(places))).flank_grains[0]
    assert right == 7


def test_what_is_too_little_to_be_a_pile_is_no_heap():
    assert why_no_heap(empty_pile()) == "no body lies still on the plate"
    assert why_no_heap(balls(np.array([[0.0, 0.0, 3e-3]]))) == "1 body lies still on the plate"


def test_a_cone_of_seeds_is_a_heap():
    assert why_no_heap(seeds_in_cone(25.0, 80, np.random.default_rng(1), 0.5)) == ""


def test_the_thickness_is_the_mean_by_mass_of_bodies_in_their_own_sizes():
    """One body twice as large as nine others: eight times as heavy. By hand (9 6 + 8 12) / 17; the median is 6 mm."""
    small = balls(np.array([[0.02 * k, 0.0, 3e-3] for k in range(9)]), 3e-3)
    large = balls(np.array([[0.0, 0.05, 6e-3]]), 6e-3)
    mixed = joined(small, large)
    weights = np.array([1.0] * 9 + [8.0])
    mixed = dataclasses.replace(mixed, mass=weights)
    assert grain_thickness(mixed) == pytest.approx((9 * 6e-3 + 8 * 12e-3) / 17, rel=1e-12)
    assert body_thickness(mixed) == pytest.approx(6e-3, rel=1e-12)


def test_the_thickness_of_a_flat_body_is_its_smallest_extent_however_it_lies():
    """Four spheres of 2 mm in a square of 6 mm: 2 mm thick and 8 mm wide, lying, standing or aslant."""
    corners = np.array([[3, 3, 0], [-3, 3, 0], [-3, -3, 0], [3, -3, 0]]) * 1e-3
    for axis in ([0, 0, 1], [1, 0, 0], [1, 1, 1]):
        z = np.array(axis) / np.linalg.norm(axis)
        x = np.cross(z, [0.3, -0.5, 0.8])
        x /= np.linalg.norm(x)
        turned = corners @ np.stack([x, np.cross(z, x), z])
        body = Spheres(turned, np.full(4, 1e-3), np.zeros(4, dtype=np.int32))
        pile = Pile(body, np.zeros((1, 3)), np.ones(1), np.zeros(1, dtype=np.int32), ("plate",))
        assert grain_thickness(pile) == pytest.approx(2e-3, rel=1e-9)


@pytest.mark.parametrize("rig", ["funnel", "mesh_funnel", "lifting_cylinder"])
def test_a_heap_is_asked_for_where_its_angle_is(rig):
    layer = stacked(2)
    assert told(RIGS[rig](), REST, layer)[0] == Outcome.NO_HEAP
    for outcome in set(Outcome) - {Outcome.AT_REST}:
        assert told(RIGS[rig](), (outcome, "why"), layer) == (outcome, "why")


@pytest.mark.parametrize("rig", ["rotating_drum", "draw_down_box"])
def test_a_rig_that_makes_no_heap_by_design_lacks_none(rig):
    assert told(RIGS[rig](), REST, stacked(2)) == REST


def test_what_hangs_is_told_beside_the_missing_heap():
    outcome, message = told(RIGS["funnel"](), (Outcome.AT_REST, "0.4 g hang in the funnel"), stacked(2))
    assert outcome == Outcome.NO_HEAP
    assert message.endswith("15.00 mm; 0.4 g hang in the funnel")
