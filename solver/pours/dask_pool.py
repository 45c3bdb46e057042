"""Pours on the workers of a Dask scheduler: the cores of many machines, the same bits.

A task is one pour, in one world and one thread, as in :class:`solver.pours.worker_pool.WorkerPool`; Dask hands out
tasks, sends results back as they finish, and gives those of a worker that died to another. Workers may come and go.
Each needs this program in the same version and one thread: ``dask worker tcp://… --nthreads 1 --nworkers CORES``.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any, Self

from solver.pours.worker_pool import PourBrokeOff, Rooms, WorkerLost
from solver.scenes.scene import Scene
from solver.version import PHYSICS

if TYPE_CHECKING:
    from solver.pours.record import Record
    from solver.pours.run import Job

CONNECTED = 10.0
"""[s] in which a scheduler has to answer."""
_one_at_a_time = threading.Lock()
_rooms = Rooms()
_made_for: Sequence[Scene] | None = None
"""The scenes for which a worker has made room: Dask hands the same object to every task of a queue."""


class SchedulerError(ValueError):
    """The scheduler cannot be used, or a worker must not be; the message is one line, fit for a user."""


@dataclass(frozen=True)
class Program:
    """What both sides have to have alike."""

    version: str
    physics: int

    @staticmethod
    def here() -> Program:
        """That of this process."""
        try:
            return Program(version("repose-explorer"), PHYSICS)
        except PackageNotFoundError:
            return Program("source tree", PHYSICS)

    def __str__(self) -> str:
        return f"version {self.version}, physics {self.physics}"


class DaskPool:
    """The workers of the scheduler at ``address``, e.g. ``tcp://127.0.0.1:8786``; used as a WorkerPool is.

    Raises SchedulerError where Dask is not installed or nobody answers there.
    """

    def __init__(self, address: str) -> None:
        try:
            from distributed import Client
        except ImportError:
            raise SchedulerError(
                f"--scheduler {address}: Dask is not installed; pip install 'repose-explorer[dask]'"
            ) from None
        try:
            self._client = Client(address, timeout=CONNECTED, set_as_default=False)
        except (OSError, ValueError) as error:
            raise SchedulerError(f"--scheduler {address}: no Dask scheduler answers there ({error})") from None

    def run_queue(self, queue: deque[Job], room: Sequence[Scene]) -> Iterator[tuple[Job, Record]]:
        """Run the jobs in ``queue`` and yield (job, record) as each finishes; jobs may be appended meanwhile.

        ``room`` lists scenes that any job has to fit into. Raises PourBrokeOff with a worker's error, WorkerLost where
        workers died over the same pour again and again, SchedulerError for a worker of another version.
        """
        from distributed import as_completed
        from distributed.scheduler import KilledWorker

        needed = self._client.scatter(tuple(room), broadcast=True, hash=False)
        here = Program.here()
        finished = as_completed(loop=self._client.loop)
        asked: dict[Any, Job] = {}
        try:
            while queue or asked:
                while queue:
                    job = queue.popleft()
                    future = self._client.submit(_poured, job, needed, here, pure=False)
                    asked[future] = job
                    finished.add(future)
                future = next(finished)
                job = asked.pop(future)
                error = future.exception()
                if isinstance(error, KilledWorker):
                    raise WorkerLost(f"workers have ended over the same pour, seed {job.seed} of {job.scene.title!r}")
                if isinstance(error, SchedulerError):
                    raise error
                if error is not None:
                    raise PourBrokeOff(job, error) from error
                yield job, future.result()
        finally:
            self._client.cancel(list(asked))

    def close(self) -> None:
        """Leave the scheduler; its workers stay."""
        self._client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _poured(job: Job, room: Sequence[Scene], asked_by: Program) -> Record:
    """What a worker does."""
    from distributed import get_worker

    from solver.pours.run import run_job

    global _made_for
    if Program.here() != asked_by:
        raise SchedulerError(
            f"worker {get_worker().address}: has {Program.here()}, and pours are asked for by {asked_by}; install the "
            "same on both"
        )
    # Taichi is one to a process; a worker of several threads pours no faster than one of a single thread.
    with _one_at_a_time:
        if room is not _made_for:
            (_rooms.begin if _made_for is None else _rooms.make)(room)
            _made_for = room
        return run_job(_rooms.for_scene(job.scene), job)
