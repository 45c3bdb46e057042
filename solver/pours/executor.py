"""Where pours run: one protocol for worker processes on this machine and for the workers of a Dask scheduler."""

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
"""Address of a scheduler, with the protocols that Dask itself uses between machines."""


class SchedulerError(ValueError):
    """The scheduler cannot be used, or a worker must not be used; the message is one line, fit for a user."""


class Executor(Protocol):
    """Runs pours somewhere. Equal job → equal bits, wherever it runs and whatever runs beside it."""

    def run_queue(self, queue: deque[Job], room: Sequence[Scene]) -> Iterator[tuple[Job, Record]]:
        """Run the jobs in ``queue`` and yield (job, record) as each finishes; jobs may be appended meanwhile.

        ``room`` lists scenes; every job has to fit into their sizes. Raises PourBrokeOff with the error of a pour.
        """
        ...

    def close(self) -> None:
        """End the processes and connections that were started for it."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...


def check_scheduler(address: str, threads: int | None = None) -> None:
    """Refuse an invalid ``address``, and options that do not go with a scheduler; "" means no scheduler, and is fine.

    Whether anybody answers there is known only once :func:`executor` has asked.

    Parameters
    ----------
    address
        PROTOCOL://HOST:PORT, such as "tcp://127.0.0.1:8786".
    threads
        Number of processes on this machine, if one was given as well.

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
    """``workers`` processes on this machine (None: one per core), or those of the Dask ``scheduler`` ("tcp://…").

    Raises SchedulerError if the address is invalid, nobody answers there, or Dask is not installed; ParameterError for
    less than one worker.
    """
    if scheduler:
        from solver.pours.dask_pool import DaskPool

        check_scheduler(scheduler)
        return DaskPool(scheduler)
    from solver.pours.worker_pool import WorkerPool

    return WorkerPool(workers)
