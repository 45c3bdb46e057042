"""What is fed into a pour: when the next body is due, and how those that came in are kept."""

import numpy as np
import pytest

from solver import load_material, with_values
from solver.pours.record import Spheres
from solver.pours.supply import Supply
from solver.scenes.scene import pour_rig

SCENE = with_values(
    load_material("sunflower_extract"), {"rig.mass": 0.003, "body.spheres": "coarse", "insertion.rate": 0.01}
)
EMPTY = Spheres(np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.int32))


def fed(seed=3, until=0.1):
    supply = Supply(SCENE, seed)
    return supply, list(supply.placed(pour_rig(SCENE).feed(), EMPTY, until, 500))


def test_bodies_come_at_the_rate_of_the_feed():
    """A body is due when those before it have been fed at 10 g/s."""
    supply, placed = fed()
    assert [number for number, _ in placed] == list(range(supply.entered))
    assert 0 < supply.missing < len(supply.order)
    before_last = supply.layout.numbers[: supply.entered - 1, 0].sum()
    assert before_last <= 0.01 * 0.1 < supply.entered_mass
    assert not supply.due(0.1)
    next_time = supply.entered_mass / 0.01
    assert supply.due(next_time + 1e-9)
    assert not supply.overdue(next_time + 0.9, 1.0)
    assert supply.overdue(next_time + 1.1, 1.0)


def test_a_feed_that_lags_behind_its_rate_is_not_full_while_bodies_find_a_place():
    """All are due within 0.3 s; the last of those that came in found its place at 5 s."""
    supply, _ = fed()
    supply.entries[-1] = supply.entries[-1]._replace(time=5.0)
    assert supply.missing > 0
    assert not supply.overdue(5.9, 1.0)
    assert supply.overdue(6.1, 1.0)


def test_a_seed_repeats_sizes_order_and_places():
    (one, _), (two, _), (other, _) = fed(3), fed(3), fed(4)
    np.testing.assert_array_equal(one.order, two.order)
    for a, b in zip(one.entries, two.entries, strict=True):
        np.testing.assert_array_equal(a.pose.position, b.pose.position)
        np.testing.assert_array_equal(a.pose.quaternion, b.pose.quaternion)
    assert not np.array_equal(one.order, other.order)


def test_a_body_that_finds_no_place_waits_and_so_do_those_after_it():
    feed = pour_rig(SCENE).feed()
    everywhere = Spheres(np.array([[0.0, 0.0, feed.floor]]), np.array([1.0]), np.zeros(1, dtype=np.int32))
    supply = Supply(SCENE, 3)
    assert list(supply.placed(feed, everywhere, 0.1, 500)) == []
    assert (supply.entered, supply.last_entry) == (0, 0.0)
    assert supply.due(0.1)


def test_without_a_body_left_nothing_is_due():
    supply, _ = fed(until=10.0)
    for k in range(60):
        list(supply.placed(pour_rig(SCENE).feed(), EMPTY, 10.0 + k, 500))
    assert supply.missing == 0
    assert not supply.due(1e6)
    assert not supply.overdue(1e6, 0.0)
    assert supply.entered_mass == pytest.approx(supply.mass)
    assert (np.diff(supply.times) >= 0.0).all()
