"""What it costs to hand pours to a Dask scheduler, measured: ``python -m tests.solver.pours.dispatch`` (5 min).

A scheduler and two workers are started on this machine, and the same pours are made by them and by two processes of
`local`, in turns, so that what slows the machine for a while slows both. Then pours that take no time show what a task
costs each side, and finished ones are put into a store. ``docs/many_machines.md`` has the numbers.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import statistics
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import psutil
from distributed import Client
from distributed.protocol import dumps, to_serialize
from scipy.stats import t as student

from doe.pour_runner import stored_run
from doe.store import Store, observables_of
from solver import Executor, Job, Record, executor, load_material, pour_key, with_values
from solver.pours import dask_pool
from solver.pours.worker_pool import Room

WORKERS = 2
SIDES = ("local", "Dask")
IDLE = 10.0
"""Seconds for which Dask's processes are watched with nothing to do: what they take then grows with time, not pours."""
SCENE = with_values(load_material("sunflower_extract"), {"rig.mass": 0.02, "body.spheres": "coarse"})
"""A pour of the shipped study's quick profile."""
_kept: Record | None = None
"""A worker's answer to every pour that takes no time."""


@dataclass(frozen=True)
class Spent:
    """What a number of pours took."""

    wall_s: float
    cpu_s: float


@dataclass(frozen=True)
class Dask:
    """A scheduler at work. ``workers``: the process that has started them."""

    address: str
    scheduler: psutil.Process
    workers: psutil.Process


def answer(job: Job, room: Room, asked_by: dask_pool.Program, key: str) -> Record:
    """In a worker: the record of the first pour that it was asked for, whatever is asked for."""
    global _kept
    if _kept is None:
        _kept = dask_pool._poured(job, room, asked_by, key)
    return _kept


def family(process: psutil.Process) -> list[psutil.Process]:
    """A process, and those that it has started and that run."""
    return [process, *process.children(recursive=True)]


def cpu(processes: Sequence[psutil.Process]) -> float:
    """CPU time [s] that they have taken so far."""
    return sum(times.user + times.system for times in (one.cpu_times() for one in processes))


@contextmanager
def cluster(folder: Path) -> Iterator[Dask]:
    """A scheduler with ``WORKERS`` workers of this machine."""
    file = folder / "scheduler.json"
    dask = (sys.executable, "-m", "dask")
    where = ("--scheduler-file", str(file), "--no-dashboard")
    with ExitStack() as ending:
        scheduler = ending.enter_context(_running((*dask, "scheduler", "--port", "0", *where)))
        workers = ending.enter_context(
            _running((*dask, "worker", *where, "--nthreads", "1", "--nworkers", str(WORKERS)))
        )
        with Client(scheduler_file=str(file), set_as_default=False) as client:
            client.wait_for_workers(WORKERS)
            address = str(client.scheduler.address)
        yield Dask(address, psutil.Process(scheduler.pid), psutil.Process(workers.pid))


@contextmanager
def _running(command: tuple[str, ...]) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def poured(pool: Executor, jobs: Sequence[Job]) -> list[Record]:
    """Pours of ``SCENE``."""
    return [record for _, record in pool.run_queue(deque(jobs), [SCENE])]


def first_jobs(number: int) -> list[Job]:
    """So many pours of ``SCENE``."""
    return [Job(SCENE, seed) for seed in range(number)]


def spent(work: Callable[[], object], processes: Sequence[psutil.Process]) -> Spent:
    """What ``work`` takes, and what these processes take meanwhile."""
    before, began = cpu(processes), time.perf_counter()
    work()
    return Spent(time.perf_counter() - began, cpu(processes) - before)


def ratio_text(ratios: list[float]) -> str:
    """Geometric mean of ratios with its 95 % interval."""
    logs = [math.log(one) for one in ratios]
    mean = statistics.fmean(logs)
    half = float(student.ppf(0.975, len(logs) - 1)) * statistics.stdev(logs) / math.sqrt(len(logs))
    return f"{math.exp(mean):.3f} (95 % {math.exp(mean - half):.3f} … {math.exp(mean + half):.3f})"


def overhead(dask: Dask, rounds: int, pours: int) -> None:
    """Dask over local: wall time, and CPU time of all processes that have a part."""
    with executor(WORKERS) as local, executor(scheduler=dask.address) as many:
        for pool in (local, many):
            poured(pool, first_jobs(2 * WORKERS))  # starts workers, and compiles
        here = psutil.Process()
        own = [psutil.Process(child.pid) for child in multiprocessing.active_children()]
        sides = [(local, [here, *own]), (many, [here, *family(dask.scheduler), *family(dask.workers)])]
        idle = spent(partial(time.sleep, IDLE), sides[1][1])
        rate = idle.cpu_s / idle.wall_s
        print(f"Dask at rest: {100 * rate:.1f} % of a core", flush=True)
        found: list[list[Spent]] = []
        for k in range(rounds):
            jobs = [Job(SCENE, 1000 + k * pours + j) for j in range(pours)]
            turns = [0, 1] if k % 2 else [1, 0]
            took = {side: spent(partial(poured, sides[side][0], jobs), sides[side][1]) for side in turns}
            found.append([took[0], took[1]])
            told = (
                f"{name} {took[side].wall_s:.1f} s, {took[side].cpu_s:.1f} CPU s" for side, name in enumerate(SIDES)
            )
            print(f"round {k + 1}: {'; '.join(told)}", flush=True)
    print(f"{rounds} rounds of {pours} pours, {WORKERS} workers of Dask over {WORKERS} processes of local:")
    print(f"  wall time {ratio_text([many.wall_s / local.wall_s for local, many in found])}")
    busy = [(many.cpu_s - rate * many.wall_s) / local.cpu_s for local, many in found]
    print(f"  CPU time {ratio_text(busy)} without what Dask takes at rest")


def tasks(dask: Dask, number: int) -> Record:
    """Sizes of messages, and what a task that takes no time costs each side; a record."""
    pour, dask_pool._poured = dask_pool._poured, answer
    try:
        with executor(scheduler=dask.address) as many:
            (record,) = poured(many, first_jobs(1))
            poured(many, first_jobs(4 * WORKERS))
            sides = {
                "scheduler": family(dask.scheduler),
                "command": [psutil.Process()],
                "workers": family(dask.workers),
            }
            before = {name: cpu(processes) for name, processes in sides.items()}
            wall_s = spent(lambda: poured(many, first_jobs(number)), ()).wall_s
            each = {name: 1e3 * (cpu(processes) - before[name]) / number for name, processes in sides.items()}
    finally:
        dask_pool._poured = pour
    task = (Job(SCENE, 1), Room.of([SCENE]), dask_pool.Program.here(), pour_key(SCENE, 1))
    print(f"a task {size(task) / 1e3:.1f} kB, a result {size(record) / 1e3:.1f} kB")
    costs = ", ".join(f"{name} {ms:.2f} ms" for name, ms in each.items())
    print(f"{number} tasks without work: {number / wall_s:.0f} per second; CPU time of each: {costs}")
    return record


def size(message: object) -> int:
    """Bytes of ``message`` as Dask sends it."""
    return sum(len(frame) for frame in dumps({"message": to_serialize(message)}))


def stored(record: Record, number: int) -> None:
    """What it takes to read a pour off, and to write it to the store."""
    here = [psutil.Process()]
    rows = [stored_run(Job(SCENE, 1), record, "", "", "", observables_of, pour_key(SCENE, 1))]
    read = spent(
        lambda: [stored_run(Job(SCENE, 1), record, "", "", "", observables_of, rows[0].key) for _ in range(20)], here
    )
    with tempfile.TemporaryDirectory(dir=".") as folder, closing(Store(Path(folder) / "pours.sqlite")) as store:
        rows = [replace(rows[0], key=pour_key(SCENE, seed)) for seed in range(number)]
        write = spent(lambda: [store.add(row) for row in rows], here)
    for what, took, n in (("reading a pour off", read, 20), ("a write to the store", write, number)):
        print(f"{what}: {1e3 * took.wall_s / n:.1f} ms, {1e3 * took.cpu_s / n:.1f} ms of CPU")
    print(f"a pour in the store: {len(rows[0].raw) / 1e3:.1f} kB")


def main() -> None:
    """Measure all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--pours", type=int, default=8, help="Pours of a round.")
    parser.add_argument("--tasks", type=int, default=2000, help="Tasks without work.")
    asked = parser.parse_args()
    with executor(1) as local:
        poured(local, first_jobs(1))  # so that no worker has to compile: those of Dask keep no kernels
    with tempfile.TemporaryDirectory() as folder, cluster(Path(folder)) as dask:
        record = tasks(dask, asked.tasks)
        stored(record, 200)
        overhead(dask, asked.rounds, asked.pours)


if __name__ == "__main__":
    # By its name: workers cannot import what is called __main__, and are sent a copy that remembers nothing.
    from tests.solver.pours import dispatch

    dispatch.main()
