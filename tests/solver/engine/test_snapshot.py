"""A world that is kept and put back goes on bit by bit, in whatever slot of whatever batch."""

from dataclasses import replace

import numpy as np
import pytest

from solver.engine.state import Capacity
from solver.engine.tables import body_tables
from solver.engine.world import Batch
from solver.scenes.time_step import time_step
from solver.single_body.free_world import EARTH, RADIUS, ROOM, grain_on_plate

pytestmark = pytest.mark.usefixtures("taichi")

N = 40
STEPS = 3000


def crowd(worlds, w, bodies=ROOM.bodies):
    """A heap of beads that fall on each other, in world ``w``."""
    scene = grain_on_plate(gravity=EARTH, friction=0.5)
    batch = Batch(replace(ROOM, worlds=worlds, bodies=bodies))
    batch.load(w, scene, body_tables(scene, np.zeros(N, dtype=np.int32)), time_step(scene), (True,))
    return batch


def drop(batch, w):
    rng = np.random.default_rng(3)
    for b in range(N):
        place = RADIUS * np.array([2.2 * (b % 3 - 1), 2.2 * (b // 3 % 3 - 1), 1.1 + 2.2 * (b // 9)])
        batch.enter(w, b, place, np.array([1.0, 0, 0, 0]), rng.normal(0, 0.1, 3), rng.normal(0, 5.0, 3))


def run(batch, w, steps):
    todo = np.zeros(batch.capacity.worlds, dtype=np.int32)
    todo[w] = steps
    return batch.advance(todo)[w]


@pytest.mark.parametrize(("worlds", "w", "bodies"), [(1, 0, 128), pytest.param(3, 2, 256, marks=pytest.mark.slow)])
def test_an_interrupted_run_ends_in_the_same_bits(worlds, w, bodies):
    whole = crowd(1, 0)
    drop(whole, 0)
    for _ in range(4):
        row = run(whole, 0, STEPS)
    expected = whole.bodies(0, N)
    first = crowd(1, 0)
    drop(first, 0)
    run(first, 0, STEPS)
    run(first, 0, STEPS)
    kept = first.take(0)
    assert (kept["contact.radius"] > 0).sum() > 5
    second = crowd(worlds, w, bodies)
    second.put(w, kept)
    run(second, w, STEPS)
    again = run(second, w, STEPS)
    assert np.array_equal(second.bodies(w, N), expected)
    assert np.array_equal(again, row)


def test_a_snapshot_without_the_springs_would_not():
    """What the test above would miss if springs did not matter."""
    whole = crowd(1, 0)
    drop(whole, 0)
    run(whole, 0, 2 * STEPS)
    kept = whole.take(0)
    run(whole, 0, STEPS)
    expected = whole.bodies(0, N)
    kept["contact.spring"][:] = 0.0
    whole.put(0, kept)
    run(whole, 0, STEPS)
    assert not np.array_equal(whole.bodies(0, N), expected)


def test_no_room_is_told():
    whole = crowd(1, 0)
    drop(whole, 0)
    run(whole, 0, STEPS)
    kept = whole.take(0)
    small = Batch(Capacity(worlds=1, bodies=32, members=256, contacts=16))
    with pytest.raises(ValueError, match="do not fit"):
        small.put(0, kept)
