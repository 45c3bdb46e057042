"""Run many pours: a batch of worlds whose slots are refilled as pours finish."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver import backend
from solver.engine.state import Capacity
from solver.engine.tables import wall_tables
from solver.engine.world import Batch, compiled_in, wall_materials
from solver.machine import available_cores
from solver.params import ParameterError
from solver.pours.checkpoint import Checkpoint, resumed
from solver.pours.pour import Pour
from solver.pours.record import Record
from solver.scenes.scene import Scene, actual, body_counts, poured_mass

MOST_BODIES = 1_000_000
"""In one pour; more are due to a wrong unit."""
CONTACTS_PER_MEMBER = 16
"""Room in the contact list: entries per member sphere. A bed of long bodies holds 2–4."""

WORLDS_PER_THREAD = 4
"""Pours in flight per thread: enough to balance those in free flight against those with a packed pile."""


@dataclass(frozen=True)
class Job:
    """One pour to run."""

    scene: Scene
    seed: int
    tag: int = 0
    """A number of the caller's own, handed back with the record."""
    interrupted: Checkpoint | None = None
    """Go on from here instead of beginning."""

    def begin(self, batch: Batch, w: int) -> Pour:
        """The pour in world ``w``, ready to be driven."""
        if self.interrupted is not None:
            return resumed(batch, w, self.scene, self.interrupted)
        return Pour(batch, w, self.scene, self.seed)


def capacity_for(scenes: Sequence[Scene], worlds: int) -> Capacity:
    """Capacity of a batch for any of ``scenes``, which share a law: :func:`sizes_for` them, and what is compiled in."""
    return replace(sizes_for(scenes, worlds), **compiled_in([actual(scene) for scene in scenes]))


def sizes_for(scenes: Sequence[Scene], worlds: int) -> Capacity:
    """Sizes that hold any of ``scenes``, rounded up so that a small change of the mixture fits as well.

    Raises ParameterError for more than ``MOST_BODIES``.
    """
    scenes = [actual(scene) for scene in scenes]
    bodies = members = kinds = 0
    for scene in scenes:
        numbers = body_counts(scene)
        if sum(numbers) > MOST_BODIES:
            raise ParameterError(
                f"rig: {poured_mass(scene):g} kg is {sum(numbers)} bodies; allowed: up to {MOST_BODIES} in a pour; "
                "pour less mass or larger bodies"
            )
        bodies = max(bodies, sum(numbers))
        members = max(members, sum(n * len(b.clump.radii) for n, b in zip(numbers, scene.bodies, strict=True)))
        kinds = max(kinds, len(scene.bodies) + len(wall_materials(scene)))
    tables = [wall_tables(scene.rig.surfaces()) for scene in scenes]
    return Capacity(
        worlds=worlds,
        bodies=bodies,
        members=members,
        contacts=CONTACTS_PER_MEMBER * members,
        kinds=kinds,
        walls=max(8, *(len(table.poses) for table in tables)),
        surfaces=max(8, *(len(table.surfaces) for table in tables)),
        triangles=max(1, *(len(table.corners) for table in tables)),
        cells=max(1, *(len(table.first) for table in tables)),
        cell_items=max(1, *(len(table.items) for table in tables)),
    ).rounded()


def run_queue(
    queue: deque[Job],
    room: Sequence[Scene],
    threads: int | None = None,
    worlds: int | None = None,
    on_sample: Callable[[Job, Pour], None] | None = None,
) -> Iterator[tuple[Job, Record]]:
    """Run the jobs in ``queue`` and yield (job, record) as each finishes; jobs may be appended meanwhile.

    ``room`` lists scenes; every job has to fit into their sizes. ``worlds`` is the number of pours in flight (default:
    four per thread). ``on_sample`` is called with (job, pour) at every moment of decision. Equal jobs give equal bits,
    whatever else is in flight. Each contact law has a batch of its own.
    """
    backend.init(threads=threads)
    cores = threads or available_cores()
    slots = worlds or WORLDS_PER_THREAD * cores
    by_law = {law: [one for one in room if one.contact.law == law] for law in {one.contact.law: None for one in room}}
    batches = {law: Batch(capacity_for(scenes, slots)) for law, scenes in by_law.items()}
    running: dict[tuple[str, int], tuple[Job, Pour]] = {}
    # A thread works on a contiguous share of the worlds: fill the shares evenly.
    places = sorted(range(slots), key=lambda w: (w % max(1, slots // cores), w))
    while True:
        while queue and len(running) < slots:
            job = queue.popleft()
            law = job.scene.contact.law
            free = next((law, w) for w in places if (law, w) not in running)
            pour = job.begin(batches[law], free[1])
            if pour.steps_due() == 0:  # it was interrupted after its end
                yield job, pour.record()
                continue
            running[free] = (job, pour)
        if not running:
            return
        for law, batch in batches.items():
            due = [running[law, w][1].steps_due() if (law, w) in running else 0 for w in range(slots)]
            if not any(due):
                continue
            summary = batch.advance(np.array(due, dtype=np.int32))
            for w in [w for of, w in list(running) if of == law]:
                job, pour = running[law, w]
                if pour.after(due[w], summary[w]) and on_sample is not None:
                    on_sample(job, pour)
                if pour.steps_due() == 0:
                    del running[law, w]
                    yield job, pour.record()


def run_job(batch: Batch, job: Job, at_launch: Callable[[], None] = lambda: None) -> Record:
    """Run one job in world 0 of ``batch``, which nothing else uses meanwhile.

    ``at_launch`` is called before each launch.
    """
    pour = job.begin(batch, 0)
    steps = np.zeros(batch.capacity.worlds, dtype=np.int32)
    while (due := pour.steps_due()) > 0:
        at_launch()
        steps[0] = due
        pour.after(due, batch.advance(steps)[0])
    return pour.record()


def run_pours(
    jobs: Sequence[Job],
    threads: int | None = None,
    worlds: int | None = None,
    on_sample: Callable[[int, Pour], None] | None = None,
) -> Iterator[tuple[int, Record]]:
    """Run ``jobs`` and yield (index of the job, record) as each finishes (see :func:`run_queue`)."""
    if not jobs:
        return
    tagged = deque(replace(job, tag=k) for k, job in enumerate(jobs))
    slots = min(len(jobs), worlds or WORLDS_PER_THREAD * (threads or available_cores()))

    def sample(job: Job, pour: Pour) -> None:
        if on_sample is not None:
            on_sample(job.tag, pour)

    for job, record in run_queue(tagged, [job.scene for job in jobs], threads, slots, sample):
        yield job.tag, record


def run_pour(scene: Scene, seed: int, threads: int | None = None) -> Record:
    """Run one pour to its end."""
    return next(run_pours([Job(scene, seed)], threads=threads))[1]
