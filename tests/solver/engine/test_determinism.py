"""Same seed, same bits: whatever the threads, the slot and who used it before, the launches, the onlookers, the list.

Bodies sleep and wake in all of these pours. ``test_pour.py`` has the plainest cases, ``test_snapshot.py`` restarts.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from solver.backend import ti
from solver.engine.world import SUMMARY_COLUMNS, Batch
from solver.pours.pour import Pour
from solver.pours.run import Job, capacity_for, run_pours
from solver.scenes.scene import with_values
from tests.solver.effects.cases import all_felt
from tests.solver.pour_digests import HEAP, JOBS, SHUT, WORLDS, digest, digests

pytestmark = pytest.mark.usefixtures("taichi")

ASLEEP = SUMMARY_COLUMNS.index("asleep")
BIG = with_values(HEAP, {"rig.mass": "12g"})


def room(worlds):
    """One size for all pours of this file, so that kernels are compiled twice."""
    return capacity_for([BIG], worlds)


def watched(scene, seed, chunks=None, look=False):
    """One pour alone, in launches of at most the next of ``chunks``: (record, most sleepers before the end)."""
    pour = Pour(Batch(room(1)), 0, scene, seed)
    sleepers = []
    while n := pour.steps_due(next(chunks) if chunks else None):
        row = pour.batch.advance(np.array([n], dtype=np.int32))[0]
        sleepers.append(row[ASLEEP])
        pour.after(n, row)
        if look:
            pour.batch.measure(0)
            pour.batch.surface_state(0)
            pour.record()
    return pour.record(), max(sleepers[:-1])


@pytest.fixture(scope="module")
def alone(taichi):
    """The pour (SHUT, seed 2) by itself, in the fewest launches."""
    record, sleepers = watched(SHUT, 2)
    assert sleepers > 5
    return digest(record)


def test_the_digest_sees_a_bit(alone):
    record, _ = watched(SHUT, 2)
    assert digest(record) == alone
    record.bodies.velocity[0, 0] = np.nextafter(record.bodies.velocity[0, 0], 1.0)
    assert digest(record) != alone


def test_one_thread_or_two(alone):
    """Three worlds at a time that two threads share, here, and one thread by itself in another process."""
    assert ti.lang.impl.current_cfg().cpu_max_num_threads == 2
    command = [sys.executable, "-m", "tests.solver.pour_digests", "1"]
    other = subprocess.run(command, cwd=Path(__file__).parents[3], capture_output=True, text=True, check=True)
    here = digests(2)
    assert json.loads(other.stdout) == here
    assert here[JOBS.index(Job(SHUT, 2))] == alone


def test_a_slot_that_others_have_used(alone):
    """The last job gets a slot in which larger pours of other materials have ended; others go on beside it."""
    slippery = with_values(BIG, {f"pair.{p.a}.{p.b}.static_friction": 0.05 for p in BIG.pairs})
    jobs = [Job(BIG, 1), Job(slippery, 2), Job(slippery, 3), Job(BIG, 4), Job(SHUT, 2)]
    records = dict(run_pours(jobs, worlds=WORLDS))
    assert digest(records[4]) == alone


@pytest.mark.parametrize("seed", range(3))
def test_launches_of_any_length(alone, seed):
    """From single steps to more than fit between two moments of decision."""
    generator = np.random.default_rng(seed)
    chunks = (int(np.exp(generator.uniform(0.0, np.log(2000.0)))) for _ in iter(int, 1))
    record, _ = watched(SHUT, 2, chunks=chunks)
    assert digest(record) == alone


@pytest.mark.parametrize("skin", ["0.2mm", "1.01mm", "3mm"])
def test_a_contact_list_of_any_reach(alone, skin):
    """The list is built more often or less; sleeping contacts are evaluated at every build."""
    record, _ = watched(with_values(SHUT, {"numerics.skin": skin}), 2)
    assert digest(record) == alone


@pytest.mark.slow
def test_a_contact_list_of_any_reach_with_every_effect():
    """What effects keep of a sleeping contact stays as it is, too."""
    scene = with_values(all_felt(HEAP), {"numerics.max_time": "1.2s"})
    thin, thick = (with_values(scene, {"numerics.skin": skin}) for skin in ("0.5mm", "2mm"))
    room_for_both = capacity_for([thin, thick], 1)
    found = []
    for one in (thin, thick):
        pour = Pour(Batch(room_for_both), 0, one, 1)
        asleep = 0
        while n := pour.steps_due():
            row = pour.batch.advance(np.array([n], dtype=np.int32))[0]
            asleep = max(asleep, row[ASLEEP])
            pour.after(n, row)
        assert asleep > 5
        found.append(digest(pour.record()))
    assert found[0] == found[1]


def test_looking_changes_nothing(alone):
    """Summaries, forces on surfaces and records that are taken between launches."""
    record, _ = watched(SHUT, 2, chunks=iter(lambda: 700, 0), look=True)
    assert digest(record) == alone


@pytest.mark.slow
def test_an_interrupted_pour_with_sleepers_ends_in_the_same_bits():
    """A pile some of which sleeps, kept and put back into another slot: bits of bodies, sums, and forces on walls."""
    pour = Pour(Batch(room(1)), 0, HEAP, 1)
    while pour.entered < len(pour.supply.order) or pour.samples[-1]["asleep"] < 8:
        steps = pour.steps_due()
        pour.after(steps, pour.batch.advance(np.array([steps], dtype=np.int32))[0])
    kept, n, steps = pour.batch.take(0), pour.entered, 20_000
    assert 0 < (pour.batch.bodies(0, n)[:, 15] == 0).sum() < n

    def onward(batch, w):
        batch.put(w, kept)
        todo = np.zeros(batch.capacity.worlds, dtype=np.int32)
        todo[w] = steps
        row = batch.advance(todo)[w]
        return row, batch.bodies(w, n), batch.surface_state(w)

    first = onward(pour.batch, 0)
    assert first[0][ASLEEP] != kept["body.asleep"].sum()
    other = Pour(Batch(room(WORLDS)), 2, HEAP, 7)
    for one, two in zip(first, onward(other.batch, 2), strict=True):
        assert np.array_equal(one, two)
