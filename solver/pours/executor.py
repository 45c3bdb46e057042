"""Where pours run: one protocol, with worker processes of this machine, or the workers of a Dask scheduler."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Protocol, Self

from solver.scenes.scene import Scene

if TYPE_CHECKING:
    from solver.pours.record import Record
    from solver.pours.run import Job


class Executor(Protocol):
    """Runs pours somewhere. Equal job → equal bits, wherever it runs and whatever runs beside it."""

    def run_queue(self, queue: deque[Job], room: Sequence[Scene]) -> Iterator[tuple[Job, Record]]:
        """Run the jobs in ``queue`` and yield (job, record) as each finishes; jobs may be appended meanwhile.

        ``room`` lists scenes that any job has to fit into. Raises PourBrokeOff with the error of a pour.
        """
        ...

    def close(self) -> None:
        """End what was started for it."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...


def executor(workers: int | None = None, scheduler: str = "") -> Executor:
    """``workers`` processes of this machine (None: one per core), or those of the Dask ``scheduler`` ("tcp://…")."""
    if scheduler:
        from solver.pours.dask_pool import DaskPool

        return DaskPool(scheduler)
    from solver.pours.worker_pool import WorkerPool

    return WorkerPool(workers)
