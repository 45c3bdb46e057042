"""Worker processes that run pours side by side: one thread and one world each, so that none waits for another.

In one process all worlds wait at the end of a launch for the slowest, and while Python feeds and samples one world the
other cores are idle: two threads of :func:`solver.pours.run.run_queue` do the work of 1.5, two workers that of 2. The
bits are the same. If several workers need kernels that have not been compiled yet, one compiles them and the others
wait. A worker ends with its pipe: at :meth:`WorkerPool.close`, or when the process that made it is gone. A worker that
is killed, by a user or for memory, is replaced, and its pour is begun again.
"""

from __future__ import annotations

import logging
import multiprocessing as mp
import signal
import sys
import threading
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from time import perf_counter
from types import ModuleType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from solver.machine import available_cores
from solver.params import ParameterError
from solver.scenes.scene import Scene

if TYPE_CHECKING:
    from solver.engine.state import Capacity
    from solver.engine.world import Batch
    from solver.pours.record import Record
    from solver.pours.run import Job

MOMENTS = 3
"""Moments of decision of a pour after which its kernels are compiled."""
GONE = "a worker process has ended before its work was done"
LOSSES = 3
"""Number of workers lost on one pour after which it is given up: a fourth would be lost, too."""


_log = logging.getLogger(__name__)


class WorkerLost(RuntimeError):
    """A worker process has ended before its work was done."""


class PourBrokeOff(RuntimeError):
    """A pour ended by an error of the program; ``job`` reproduces it."""

    def __init__(self, job: Job, error: BaseException) -> None:
        super().__init__(f"a pour broke off: {error!r}; seed {job.seed} of {job.scene.title!r}")
        self.job = job


class WorkerPool:
    """Processes that are started when they are first needed and kept for the next queue.

    ``workers``: how many; None: one per core. Raises ParameterError for less than one.
    """

    def __init__(self, workers: int | None = None) -> None:
        if workers is not None and (not isinstance(workers, int | np.integer) or workers < 1):
            raise ParameterError(f"workers {workers}: allowed: a whole number of at least 1")
        self.workers = workers or available_cores()
        """Number of processes that pour at the same time."""
        self._processes: list[tuple[BaseProcess, Connection]] = []

    def run_queue(self, queue: deque[Job], room: Sequence[Scene]) -> Iterator[tuple[Job, Record]]:
        """Run the jobs in ``queue`` and yield (job, record) as each finishes; jobs may be appended meanwhile.

        ``room`` lists scenes; every job has to fit into their sizes. Raises PourBrokeOff with a worker's error, and
        WorkerLost if ``LOSSES`` workers ended on the same job.
        """
        self._processes += [_worker() for _ in range(self.workers - len(self._processes))]
        needed = Room.of(room)
        idle = [self._with_room(pipe, needed) for _, pipe in self._processes]
        busy: dict[Connection, Job] = {}
        losses: Counter[int] = Counter()

        def replaced(pipe: Connection, job: Job) -> Connection:
            losses[id(job)] += 1
            if losses[id(job)] == LOSSES:
                raise WorkerLost(
                    f"{LOSSES} worker processes died on the same pour, seed {job.seed} of {job.scene.title!r}: "
                    "killed from outside or out of memory"
                )
            again = f"the pour with seed {job.seed} of {job.scene.title!r} is restarted on another worker"
            _log.warning("a worker process has ended (%d of %d losses): %s", losses[id(job)], LOSSES, again)
            queue.appendleft(job)
            return self._with_room(self._another(pipe), needed)

        try:
            while queue or busy:
                while queue and idle:
                    pipe, job = idle.pop(0), queue.popleft()
                    if _sent(pipe, job):
                        busy[pipe] = job
                    else:
                        idle.append(replaced(pipe, job))
                for pipe in [ready for ready in wait(list(busy)) if isinstance(ready, Connection)]:
                    job = busy.pop(pipe)
                    try:
                        record = _answer(pipe)
                    except WorkerLost:
                        idle.append(replaced(pipe, job))
                        continue
                    if isinstance(record, BaseException):
                        raise PourBrokeOff(job, record) from record
                    idle.append(pipe)
                    losses.pop(id(job), None)  # a job that is appended later may get the number of this one
                    yield job, record
        finally:
            if busy:  # the caller left before the end: what still runs is of no use
                self.close(at_once=True)

    def _with_room(self, pipe: Connection, room: Room) -> Connection:
        """``pipe``, or that of another worker if its own has ended, after sending the ``room`` that it must have.

        Raises WorkerLost if the other worker has ended, too.
        """
        if _sent(pipe, room):
            return pipe
        another = self._another(pipe)
        _send(another, room)
        return another

    def _another(self, lost: Connection) -> Connection:
        """Start a worker in the place of one that has ended."""
        place = [pipe for _, pipe in self._processes].index(lost)
        self._processes[place][0].join()
        lost.close()
        self._processes[place] = _worker()
        return self._processes[place][1]

    def close(self, at_once: bool = False) -> None:
        """End the workers; ``at_once`` also those that are in the middle of a pour."""
        for process, pipe in self._processes:
            pipe.close()
            if at_once:
                process.kill()
            process.join()
        self._processes = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close(at_once=error[0] is not None)


def warm_up(rooms: Sequence[Sequence[Scene]], workers: int | None = None) -> Iterator[tuple[int, float | None]]:
    """Have the kernels compiled and kept that a pool needs for the scenes of each room.

    Args:
        rooms: scenes that are to be run by one pool, as in :meth:`WorkerPool.run_queue`.
        workers: processes at once, by default one per core.

    Yields:
        (number of the room, seconds that it took) as each is done; None for kernels that were kept already, or by
        another room.

    Raises:
        RuntimeError: a worker's error, or one died.
    """
    from solver.pours.kernel_cache import missing

    needed = [Room.of(scenes) for scenes in rooms]
    alike: dict[tuple[Capacity, ...], list[int]] = {}
    for k, room in enumerate(needed):
        alike.setdefault(tuple(Rooms().make(room)), []).append(k)
    waiting, most = deque(alike.items()), workers or available_cores()
    busy: dict[Connection, tuple[list[int], BaseProcess, float]] = {}
    try:
        while waiting or busy:
            while waiting and len(busy) < most:
                sizes, numbers = waiting.popleft()
                if not missing(sizes):
                    yield from ((k, None) for k in numbers)
                    continue
                # A process for each: kernels depend on what was allocated before.
                process, pipe = _worker()
                busy[pipe] = numbers, process, perf_counter()
                _send(pipe, needed[numbers[0]])
                _send(pipe, None)
            for pipe in [ready for ready in wait(list(busy)) if isinstance(ready, Connection)] if busy else []:
                if isinstance(error := _answer(pipe), BaseException):
                    raise RuntimeError(f"the kernels could not be compiled: {error!r}") from error
                numbers, process, began = busy.pop(pipe)
                pipe.close()
                process.join()
                yield numbers[0], perf_counter() - began
                yield from ((k, None) for k in numbers[1:])
    finally:
        for pipe, (_, process, _) in busy.items():
            process.kill()
            pipe.close()
            process.join()


def _worker() -> tuple[BaseProcess, Connection]:
    ours, theirs = mp.Pipe()
    process = mp.get_context("spawn").Process(target=_work, args=(theirs,), name="pours")
    with deaf_to_interrupts(), script_left_alone():
        process.start()
    theirs.close()
    return process, ours


def _sent(pipe: Connection, order: Any) -> bool:
    """Send ``order``; False if the worker has ended."""
    try:
        pipe.send(order)
    except OSError:
        return False
    return True


def _send(pipe: Connection, order: Any) -> None:
    if not _sent(pipe, order):
        raise WorkerLost(GONE)


def _answer(pipe: Connection) -> Any:
    """What a worker sends: a record, None, or the error that it met."""
    try:
        return pipe.recv()
    except (EOFError, OSError):
        raise WorkerLost(GONE) from None


@contextmanager
def deaf_to_interrupts() -> Iterator[None]:
    """Processes that are started in the with block ignore Ctrl-C from their first moment on.

    Ctrl-C reaches the whole process group. A process can ignore it by itself only once it has imported what it runs,
    and until then would print a traceback.
    """
    if sys.platform == "win32":
        yield
        return
    # The tracker would otherwise start with the first process, and that lets Ctrl-C through again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def script_left_alone() -> Iterator[None]:
    """Processes that are spawned in the with block do not import the running script, as multiprocessing makes them do.

    The script would run again in each of them, unless its author guards it by ``if __name__ == "__main__"``.
    """
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


def begin_worker() -> None:
    """Make this a worker process: one CPU thread, and Ctrl-C left to the process in charge."""
    # Ctrl-C reaches the whole group; the process in charge decides, and its end closes the pipe. Only a program's first
    # thread may set this, and only that thread is interrupted.
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    from solver import backend

    backend.init(threads=1)


def _work(pipe: Connection) -> None:
    """Run what comes through ``pipe``: a room is made, a job is answered by its record.

    None is answered by None: what came before is done.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # at once: the imports that follow take a second
    from solver.pours.run import run_job

    rooms, begun = Rooms(), False
    while True:
        try:
            order = pipe.recv()
        except EOFError:
            return
        try:
            if isinstance(order, Room):
                (rooms.make if begun else rooms.begin)(order)
                begun = True
                continue
            answer: Any = None if order is None else run_job(rooms.for_scene(order.scene), order, _end_with_parent)
        except Exception as error:  # whatever it is, the process in charge has to know
            answer = error
        try:
            pipe.send(answer)
        except BrokenPipeError:
            return


def _end_with_parent() -> None:
    """End this process if the one in charge was killed: nobody waits for its pour, which may take hours more."""
    in_charge = mp.parent_process()
    if in_charge is not None and not in_charge.is_alive():
        raise SystemExit


@dataclass(frozen=True)
class Room:
    """The room that a worker must have: as much as many scenes need, described in a few kilobytes."""

    sizes: Capacity
    """Sizes of one world that holds any of the scenes."""
    kinds: tuple[Scene, ...]
    """A scene for each kind of kernels, by what is compiled in."""

    @staticmethod
    def of(scenes: Sequence[Scene]) -> Room:
        """The room for ``scenes``."""
        from solver.engine.world import compiled_in
        from solver.pours.run import sizes_for

        kinds = {tuple(compiled_in([scene]).values()): scene for scene in scenes}
        return Room(sizes_for(scenes, 1), tuple(kinds.values()))


class Rooms:
    """A worker's batches of one world: a scene without effects runs in one that has none compiled in (0.8 of the time).

    They are kept as long as they are large enough, since another size would compile anew.
    """

    def __init__(self) -> None:
        self._capacity: Capacity | None = None
        self._batches: dict[tuple[str, bool, bool], Batch] = {}

    def make(self, room: Room) -> list[Capacity]:
        """Make ``room``, and keep what is there; returns the sizes of its batches."""
        self._capacity = room.sizes if self._capacity is None else self._capacity.joined(room.sizes)
        # Without effects first: kernels depend on what was allocated before.
        return sorted(
            {self._size(scene) for scene in room.kinds}, key=lambda size: (size.law, size.effects, size.sharing)
        )

    def begin(self, room: Room) -> None:
        """Make ``room`` and start Taichi, with kernels that this process or another one compiles."""
        from solver.pours.kernel_cache import compiled_once

        sizes = self.make(room)
        examples = {self._size(scene): scene for scene in room.kinds}
        with compiled_once(sizes) as mine:
            begin_worker()
            for size in sizes:
                batch = self.for_scene(examples[size])
                if size in mine:
                    _pour_for_a_moment(batch, examples[size])

    def for_scene(self, scene: Scene) -> Batch:
        """The batch for ``scene``."""
        from solver.engine.world import Batch

        wanted = self._size(scene)
        variant = (wanted.law, wanted.effects, wanted.sharing)
        if variant not in self._batches or self._batches[variant].capacity != wanted:
            self._batches[variant] = Batch(wanted)
        return self._batches[variant]

    def _size(self, scene: Scene) -> Capacity:
        from solver.engine.world import compiled_in

        assert self._capacity is not None, "room is made before the first job"
        return replace(self._capacity, **compiled_in([scene]))


def _pour_for_a_moment(batch: Batch, scene: Scene) -> None:
    """Compile the kernels of a pour, all but a few small ones that its later moments need."""
    from solver.pours.pour import Pour

    pour = Pour(batch, 0, scene, seed=1)
    for _ in range(MOMENTS):
        if due := pour.steps_due():
            pour.after(due, batch.advance(np.array([due], dtype=np.int32))[0])
    pour.bodies()
