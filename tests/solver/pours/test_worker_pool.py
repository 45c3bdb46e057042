"""Worker processes: the same bits as in this process, errors that arrive, and nothing left behind."""

import multiprocessing as mp
import os
import signal
import subprocess
import sys
import time
from collections import deque
from pathlib import Path

import numpy as np
import pytest

from solver import ParameterError, load_material, with_values
from solver.pours import worker_pool
from solver.pours.run import Job, run_pours
from solver.pours.worker_pool import PourBrokeOff, Room, Rooms, WorkerLost, WorkerPool, deaf_to_interrupts

HEAP = with_values(
    load_material("sunflower_extract"), {"rig.mass": 0.003, "body.spheres": "coarse", "numerics.max_time": 0.4}
)


@pytest.fixture(scope="module")
def pool():
    with WorkerPool(2) as workers:
        yield workers


def test_same_bits_as_in_one_process(taichi, pool):
    jobs = [Job(HEAP, seed, tag=seed) for seed in range(3)]
    apart = {job.tag: record for job, record in pool.run_queue(deque(jobs), [HEAP])}
    here = dict(run_pours(jobs, worlds=2))
    assert sorted(apart) == [0, 1, 2]
    for seed, record in here.items():
        np.testing.assert_array_equal(apart[seed].bodies.position, record.bodies.position)
        assert apart[seed].outcome == record.outcome


def test_jobs_may_be_added_while_it_runs(pool):
    queue = deque([Job(HEAP, 1, tag=0)])
    seen = []
    for job, _ in pool.run_queue(queue, [HEAP]):
        seen.append(job.tag)
        if job.tag < 2:
            queue.append(Job(HEAP, 2, tag=job.tag + 1))
    assert seen == [0, 1, 2]


def test_a_workers_error_arrives_with_its_text(pool):
    queue = deque([Job(with_values(HEAP, {"rig.mass": 0.2}), 1)])
    job = queue[0]
    with pytest.raises(PourBrokeOff, match=r"a pour broke off: .*; seed 1 of") as broken:
        list(pool.run_queue(queue, [HEAP]))
    assert broken.value.job is job


def kill(process):
    os.kill(process.pid, signal.SIGKILL)
    process.join()


def test_the_pour_of_a_killed_worker_is_poured_by_another(taichi, pool, caplog):
    """Killed between two queues, and while it pours; the bits are those of this process, and the loss is logged."""
    jobs = [Job(HEAP, seed, tag=seed) for seed in range(3)]
    list(pool.run_queue(deque(jobs[:1]), [HEAP]))
    kill(pool._processes[0][0])
    apart = {}
    for job, record in pool.run_queue(deque(jobs), [HEAP]):
        if not apart:
            kill(pool._processes[1][0])
        apart[job.tag] = record
    assert sorted(apart) == [0, 1, 2]
    assert any("a worker process has ended (1 of 3 losses)" in record.getMessage() for record in caplog.records)
    for seed, record in run_pours(jobs, worlds=2):
        np.testing.assert_array_equal(apart[seed].bodies.position, record.bodies.position)


def test_a_pour_that_kills_every_worker_is_given_up_and_named(monkeypatch):
    monkeypatch.setattr(worker_pool, "_worker", lambda: ended())
    with WorkerPool(1) as pool, pytest.raises(WorkerLost, match=r"3 worker processes .* seed 7 of "):
        list(pool.run_queue(deque([Job(HEAP, 7)]), [HEAP]))


def takes_a_pour_and_ends(pipe):
    pipe.recv()
    pipe.recv()


def ended():
    """A worker that is gone as soon as it has been given a pour."""
    ours, theirs = mp.Pipe()
    process = mp.get_context("spawn").Process(target=takes_a_pour_and_ends, args=(theirs,))
    process.start()
    theirs.close()
    return process, ours


def test_nothing_is_left_after_close():
    pool = WorkerPool(1)
    list(pool.run_queue(deque([Job(HEAP, 1)]), [HEAP]))
    ((process, _),) = pool._processes
    pool.close()
    assert process.exitcode == 0


@pytest.mark.parametrize("workers", [0, -1, 1.5])
def test_less_than_one_worker_is_refused(workers):
    """None at all would let the queue wait for ever."""
    with pytest.raises(ParameterError, match=f"workers {workers}: allowed: a whole number of at least 1"):
        WorkerPool(workers)


LONG = """
import sys
from collections import deque
from solver import Job, load_material, with_values
from solver.pours.worker_pool import WorkerPool
scene = with_values(load_material("sunflower_extract"), {"rig.mass": 0.003, "body.spheres": "coarse"})
short = with_values(scene, {"numerics.max_time": 0.1})
long = with_values(scene, {"rig.mass": 0.3, "numerics.duration": 60.0, "numerics.max_time": 60.0})
with WorkerPool(1) as pool:
    for job, _ in pool.run_queue(deque([Job(short, 1), Job(long, 2)]), [scene, long]):
        print(job.seed, flush=True)
"""


def test_a_worker_does_not_outlive_the_process_in_charge_by_its_pour():
    """It would go on for minutes, and hold what it has inherited: the lock of the output folder, and here a pipe."""
    in_charge = subprocess.Popen([sys.executable, "-c", LONG], stdout=subprocess.PIPE, text=True)
    assert in_charge.stdout is not None
    assert in_charge.stdout.readline() == "1\n"
    time.sleep(0.5)
    in_charge.kill()
    in_charge.communicate(timeout=20.0)


def hears_interrupts(pipe):
    pipe.send(signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ()))


def test_a_process_is_deaf_to_interrupts_from_its_first_moment():
    ours, theirs = mp.Pipe()
    process = mp.get_context("spawn").Process(target=hears_interrupts, args=(theirs,))
    with deaf_to_interrupts():
        process.start()
    assert not ours.recv()
    process.join()
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_so_is_the_first_one_of_a_program():
    """With it multiprocessing starts its resource tracker, and lets Ctrl-C through again."""
    name = "tests.solver.pours.test_worker_pool"
    code = f"from {name} import test_a_process_is_deaf_to_interrupts_from_its_first_moment as t; t()"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parents[3])


def test_a_scene_without_effects_in_the_kernels_has_a_room_without_them(taichi):
    """Whatever else was asked for; a tilt is a matter of the set-up and needs none."""
    rolling = with_values(HEAP, {"effect.rolling_resistance.rolling_friction": 0.1})
    tilted = with_values(HEAP, {"effect.plate_tilt.tilt_x": 2.0})
    rooms = Rooms()
    rooms.make(Room.of([rolling, HEAP]))
    assert rooms.for_scene(rolling).capacity.effects
    assert not rooms.for_scene(HEAP).capacity.effects
    assert rooms.for_scene(tilted) is rooms.for_scene(HEAP)


def test_a_room_is_kept_until_it_is_too_small(taichi):
    rooms = Rooms()
    rooms.make(Room.of([HEAP]))
    first = rooms.for_scene(HEAP)
    rooms.make(Room.of([with_values(HEAP, {"rig.mass": 0.001})]))
    assert rooms.for_scene(HEAP) is first
    larger = with_values(HEAP, {"rig.mass": 0.1})
    rooms.make(Room.of([larger]))
    assert rooms.for_scene(larger).capacity.bodies > first.capacity.bodies
    assert rooms.for_scene(HEAP) is rooms.for_scene(larger)
