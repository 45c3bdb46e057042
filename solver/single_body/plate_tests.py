"""Tests of a single body on a plate of the rig's wall material: two apparent frictions and a restitution.

A body lies on the plate as it is declared, with z upward, held so that it can neither roll nor tip, and is pulled along
by a growing force, as on a sled (ASTM D1894):

    apparent static friction    F/(m g) where it begins to slide: μ_s (1 + F_a/(m g)) if its contacts adhere by F_a
    apparent kinetic friction   F/(m g) that keeps it sliding, from how it slows down
    restitution                 √(h₂/h₁) of a ball of its volume that falls by h₁ = ``DROP`` and rises by h₂

So adhesion, a friction that falls with speed, and the losses of impacts are each seen separately, where a pile shows
them together. The force grows by the factor e in ``RAMP`` steps, and sliding is noticed late: speed grows with the
square of the time since its onset, which is where √v, over the logarithm of the force, meets zero.
"""

from __future__ import annotations

import _thread
import dataclasses
import math
import multiprocessing as mp
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import cache
from multiprocessing.util import Finalize

import numpy as np

from solver.machine import available_cores
from solver.pours.pour_key import pour_key
from solver.pours.worker_pool import begin_worker, deaf_to_interrupts, script_left_alone
from solver.rigs.inclined_plane import InclinedPlane
from solver.scenes.body import Body
from solver.scenes.scene import Scene, actual
from solver.single_body.bench import UPRIGHT, Bench, held, onset_of
from solver.single_body.inclined_plane import rebound_height

DROP = 0.2
"""Height of the fall [m], that of Processes 2022, 10, 185, §2.5."""
SETTLING, RAMP, FAST, MOMENT = 3_000, 20_000, 2_000, 40
"""Numbers of steps: in which the body gets its weight, in which the pull grows by the factor e in the slow test and in
the quick one, and between two readings."""
WEAKEST, STRONGEST = 0.3, 1e4
"""Share of the declared friction at which the pull begins, and pull [weights] at which a body counts as immovable."""
MARGIN = 0.7
"""Share of the quick test's result at which the pull of the slow test begins."""
NOTHING = 1e-3
"""Friction below which nobody could measure it."""
LATE = 0.08
"""The onset is told once the body has slid for this share of the time in which the pull grows by e."""
SLIDES, SLOWER, LOOKS = 0.15, 0.05, 10
"""Speeds [m/s] between which a sliding body is watched, and number of readings between them."""
LONGEST = 1.0
"""Longest time for which a sliding body is watched [s]."""
MOST_WORKERS = 61
"""Windows cannot wait for more processes."""


@dataclass(frozen=True)
class PlateTest:
    """The test ``name`` of the component ``body`` of ``scene``, including its effects."""

    scene: Scene
    body: str
    name: str


def static_pull(scene: Scene, body: Body) -> float:
    """Apparent static friction, between ``NOTHING`` and ``STRONGEST``."""
    least = WEAKEST * scene.contact_pair(body, scene.rig.wall).static_friction
    rough = _onset(scene, body, least, FAST)
    return _onset(scene, body, MARGIN * rough, RAMP) if NOTHING < rough < STRONGEST else rough


def _onset(scene: Scene, body: Body, pull: float, ramp: int) -> float:
    """The pull [weights] that moves the body, growing by the factor e in ``ramp`` steps."""
    bench, g = _lying(scene, body)
    factor, path = math.exp(MOMENT / ramp), []
    while NOTHING < pull < STRONGEST:
        pull *= factor
        bench.batch.set_gravity(0, (g * pull, 0.0, -g))
        bench.run(MOMENT * bench.dt)
        path.append((math.log(pull), max(0.0, float(bench.state()[7]))))
        told = 0.5 * g * pull * ramp * bench.dt * LATE**2
        if path[-1][1] > told:
            return math.exp(onset_of(path, told))
    return max(NOTHING, min(STRONGEST, pull))


def kinetic_pull(scene: Scene, body: Body) -> float:
    """Apparent kinetic friction: deceleration over g between ``SLIDES`` and ``SLOWER``; ``NOTHING`` at least."""
    bench, g = _lying(scene, body)
    bench.batch.enter(0, 0, bench.state()[0:3], UPRIGHT, np.array([SLIDES, 0.0, 0.0]), np.zeros(3))
    bench.run(bench.dt)
    first = speed = float(bench.state()[7])
    time, step = 0.0, bench.dt
    while speed > SLOWER and time < LONGEST:
        bench.run(step)
        before, speed = speed, float(bench.state()[7])
        time += step
        lost = max(before - speed, 1e-9)
        step = bench.steps_of(min(10.0 * step, step * (SLIDES - SLOWER) / LOOKS / lost))
    return max(NOTHING, (first - speed) / (g * max(bench.dt, time)))


def restitution(scene: Scene, body: Body) -> float:
    """Restitution of a central impact; 0 for a ball that stays on the plate."""
    risen = rebound_height(scene, body, DROP)
    return math.sqrt(risen / DROP) if risen > 0.0 else 0.0


PLATE_TESTS: Mapping[str, Callable[[Scene, Body], float]] = {
    "apparent_static_friction": static_pull,
    "apparent_kinetic_friction": kinetic_pull,
    "restitution": restitution,
}


def _lying(scene: Scene, body: Body) -> tuple[Bench, float]:
    """``body`` at rest on the plate, and g."""
    bench, g = Bench(scene, scene.rig, held(body)), math.hypot(*scene.gravity)
    bench.lay()
    # Its weight is applied gradually: contacts with little damping would go on oscillating.
    for share in np.arange(1, SETTLING // MOMENT + 1) * (MOMENT / SETTLING):
        bench.batch.set_gravity(0, (0.0, 0.0, -g * share))
        bench.run(MOMENT * bench.dt)
    return bench, g


def plate_test(asked: PlateTest) -> float:
    """The number of one test, run in this process."""
    scene = actual(asked.scene)
    body = next(one for one in scene.bodies if one.name == asked.body)
    plate = InclinedPlane(body=body.name, wall=scene.rig.wall)
    return PLATE_TESTS[asked.name](dataclasses.replace(scene, rig=plate), body)


_KNOWN: dict[tuple[str, str, str], float] = {}
"""Results so far, by the key of the scene, body and test."""
_ONE_AT_A_TIME = threading.Lock()


def plate_tests(asked: Sequence[PlateTest]) -> list[float]:
    """Results of the tests, run in processes of their own; tests of equal scenes are run only once.

    The processes stay for the next tests, since starting one and tracing its kernels takes as long as fifty tests.

    Raises BrokenProcessPool if a process was killed and another in its place as well.
    """
    keys = [(pour_key(one.scene, 0), one.body, one.name) for one in asked]
    with _ONE_AT_A_TIME:
        fresh = {key: one for key, one in zip(keys, asked, strict=True) if key not in _KNOWN}
        if fresh:
            try:
                results = _run(list(fresh.values()))
            except BrokenProcessPool:  # perhaps it was killed long ago, while it waited
                results = _run(list(fresh.values()))
            _KNOWN.update(zip(fresh, results, strict=True))
        return [_KNOWN[key] for key in keys]


def _run(tests: Sequence[PlateTest]) -> list[float]:
    workers = _workers()
    try:
        with deaf_to_interrupts(), script_left_alone():
            results = workers.map(plate_test, tests)
        return list(results)
    except BaseException:
        # What still runs is of no use; the next tests begin with new processes.
        _workers.cache_clear()
        processes = list((workers._processes or {}).values())
        workers.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.kill()
        raise


@cache
def _workers() -> ProcessPoolExecutor:
    workers = ProcessPoolExecutor(min(available_cores(), MOST_WORKERS), mp.get_context("spawn"), _begin_worker)
    # A process that is itself a child waits for its children before it ends threads, and would wait for these for ever.
    Finalize(None, workers.shutdown, exitpriority=100)
    return workers


def _begin_worker() -> None:
    begin_worker()
    # Not as a `threading.Thread`: kernels are kept by a process with one of these only.
    _thread.start_new_thread(_end_with_parent, ())


def _end_with_parent() -> None:
    """End this process with the one in charge, even if that is killed: nothing else would tell it."""
    in_charge = mp.parent_process()
    assert in_charge is not None
    in_charge.join()
    os._exit(1)
