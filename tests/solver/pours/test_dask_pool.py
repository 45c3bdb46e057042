"""A real Dask scheduler and worker processes: the bits of this machine's own workers, and workers that come and go."""

import os
import signal
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np
import pytest
from distributed import LocalCluster

from solver import executor, load_material, with_values
from solver.pours import dask_pool
from solver.pours.dask_pool import DaskPool, Program
from solver.pours.executor import SchedulerError
from solver.pours.run import Job, run_pours
from solver.pours.worker_pool import WorkerPool
from tests.explorer.background.waiting import wait_for

HEAP = with_values(
    load_material("sunflower_extract"), {"rig.mass": 0.003, "body.spheres": "coarse", "numerics.max_time": 0.4}
)


@pytest.fixture(scope="module")
def cluster():
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True) as local:
        yield local


@pytest.fixture
def pool(cluster):
    with executor(scheduler=cluster.scheduler_address) as found:
        yield found


def test_one_name_for_both(pool):
    assert isinstance(pool, DaskPool)
    with executor(1) as here:
        assert isinstance(here, WorkerPool)


@pytest.mark.slow
def test_workers_killed_and_added_meanwhile_and_the_bits_are_those_of_this_process(taichi, cluster, pool):
    jobs = [Job(HEAP, seed, tag=seed) for seed in range(8)]
    queue, apart = deque(jobs[:6]), {}
    for job, record in pool.run_queue(queue, [HEAP]):
        if not apart:
            os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)  # its nanny starts another
            cluster.scale(3)
            queue.extend(jobs[6:])
        assert job.tag not in apart
        apart[job.tag] = record
    assert sorted(apart) == list(range(8))
    for seed, record in run_pours(jobs, worlds=2):
        np.testing.assert_array_equal(apart[seed].bodies.position, record.bodies.position)
        assert apart[seed].outcome == record.outcome


def test_a_worker_s_error_arrives_with_its_text(pool):
    with pytest.raises(RuntimeError, match="a pour broke off"):
        list(pool.run_queue(deque([Job(with_values(HEAP, {"rig.mass": 0.2}), 1)]), [HEAP]))


def test_a_worker_of_another_version_is_refused_by_name(pool, monkeypatch):
    monkeypatch.setattr(dask_pool, "PHYSICS", 99)
    with pytest.raises(SchedulerError, match=r"physics \d+ on cpu, but the pours come from .*physics 99"):
        list(pool.run_queue(deque([Job(HEAP, 1)]), [HEAP]))
    assert Program.here().physics == 99


def test_no_scheduler_is_one_line(monkeypatch):
    monkeypatch.setattr(dask_pool, "CONNECTED", 0.5)
    with pytest.raises(SchedulerError, match=r"^--scheduler tcp://127\.0\.0\.1:9: no Dask scheduler answers there"):
        executor(scheduler="tcp://127.0.0.1:9")


def test_a_worker_of_several_threads_is_refused_by_name():
    with (
        LocalCluster(n_workers=1, threads_per_worker=4, dashboard_address=None, processes=False) as threaded,
        DaskPool(threaded.scheduler.address) as pool,
        pytest.raises(SchedulerError, match=r"^worker .*: has 4 threads; start it with --nthreads 1"),
    ):
        list(pool.run_queue(deque([Job(HEAP, 1)]), [HEAP]))


def answered(job, room, asked_by, key):
    """In place of a pour."""
    return job.seed


@contextmanager
def asked_without_workers():
    """A cluster whose workers are threads, none as yet, and what three pours that it has been asked for will give."""
    with (
        LocalCluster(n_workers=0, threads_per_worker=1, dashboard_address=None, processes=False) as cluster,
        DaskPool(cluster.scheduler_address) as pool,
        ThreadPoolExecutor(1) as beside,
    ):
        jobs = deque(Job(HEAP, seed) for seed in range(3))
        found = beside.submit(lambda: {record for _, record in pool.run_queue(jobs, [HEAP])})
        wait_for(lambda: len(cluster.scheduler.tasks) == 3)
        yield cluster, found


def test_pours_wait_for_workers(monkeypatch):
    monkeypatch.setattr(dask_pool, "_poured", answered)
    with asked_without_workers() as (cluster, found):
        cluster.scale(1)
        assert found.result() == {0, 1, 2}


def test_a_scheduler_that_ends_is_one_line():
    with asked_without_workers() as (cluster, found):
        cluster.close()
        with pytest.raises(SchedulerError, match=r"^--scheduler .*: the scheduler has stopped"):
            found.result()


def test_a_worker_that_would_pour_something_else_is_refused_by_name(pool, monkeypatch):
    """A mesh file with other contents than here, or another version of a plug-in: the pour has another key there."""
    monkeypatch.setattr(dask_pool, "pour_key", lambda scene, seed: "another")
    with pytest.raises(SchedulerError, match=r"^worker tcp://.*: its version of a mesh file or plug-in differs"):
        list(pool.run_queue(deque([Job(HEAP, 1)]), [HEAP]))
