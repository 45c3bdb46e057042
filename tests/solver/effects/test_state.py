"""What effects keep of a contact survives lists, snapshots, slots and switching; sleepers feel them."""

import dataclasses
import itertools

import numpy as np
import pytest

from solver.effects.columns import COUPLE, HERTZ, MEMORY
from solver.engine.kernels.neighbours import MOST
from solver.scenes.time_step import time_step
from solver.single_body.free_world import EARTH, RADIUS, ROOM, FreeWorld
from tests.solver.effects.cases import (
    ROOM_WITH_EFFECTS,
    THREE_WORLDS,
    all_felt,
    crowd,
    felt,
    fill,
    onward,
    scene_with,
    with_effects,
)

pytestmark = pytest.mark.usefixtures("taichi")

N, STEPS = 24, 1500
SCENE = all_felt(scene_with(gravity=EARTH))
WEAKER = with_effects(
    SCENE, felt("rolling_resistance", rolling_friction=0.02), felt("adhesion_jkr", work_of_adhesion=0.3)
)


@pytest.fixture(scope="module")
def whole(taichi):
    """Four launches of the crowd with all effects, alone in its batch: (snapshot after two, last summary, bodies)."""
    batch = crowd(ROOM_WITH_EFFECTS, SCENE)
    onward(batch, STEPS)
    onward(batch, STEPS)
    kept = batch.take(0)
    onward(batch, STEPS)
    return kept, onward(batch, STEPS), batch.bodies(0, N)


def test_every_memory_is_in_use(whole):
    """Else the tests below would compare zeros."""
    memory = whole[0]["memory.number"]
    assert memory.shape[1] == HERTZ + 1
    for first, last in itertools.pairwise(MEMORY):
        if last > first:
            assert np.abs(memory[:, first:last]).max() > 0.0
    assert np.abs(memory[:, COUPLE:]).max(axis=0).min() > 0.0


@pytest.mark.slow
def test_the_same_bits_in_another_slot_among_other_worlds(whole):
    """Two threads share three worlds, one of them with weaker effects and one with none."""
    _, row, bodies = whole
    batch = crowd(THREE_WORLDS, SCENE, w=2)
    fill(batch, WEAKER, 0)
    fill(batch, scene_with(gravity=EARTH), 1)
    todo = np.full(3, STEPS, dtype=np.int32)
    for _ in range(4):
        last = batch.advance(todo)
    assert last[2].tolist() == list(row.values())
    assert np.array_equal(batch.bodies(2, N), bodies)
    for w in (0, 1):
        assert not np.array_equal(batch.bodies(w, N), bodies)


def test_without_its_memory_a_snapshot_goes_another_way(whole):
    """What the test above would miss if the memory did not matter."""
    kept, _, bodies = whole
    batch = crowd(ROOM_WITH_EFFECTS, SCENE)
    batch.put(0, kept | {"memory.number": np.zeros_like(kept["memory.number"])})
    onward(batch, 2 * STEPS)
    assert not np.array_equal(batch.bodies(0, N), bodies)


def test_the_list_may_be_built_often_or_seldom(whole):
    """Skins of 0.1 and 8 mm: the memory is carried over, and entries that do not act change no sum."""
    _, row, bodies = whole
    rebuilds = []
    for skin in (1e-4, 8e-3):
        scene = dataclasses.replace(SCENE, numerics=dataclasses.replace(SCENE.numerics, skin=skin))
        batch = crowd(ROOM_WITH_EFFECTS, scene)
        last = onward(batch, 4 * STEPS)
        assert np.array_equal(batch.bodies(0, N), bodies)
        # Summed over other launches, the energies are the same sums.
        assert last["dissipated"] == row["dissipated"]
        rebuilds.append(last["rebuilds"])
    assert rebuilds[0] > 5 * rebuilds[1] > 0


@pytest.mark.slow
def test_from_a_batch_without_effects_into_one_that_others_have_used():
    """The trajectory up to the switch, and beyond it as long as no effect is on, is that of the batch without."""
    plain = scene_with(gravity=EARTH)
    used = crowd(ROOM_WITH_EFFECTS, SCENE)
    onward(used, STEPS)  # leaves its memory behind
    batch = crowd(ROOM, plain)
    onward(batch, STEPS)
    kept = batch.take(0)
    expected = onward(batch, STEPS)
    bodies = batch.bodies(0, N)
    other = crowd(ROOM_WITH_EFFECTS, plain)
    other.put(0, kept)
    assert not other.take(0)["memory.number"][:, :HERTZ].any()
    assert onward(other, STEPS) == expected
    assert np.array_equal(other.bodies(0, N), bodies)
    back = crowd(ROOM, plain)
    back.put(0, crowd_after(plain, kept).take(0))
    assert onward(back, STEPS) == expected


def crowd_after(scene, kept):
    batch = crowd(ROOM_WITH_EFFECTS, scene)
    batch.put(0, kept)
    return batch


def test_no_effects_in_a_batch_without():
    with pytest.raises(RuntimeError, match="effects=True"):
        crowd(ROOM, SCENE)


def test_a_grip_that_comes_later_widens_the_search():
    """Cells of the grid of bodies are as long as the grip asks, whenever it is set."""
    bridge = felt("capillary_bridge", bridge_volume=1e-7)
    at_once = crowd(ROOM_WITH_EFFECTS, with_effects(scene_with(gravity=EARTH), bridge)).take(0)
    batch = crowd(ROOM_WITH_EFFECTS, scene_with(gravity=EARTH))
    batch.set_effects(0, with_effects(scene_with(gravity=EARTH), bridge))
    later = batch.take(0)
    for name in ("world.cell", "world.grip"):
        assert later[name] == pytest.approx(at_once[name])
    assert later["world.cell"] > 2 * RADIUS + 4e-3
    batch.set_effects(0, scene_with(gravity=EARTH))
    assert batch.take(0)["world.cell"] == pytest.approx(2 * RADIUS + 2 * MOST * 1e-3)


SLEEPY = {"sleep_speed": 2e-3, "gravity": EARTH, "restitution": 0.3}


def test_a_pile_that_sticks_and_does_not_roll_falls_asleep_and_stands():
    # Without resistance to twisting a sphere would spin on about its vertical axis.
    effects = (felt("rolling_resistance"), felt("adhesion_jkr", work_of_adhesion=0.3), felt("twisting", strength=10.0))
    batch = crowd(ROOM_WITH_EFFECTS, scene_with(*effects, **SLEEPY))
    dt = time_step(scene_with(*effects, **SLEEPY))
    row = onward(batch, round(1.5 / dt))
    assert row["asleep"] == N
    before = batch.bodies(0, N)
    assert before[:, 2].max() > 1.5 * RADIUS  # not one layer
    onward(batch, round(0.2 / dt))
    assert np.array_equal(batch.bodies(0, N), before)
    # Without the effects it wakes, and spreads.
    batch.set_effects(0, scene_with(**SLEEPY))
    assert onward(batch, 1)["asleep"] == 0
    onward(batch, round(0.3 / dt))
    spread = [np.hypot(*(state[:, :2] - state[:, :2].mean(axis=0)).T).mean() for state in (before, batch.bodies(0, N))]
    assert spread[1] > 1.1 * spread[0]


def test_a_sleeper_that_hangs_by_a_pull_is_held_and_falls_when_it_ends():
    scene = scene_with(felt("adhesion_jkr"), turn=(0.0, 1.0, 0.0, 0.0), **SLEEPY)
    lab = FreeWorld(scene, 1)
    lab.put(0, (0.0, 0.0, -RADIUS + 1e-6))
    assert lab.run(round(0.3 / lab.dt))["asleep"] == 1
    there = lab.state()[0, 2]
    lab.run(round(0.3 / lab.dt))
    assert lab.state()[0, 2] == there
    weight = lab.scene.bodies[0].mass * 9.81
    assert lab.batch.surface_state(0)[0, 15] == pytest.approx(-weight, rel=0.02)  # BALANCE
    lab.batch.set_effects(0, scene_with(turn=(0.0, 1.0, 0.0, 0.0), **SLEEPY))
    lab.run(round(0.1 / lab.dt))
    assert there - lab.state()[0, 2] == pytest.approx(0.5 * 9.81 * 0.1**2, rel=0.05)


def test_a_sleeper_wakes_when_what_sticks_to_it_is_pulled_away():
    """A sphere stands on another that sleeps; it is lifted, and the pull wakes the other."""
    scene = scene_with(felt("adhesion_jkr", work_of_adhesion=5.0), **SLEEPY)
    lab = FreeWorld(scene, 2)
    lab.put(0, (0.0, 0.0, RADIUS))
    lab.put(1, (0.0, 0.0, 3.0 * RADIUS))
    assert lab.run(round(0.4 / lab.dt))["asleep"] == 2
    top = lab.state()[1]
    lab.put(1, top[:3], velocity=(0.0, 0.0, 0.02))
    lab.run(round(0.002 / lab.dt))
    assert lab.batch.bodies(0, 2)[0, 15] == 0
