"""Where pours run: one protocol, with worker processes of this machine, or the workers of a Dask scheduler."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Protocol, Self

from solver.arch import chosen
from solver.scenes.scene import Scene

if TYPE_CHECKING:
    from solver.pours.record import Record
    from solver.pours.run import Job

ADDRESS = re.compile(r"(tcp|tls|ws|wss)://([\w.-]+|\[[\da-fA-F:.]+\]):(?P<port>\d{1,5})")
"""Of a scheduler, by the protocols that Dask itself has between machines."""


class SchedulerError(ValueError):
    """The scheduler cannot be used, or a worker must not be; the message is one line, fit for a user."""


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


def check_scheduler(address: str, threads: int | None = None) -> None:
    """Refuse an ``address`` that is none, and what cannot be had with a scheduler; "" is no scheduler, and fine.

    Whether anybody answers there is known once :func:`executor` has asked.

    Parameters
    ----------
    address
        PROTOCOL://HOST:PORT, such as "tcp://127.0.0.1:8786".
    threads
        Processes of this machine that were asked for beside it.

    Raises
    ------
    SchedulerError
        The address has another form, the solver is to run on a graphics processor, or ``threads`` are given.
    """
    if not address:
        return
    found = ADDRESS.fullmatch(address)
    if found is None or not 0 < int(found["port"]) < 65536:
        raise SchedulerError(f"--scheduler {address}: allowed: tcp://HOST:PORT, or tls, ws, wss in place of tcp")
    if chosen() != "cpu":
        raise SchedulerError(f"--scheduler {address}: its workers pour on processor cores, not by --arch {chosen()}")
    if threads is not None:
        raise SchedulerError(
            f"--threads {threads}: is for pours on this machine; with --scheduler {address} its workers say how many"
        )


def executor(workers: int | None = None, scheduler: str = "") -> Executor:
    """``workers`` processes of this machine (None: one per core), or those of the Dask ``scheduler`` ("tcp://…").

    Raises SchedulerError where that is no address, nobody answers there, or Dask is not installed, ParameterError for
    less than one worker.
    """
    if scheduler:
        from solver.pours.dask_pool import DaskPool

        check_scheduler(scheduler)
        return DaskPool(scheduler)
    from solver.pours.worker_pool import WorkerPool

    return WorkerPool(workers)
