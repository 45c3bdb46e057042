"""Pours on the workers of a Dask scheduler: the cores of many machines, the same bits.

A task is one pour, in one world and one thread, as in :class:`solver.pours.worker_pool.WorkerPool`; Dask hands out
tasks, sends results back as they finish, and gives those of a worker that died to another. Workers may come and go, and
none need be there at first: a task brings along everything that it needs. Each worker needs the same version of this
program and one thread: ``dask worker tcp://… --nthreads 1 --nworkers -1`` starts one per core.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any, Self

from solver.arch import chosen
from solver.pours.executor import SchedulerError
from solver.pours.pour_key import pour_key
from solver.pours.worker_pool import PourBrokeOff, Room, Rooms, WorkerLost
from solver.scenes.scene import Scene
from solver.version import PHYSICS

if TYPE_CHECKING:
    from solver.pours.record import Record
    from solver.pours.run import Job

CONNECTED = 10.0
"""Time within which a scheduler has to answer [s]."""
_rooms: Rooms | None = None
"""The batches of this worker, once it has poured."""


@dataclass(frozen=True)
class Program:
    """What must be the same on both sides."""

    version: str
    physics: int
    arch: str
    """The kind of processor that it pours on (`solver.arch`)."""

    @staticmethod
    def here() -> Program:
        """The program of this process."""
        try:
            return Program(version("repose-explorer"), PHYSICS, chosen())
        except PackageNotFoundError:
            return Program("source tree", PHYSICS, chosen())

    def __str__(self) -> str:
        return f"version {self.version}, physics {self.physics} on {self.arch}"


class DaskPool:
    """The workers of the scheduler at ``address``, e.g. ``tcp://127.0.0.1:8786``; used like a WorkerPool.

    Raises SchedulerError if Dask is not installed or nobody answers there.
    """

    def __init__(self, address: str) -> None:
        try:
            from distributed import Client
        except ImportError:
            raise SchedulerError(
                f"--scheduler {address}: Dask is not installed; pip install 'repose-explorer[dask]'"
            ) from None
        # It would print a traceback when a connection breaks; the consequences are raised as errors anyway.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        self._address = address
        try:
            self._client = Client(address, timeout=CONNECTED, set_as_default=False)
        except (OSError, ValueError) as error:
            raise SchedulerError(f"--scheduler {address}: no Dask scheduler answers there ({error})") from None

    def run_queue(self, queue: deque[Job], room: Sequence[Scene]) -> Iterator[tuple[Job, Record]]:
        """Run the jobs in ``queue`` and yield (job, record) as each finishes; jobs may be appended meanwhile.

        ``room`` lists scenes; every job has to fit into their sizes. Raises PourBrokeOff with a worker's error,
        WorkerLost if workers died on the same pour again and again, and SchedulerError for a worker that would pour
        something else or if the scheduler has ended.
        """
        from distributed import CancelledError, as_completed
        from distributed.scheduler import KilledWorker

        needed, here = Room.of(room), Program.here()
        finished = as_completed(loop=self._client.loop)
        asked: dict[Any, Job] = {}
        try:
            while queue or asked:
                while queue:
                    job = queue.popleft()
                    key = pour_key(job.scene, job.seed)
                    future = self._client.submit(_poured, job, needed, here, key, pure=False)
                    asked[future] = job
                    finished.add(future)
                future = next(finished)
                job = asked.pop(future)
                try:
                    record: Record = future.result()
                except KilledWorker:
                    raise WorkerLost(
                        f"several workers died on the same pour, seed {job.seed} of {job.scene.title!r}"
                    ) from None
                except CancelledError:
                    raise SchedulerError(
                        f"--scheduler {self._address}: the scheduler has stopped or lost these pours"
                    ) from None
                except SchedulerError:
                    raise
                except Exception as error:
                    raise PourBrokeOff(job, error) from error
                yield job, record
        finally:
            self._client.cancel(list(asked))

    def close(self) -> None:
        """Leave the scheduler; its workers stay."""
        self._client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _poured(job: Job, room: Room, asked_by: Program, key: str) -> Record:
    """What a worker does; ``key``: the `pour_key` on the machine that asked for the pour."""
    from distributed import get_worker

    from solver.pours.run import run_job

    global _rooms
    worker = get_worker()
    if (own := Program.here()) != asked_by:
        raise SchedulerError(
            f"worker {worker.address}: has {own}, but the pours come from {asked_by}; install the same on both"
        )
    # Taichi belongs to the thread that started it, and a second one would pour no faster.
    if worker.state.nthreads != 1:
        raise SchedulerError(
            f"worker {worker.address}: has {worker.state.nthreads} threads; start it with --nthreads 1, and "
            "with --nworkers set to the number of pours at once"
        )
    try:
        same = pour_key(job.scene, job.seed) == key
    except OSError as error:
        raise SchedulerError(f"worker {worker.address}: {error.filename}: {error.strerror}") from None
    if not same:
        raise SchedulerError(f"worker {worker.address}: its version of a mesh file or plug-in differs from that here")
    if _rooms is None:
        _rooms = Rooms()
        _rooms.begin(room)
    else:
        _rooms.make(room)
    return run_job(_rooms.for_scene(job.scene), job)
