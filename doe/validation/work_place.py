"""Where pours are run: ordinary pours in a worker pool, pours with an outside effect in separate processes beside it.

Every pour is kept in the store, by scene, seed, physics and outside effect, so that nothing is poured twice.
"""

import math
import multiprocessing as mp
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.pool import Pool
from typing import Any, Protocol

from doe.declared.pour_end import Ended
from doe.measurement import Condition, readings_of_record
from doe.pour_runner import Pours, stored_run
from doe.store import Store
from doe.validation.laboratory import LaboratoryPour
from doe.validation.outside import OUTSIDE, OUTSIDE_EFFECTS, outside_pour
from solver import Executor, Job, Outcome, Record, Scene, begin_worker, executor, pour_key, unpacked


class OutOfTimeError(Exception):
    """The time limit is over; what has been poured is kept."""


@dataclass(frozen=True)
class PourOrder:
    """One pour that a laboratory asks for. ``outside``: name of an outside effect, or ""."""

    scene: Scene
    seed: int
    condition: Condition
    outside: str = ""

    @property
    def amount(self) -> float:
        """Strength of the outside effect, with the sign that it has in the rig's frame."""
        effect = OUTSIDE_EFFECTS[self.outside]
        return -effect.amount if self.condition.turned and effect.has_direction else effect.amount

    @property
    def variant(self) -> str:
        """Description of what the pour has beyond its scene; "" for an ordinary pour."""
        return f"{self.outside} {self.amount!r}, outside {OUTSIDE}" if self.outside else ""

    @property
    def key(self) -> str:
        """Its key in the store."""
        return pour_key(self.scene, self.seed, self.variant)

    def seen(self, record: Record) -> Record:
        """The record of the pour as the laboratory sees it."""
        seen = OUTSIDE_EFFECTS[self.outside].seen if self.outside else None
        return record if seen is None else seen(record, self.amount)

    def drawn(self, height: float) -> float:
        """Force [weights] by which a single body with its centre at ``height`` [m] is drawn to a plate."""
        return OUTSIDE_EFFECTS[self.outside].drawn(height, self.amount) if self.outside else 0.0

    def reader(self, record: Record) -> dict[str, float]:
        """Numbers that the laboratory reads off a pour as it sees it."""
        return {name: float(x) for name, x in readings_of_record(self.condition, record).items()}


class CampaignListener(Protocol):
    """Receiver of reports on the progress of a campaign."""

    def pour(self, part: str, left: int, ended: Ended) -> None:
        """A pour has ended; ``left`` more are to come in this part."""
        ...

    def judged(self, done: int, planned: int, judged_now: int, line: str) -> None:
        """``done`` of ``planned`` data sets are judged, ``judged_now`` of them by this run; ``line``: last answer."""
        ...

    def watched(self, pours: Pours) -> Pours:
        """A replacement for ``pours`` that sees every record."""
        ...


class WorkPlace:
    """Workers with a deadline [s] on ``time.monotonic``; a context manager that ends the workers.

    ``listener`` is told of every pour that ends.
    """

    def __init__(
        self,
        store: Store,
        workers: int,
        deadline: float = math.inf,
        scheduler: str = "",
        listener: CampaignListener | None = None,
    ) -> None:
        self.store, self.workers, self.deadline, self.scheduler = store, workers, deadline, scheduler
        self._listener = listener
        self.poured = 0
        self._stack = ExitStack()
        self._pool: Executor | None = None
        self._beside: Pool | None = None

    def __enter__(self) -> "WorkPlace":
        return self

    def __exit__(self, *error: Any) -> None:
        self._stack.__exit__(*error)

    @property
    def pool(self) -> Executor:
        """The worker pool, started when it is first needed."""
        if self._pool is None:
            self._pool = self._stack.enter_context(executor(self.workers, self.scheduler))
        return self._pool

    def pours(self, queue: deque[Job], room: Sequence[Scene]) -> Iterable[tuple[Job, Record]]:
        """Run the jobs of ``queue`` in the pool, and yield each with its record."""
        pours = self.pool.run_queue
        return (pours if self._listener is None else self._listener.watched(pours))(queue, room)

    def ended(self, what: str, left: int, pour: Ended) -> None:
        """Report a pour that has ended. Raises OutOfTimeError after the deadline."""
        if self._listener is not None:
            self._listener.pour(what, left, pour)
        self.look_at_the_clock()

    def look_at_the_clock(self) -> None:
        """Raise OutOfTimeError after the deadline."""
        if time.monotonic() > self.deadline:
            raise OutOfTimeError

    def pour(self, orders: Sequence[PourOrder], room: Sequence[Scene]) -> list[LaboratoryPour | None]:
        """The pours of ``orders``, in order, None for one that broke off. ``room``: scenes that nearly all fit into."""
        wanted = [order for order in {order.key: order for order in orders}.values() if not self._known(order)]
        plain = [order for order in wanted if not order.outside]
        queue = deque(Job(order.scene, order.seed, tag=k) for k, order in enumerate(plain))
        # A pair of effects may need more bodies than any single one.
        scenes = [*room, *(job.scene for job in queue)]
        left = len(wanted)
        for job, record in self.pours(queue, scenes) if queue else ():
            left -= 1
            self._keep(plain[job.tag], record, left)
        strange = [order for order in wanted if order.outside]
        tasks = [(order.outside, order.scene, order.seed, order.amount) for order in strange]
        for order, record in zip(strange, self.map(_outside, tasks), strict=True):
            left -= 1
            self._keep(order, record, left)
        return [self._sample(order) for order in orders]

    def map(self, function: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Any]:
        """Results of ``function`` for all ``tasks``, in order, computed in the processes beside the pool."""
        if not tasks:
            return
        if self._beside is None:
            self._beside = self._stack.enter_context(mp.get_context("spawn").Pool(self.workers, begin_worker))
        for result in self._beside.imap(function, tasks):
            yield result
            self.look_at_the_clock()

    def _known(self, order: PourOrder) -> bool:
        return self.store.find(order.key) is not None

    def _sample(self, order: PourOrder) -> LaboratoryPour | None:
        stored = self.store.find(order.key)
        assert stored is not None
        if not Outcome(stored.outcome).valid:
            return None
        # Read from the raw pour: the kept numbers may be those of a reader whose scale is right.
        record = order.seen(unpacked(stored.raw))
        spheres = record.pile.spheres
        return LaboratoryPour(order.reader(record), spheres.centre, spheres.radius)

    def _keep(self, order: PourOrder, record: Record, left: int) -> None:
        job = Job(order.scene, order.seed)
        stored = stored_run(
            job,
            record,
            "blind",
            order.condition.name,
            order.outside,
            lambda one: order.reader(order.seen(one)),
            order.key,
            order.variant,
        )
        self.store.add(stored)
        self.poured += 1
        label = " ".join(filter(None, (order.condition.name, order.outside)))
        self.ended("laboratory", left, Ended(label, order.seed, record.outcome, record.message, wall_s=record.wall_s))


def _outside(task: tuple[str, Scene, int, float]) -> Record:
    return outside_pour(*task)


def complete(samples: Iterable[LaboratoryPour | None]) -> list[LaboratoryPour]:
    """The pours that came to a valid end and of which every number could be read."""
    return [one for one in samples if one is not None and all(math.isfinite(x) for x in one.reading.values())]
