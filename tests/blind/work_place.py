"""Where the work is done: pours in a crew, pours with an outside effect and verdicts in processes beside it.

Every pour is kept in the store, by scene, seed, code version and outside effect, so that nothing is poured twice.
"""

import math
import multiprocessing as mp
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.pool import Pool
from typing import Any

from doe.measurement import Condition, readings_of_record
from doe.store import Store, StoredRun, run_key
from solver import Crew, Job, Outcome, Record, Scene, code_version
from tests.blind.laboratory import OBSERVABLES, Reading
from tests.blind.outside import AMPLITUDE, outside_pour


class OutOfTimeError(Exception):
    """The time that was given is over; what has been poured is kept."""


@dataclass(frozen=True)
class Order:
    """One pour that a laboratory asks for. ``outside``: name of an outside effect, or none."""

    scene: Scene
    seed: int
    condition: Condition
    outside: str = ""

    @property
    def key(self) -> str:
        """Its key in the store."""
        code = f"{code_version()} {self.outside} {AMPLITUDE[self.outside]:g}" if self.outside else code_version()
        return run_key(self.scene, self.seed, code)


class WorkPlace:
    """Workers and a deadline [s] on ``time.monotonic``; a context that ends the workers."""

    def __init__(self, store: Store, workers: int, deadline: float = math.inf) -> None:
        self.store, self.workers, self.deadline = store, workers, deadline
        self.poured = 0
        self._stack = ExitStack()
        self._crew: Crew | None = None
        self._pool: Pool | None = None

    def __enter__(self) -> "WorkPlace":
        return self

    def __exit__(self, *error: Any) -> None:
        self._stack.__exit__(*error)

    @property
    def crew(self) -> Crew:
        """The crew, started when it is first needed."""
        if self._crew is None:
            self._crew = self._stack.enter_context(Crew(self.workers))
        return self._crew

    def look_at_the_clock(self, *_: Any) -> None:
        """Raise OutOfTimeError after the deadline."""
        if time.monotonic() > self.deadline:
            raise OutOfTimeError

    def pour(self, orders: Sequence[Order], room: Sequence[Scene]) -> list[Reading | None]:
        """Readings of the pours in order, None for one that broke off. ``room``: scenes that nearly all fit into."""
        wanted = [order for order in {order.key: order for order in orders}.values() if not self._known(order)]
        plain = [order for order in wanted if not order.outside]
        queue = deque(Job(order.scene, order.seed, tag=k) for k, order in enumerate(plain))
        # A pair of effects may need more bodies than any single one.
        scenes = [*room, *(job.scene for job in queue)]
        for job, record in self.crew.run_queue(queue, scenes) if queue else ():
            self._keep(plain[job.tag], record)
        strange = [order for order in wanted if order.outside]
        tasks = [(order.outside, order.scene, order.seed, AMPLITUDE[order.outside]) for order in strange]
        for order, record in zip(strange, self.map(_outside, tasks), strict=True):
            self._keep(order, record)
        return [self._reading(order) for order in orders]

    def map(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Any]:
        """``function`` of every task, in order, in the processes beside the crew."""
        if not tasks:
            return
        if self._pool is None:
            self._pool = self._stack.enter_context(mp.get_context("spawn").Pool(self.workers, _begin))
        for result in self._pool.imap(function, tasks):
            yield result
            self.look_at_the_clock()

    def _known(self, order: Order) -> bool:
        stored = self.store.find(order.key)
        return stored is not None and set(OBSERVABLES) <= set(stored.observables)

    def _reading(self, order: Order) -> Reading | None:
        stored = self.store.find(order.key)
        assert stored is not None
        if not Outcome(stored.outcome).valid:
            return None
        return {name: math.nan if x is None else x for name, x in stored.observables.items()}

    def _keep(self, order: Order, record: Record) -> None:
        readings = readings_of_record(order.condition, record)
        self.store.add(
            StoredRun(
                key=order.key,
                study="blind",
                stage=order.condition.name,
                label=order.outside,
                seed=order.seed,
                code_version=code_version(),
                outcome=str(record.outcome),
                message=record.message,
                parameters={},
                observables={n: float(x) if math.isfinite(x) else None for n, x in readings.items()},
                dt=record.dt,
                steps=record.steps,
                wall_s=record.wall_s,
            )
        )
        self.poured += 1
        self.look_at_the_clock()


def _begin() -> None:
    """A process beside the crew: one thread, and Ctrl-C is for the process in charge."""
    import signal

    from solver import backend

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    backend.init(threads=1)


def _outside(task: tuple[str, Scene, int, float]) -> Record:
    return outside_pour(*task)


def complete(readings: Iterable[Reading | None]) -> list[Reading]:
    """Pours that came to their end and of which everything could be read."""
    return [one for one in readings if one is not None and all(math.isfinite(x) for x in one.values())]
