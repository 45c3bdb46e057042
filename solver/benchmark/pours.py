"""Pours against the clock: one world step by step, and many worlds on several cores."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence

import numpy as np

from solver import backend
from solver.benchmark.measurement import Measurement
from solver.crew import Crew
from solver.pour import Pour
from solver.record import Outcome
from solver.run import Job, capacity_for
from solver.scene import Scene, with_values
from solver.world import SUMMARY_COLUMNS, Batch

WARM_UP = {"numerics.max_time": 0.1}
"""A run as short as the declared range allows compiles every kernel."""


def measure_pour(
    case: str, scene: Scene, seed: int, duration: float | None, sleeping: bool, times: int = 1
) -> Measurement:
    """One pour on one thread, ``times`` over; steps, wall time and simulated time are those of all together.

    Parameters
    ----------
    case
        Name of the case.
    scene, seed
        What is poured.
    duration
        Simulated time of a pour [s]; it goes on when the pile is at rest, as other engines' runs do. None: to rest.
    sleeping
        Whether bodies may fall asleep.
    times
        How often the pour is run: a short one is over before the clock tells much.

    Raises
    ------
    RuntimeError
        A pour ended otherwise than at rest, jammed, or at its time limit.
    """
    backend.init(threads=1)
    values: dict[str, float] = {} if sleeping else {"numerics.sleep_speed": 0.0}
    if duration is not None:
        # A rest time beyond the end: nothing but the clock stops the run.
        values |= {"numerics.max_time": duration, "numerics.rest_time": 5.0}
    scene = with_values(scene, values)
    batch = Batch(capacity_for([scene], 1))
    _drive(batch, Pour(batch, 0, with_values(scene, WARM_UP), seed))
    wall, steps, simulated = 0.0, 0, 0.0
    for _ in range(times):
        pour = Pour(batch, 0, scene, seed)
        begin = time.perf_counter()
        contacts = _drive(batch, pour)
        wall += time.perf_counter() - begin
        if pour.ended[0] not in (Outcome.AT_REST, Outcome.TIME_LIMIT, Outcome.JAMMED, Outcome.OBSTRUCTED):
            raise RuntimeError(f"{case}: the pour ended with {pour.outcome}: {pour.message}")
        steps, simulated = steps + pour.steps, simulated + pour.time
    spheres = sum(len(scene.bodies[k].clump.radii) for k in pour.supply.order)
    name, touching = "ours" if sleeping else "ours, nothing sleeps", float(np.mean(contacts))
    return Measurement(case, name, len(pour.supply.order), spheres, steps, wall, simulated, contacts[-1], touching)


def measure_batch(case: str, scene: Scene, seeds: Sequence[int], workers: int) -> Measurement:
    """Pours of ``seeds`` to rest by a crew of ``workers``, as studies run them; steps are those of all together."""
    with Crew(workers) as crew:
        list(crew.run_queue(deque(Job(with_values(scene, WARM_UP), seed) for seed in seeds), [scene]))
        begin = time.perf_counter()
        records = [record for _, record in crew.run_queue(deque(Job(scene, seed) for seed in seeds), [scene])]
        wall = time.perf_counter() - begin
    steps = sum(record.steps for record in records)
    bodies = max(len(record.bodies.mass) for record in records)
    spheres = max(len(record.spheres.radius) for record in records)
    simulated = sum(record.steps * record.dt for record in records)
    name = f"{len(seeds)} pours, {workers} worker{'s' if workers > 1 else ''}"
    return Measurement(case, name, bodies, spheres, steps, wall, simulated, float("nan"), float("nan"))


def _drive(batch: Batch, pour: Pour) -> list[float]:
    """Run ``pour`` to its end; touching contacts at its moments of decision."""
    touching = SUMMARY_COLUMNS.index("touching")
    contacts = [0.0]
    while steps := pour.steps_due():
        row = batch.advance(np.array([steps], dtype=np.int32))[0]
        contacts.append(float(row[touching]))
        pour.after(steps, row)
    return contacts
