"""Benchmark cases, ours and the peers' one after the other in one run, each in a process of its own."""

from __future__ import annotations

import math
import multiprocessing
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from explorer.export import bed as peer_bed
from explorer.export.deck_of_scene import deck_of
from explorer.export.decks import WRITERS
from explorer.export.run import PeerRun, run_liggghts, run_yade
from explorer.scene.file import load_scene
from solver.benchmark import Bed, Measurement, measure_batch, measure_bed, measure_pour, wide_bed
from solver.benchmark.packed_bed import RADIUS, bed_name, bed_scene
from solver.time_step import time_step

POUR = "seed_pour"
"""The shipped set-up on which engines are compared."""
SEED = 1
BEDS = {1_000: (1, 1), 10_000: (2, 5), 100_000: (10, 10)}
"""Number of spheres → copies of the small bed along x and y."""
SPHERE_STEPS = {"ours": 2e7, "liggghts": 2e7, "yade": 4e6}
"""Length of a bed's run: some seconds for each engine."""
BATCH_POURS = 32
PEERS: dict[str, Callable[[Path], PeerRun]] = {"liggghts": run_liggghts, "yade": run_yade}


@dataclass(frozen=True)
class Options:
    """What to measure."""

    duration: float
    """Simulated time of the pour [s]."""
    beds: tuple[int, ...]
    peers: tuple[str, ...]


def pour_cases(options: Options) -> Iterator[Measurement]:
    """The seed pour: ours to rest, ours and the peers' for the same simulated time at the same time step."""
    scene = load_scene(POUR)
    yield apart(measure_pour, "pour to rest", scene, SEED, None, True)
    case = f"pour, {options.duration:g} s"
    yield apart(measure_pour, case, scene, SEED, options.duration, True)
    ours = apart(measure_pour, case, scene, SEED, options.duration, False)
    yield ours
    deck = apart(_deck, scene, options.duration)
    for engine in options.peers:
        with tempfile.TemporaryDirectory() as folder:
            WRITERS[engine](Path(folder), deck)
            run = PEERS[engine](Path(folder))
        yield _of_peer(case, run, ours.bodies, ours.spheres, deck.dt)


def bed_cases(options: Options) -> Iterator[Measurement]:
    """Packed beds at rest, where every sphere has contacts at every step; ours without sleep."""
    for n in options.beds:
        bed = apart(wide_bed, BEDS[n])
        steps = max(20, round(SPHERE_STEPS["ours"] / n))
        ours = apart(measure_bed, bed, steps)
        yield ours
        for engine in options.peers:
            theirs = _peer_bed(bed, max(20, round(SPHERE_STEPS[engine] / n)))
            with tempfile.TemporaryDirectory() as folder:
                peer_bed.BED_WRITERS[engine](Path(folder), theirs)
                run = PEERS[engine](Path(folder))
            yield _of_peer(bed_name(n), run, n, n, theirs.dt)


def batch_cases(options: Options) -> Iterator[Measurement]:
    """The same pours by one worker and by two."""
    scene = load_scene(POUR)
    seeds = list(range(1, BATCH_POURS + 1))
    for workers in (1, 2):
        yield measure_batch("batch of pours", scene, seeds, workers)


CASES: dict[str, Callable[[Options], Iterator[Measurement]]] = {
    "pour": pour_cases,
    "bed": bed_cases,
    "batch": batch_cases,
}


def apart(function: Callable[..., Any], *arguments: Any) -> Any:
    """``function(*arguments)`` in a process of its own: Taichi starts once per process, with its threads."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(max_workers=1, mp_context=context) as pool:
        return pool.submit(function, *arguments).result()


def growth(measurements: list[Measurement]) -> float:
    """Exponent of wall time per step over the number of spheres, between the smallest and the largest of our beds."""
    beds = sorted(
        (m for m in measurements if m.case.startswith("bed") and m.engine.startswith("ours")), key=lambda m: m.spheres
    )
    if len(beds) < 2:
        return math.nan
    first, last = beds[0], beds[-1]
    return math.log(first.steps_per_s / last.steps_per_s) / math.log(last.spheres / first.spheres)


def _deck(scene: Any, duration: float) -> Any:
    """What the peers are told: the bodies enter as they did in our own run."""
    from solver import run_pour
    from solver.scene import with_values

    return deck_of(run_pour(with_values(scene, {"numerics.max_time": duration}), SEED, threads=1), duration)


def _peer_bed(bed: Bed, steps: int) -> peer_bed.Bed:
    radius = bed.centres[:, 0] * 0.0 + RADIUS
    return peer_bed.Bed(
        position=bed.centres,
        radius=radius,
        velocity=bed.velocities,
        low=(0.0, 0.0, 0.0),
        high=(bed.box.width, bed.box.depth, float(bed.centres[:, 2].max()) + 4.0 * RADIUS),
        dt=time_step(bed_scene(bed.box)),
        steps=steps,
    )


def _of_peer(case: str, run: PeerRun, bodies: int, spheres: int, dt: float) -> Measurement:
    name = f"{run.engine} {run.version}"
    return Measurement(case, name, bodies, spheres, run.steps, run.wall_s, run.steps * dt, math.nan, math.nan)
