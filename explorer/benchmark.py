"""Benchmark cases, ours and the peers' in turn in one run, each in a process of its own."""

from __future__ import annotations

import dataclasses
import math
import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from explorer.export import bed as peer_bed
from explorer.export.deck import Deck, deck_of
from explorer.export.liggghts import write_liggghts
from explorer.export.run import PeerRun, PeerTimeout, run_liggghts, run_yade
from explorer.export.yade import write_yade
from explorer.scene.file import load_scene
from solver.benchmark import (
    RADIUS,
    Bed,
    BenchmarkResult,
    bed_name,
    bed_scene,
    measure_batch,
    measure_bed,
    measure_pour,
    wide_bed,
)
from solver.scenes.time_step import time_step

POUR = "seed_pour"
"""The shipped set-up on which engines are compared."""
SEED = 1
SHORT = 0.5
"""Simulated time of the short pour [s]."""
WRITERS: dict[str, Callable[[Path, Deck], None]] = {"liggghts": write_liggghts, "yade": write_yade}
OFTEN = 8
"""Pours of ours in a round of it, so that both engines take seconds and meet the same other work of the machine."""
TO_REST = "pour to rest"
BEDS = {
    1_000: ((1, 1), (1, 1)),
    10_000: ((2, 5), (1, 1)),
    100_000: ((10, 10), (1, 1)),
    1_000_000: ((10, 10), (2, 5)),
}
"""Number of spheres → small beds along x and y, and copies of what they make."""
USUAL_BEDS = (1_000, 10_000, 100_000)
"""Without the largest, which takes minutes to put together."""
SPHERE_STEPS = {"ours": 2e7, "liggghts": 2e7, "yade": 4e6}
"""Length of a bed's run: some seconds for each engine."""
BATCH_POURS = 32
LONG, FEW = 60.0, 3
"""A case whose first round takes longer than this [s] has so many rounds at most."""


@dataclass(frozen=True)
class Options:
    """What to measure."""

    duration: float
    """Simulated time of the pour [s]."""
    beds: tuple[int, ...]
    peers: tuple[str, ...]
    rounds: int = 5
    """How often the engines take turns on a case."""
    peer_limit: float = math.inf
    """Wall time after which a peer's run is stopped [s]."""


@dataclass(frozen=True)
class Result:
    """All rounds of one engine on one case."""

    rounds: tuple[BenchmarkResult, ...]

    @property
    def median(self) -> BenchmarkResult:
        """The first round with the median wall time of all."""
        return dataclasses.replace(self.rounds[0], wall_s=statistics.median(one.wall_s for one in self.rounds))

    def ratios(self, other: Result) -> list[float]:
        """Steps per second over the other's, round by round, so that what slows both for a while cancels out."""
        both = zip(self.rounds, other.rounds, strict=False)
        return [one.steps_per_s / two.steps_per_s for one, two in both if not (one.timed_out or two.timed_out)]


def results(measurements: Sequence[BenchmarkResult]) -> list[Result]:
    """Measurements of the same case and engine together, in order of their first."""
    found: dict[tuple[str, str], list[BenchmarkResult]] = {}
    for one in measurements:
        found.setdefault((one.case, one.engine), []).append(one)
    return [Result(tuple(rounds)) for rounds in found.values()]


def short_cases(options: Options) -> Iterator[BenchmarkResult]:
    """The beginning of the seed pour: what says within a minute whether a ratio has fallen."""
    scene = load_scene(POUR)
    deck: Deck = apart(_deck, scene, SHORT)
    case = f"short pour, {SHORT:g} s"
    yield from _in_turn(options, [_our_pour(case, scene, deck, SHORT, True, OFTEN), *_peer_pours(case, deck, options)])


def pour_cases(options: Options) -> Iterator[BenchmarkResult]:
    """The seed pour: ours to rest, ours and the peers' for the same simulated time at the same time step."""
    scene, time_s = load_scene(POUR), options.duration
    deck: Deck = apart(_deck, scene, time_s)
    case = f"pour, {time_s:g} s"
    ours = [_our_pour(case, scene, deck, time_s, sleeping) for sleeping in (True, False)]

    def to_rest() -> BenchmarkResult:
        found: BenchmarkResult = apart(measure_pour, TO_REST, scene, SEED, None, True)
        return found

    yield from _in_turn(options, [to_rest, *ours, *_peer_pours(case, deck, options)])


def bed_cases(options: Options) -> Iterator[BenchmarkResult]:
    """Packed beds at rest, numbered at random, where every sphere has contacts at every step; ours without sleep."""
    for n in options.beds:
        bed = apart(wide_bed, *BEDS[n])
        runs: list[Run] = [_our_bed(bed, _bed_steps("ours", n))]
        for engine in options.peers:
            theirs = _peer_bed(bed, _bed_steps(engine, n))
            writer = peer_bed.BED_WRITERS[engine]
            runs.append(_peer_run(bed_name(n), engine, writer, theirs, (n, n), theirs.dt, options.peer_limit))
        yield from _in_turn(options, runs)


def batch_cases(options: Options) -> Iterator[BenchmarkResult]:
    """The same pours by one worker and by two."""
    scene = load_scene(POUR)
    seeds = list(range(1, BATCH_POURS + 1))
    for workers in (1, 2):
        yield measure_batch("batch of pours", scene, seeds, workers)


CASES: dict[str, Callable[[Options], Iterator[BenchmarkResult]]] = {
    "short": short_cases,
    "pour": pour_cases,
    "bed": bed_cases,
    "batch": batch_cases,
}
PEERS = ("liggghts", "yade")

Run = Callable[[], BenchmarkResult]


def apart(function: Callable[..., Any], *arguments: Any) -> Any:
    """``function(*arguments)`` in a process of its own: Taichi starts once per process, with its threads."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(max_workers=1, mp_context=context) as pool:
        return pool.submit(function, *arguments).result()


def growth(measurements: Sequence[BenchmarkResult], engine: str = "ours") -> float:
    """Exponent of wall time per step over the number of spheres, between an engine's smallest and largest bed.

    Parameters
    ----------
    measurements
        Of any cases; medians of their rounds are taken.
    engine
        How the names of the engine begin.

    Returns
    -------
    log(t₂/t₁)/log(N₂/N₁); NaN with fewer than two beds.
    """
    medians = [one.median for one in results(measurements)]
    beds = sorted(
        (m for m in medians if m.case.startswith("bed") and m.engine.lower().startswith(engine) and not m.timed_out),
        key=lambda m: m.spheres,
    )
    if len(beds) < 2:
        return math.nan
    first, last = beds[0], beds[-1]
    return math.log(first.steps_per_s / last.steps_per_s) / math.log(last.spheres / first.spheres)


def _in_turn(options: Options, runs: Sequence[Run]) -> Iterator[BenchmarkResult]:
    """One run of each, then the next round; one that timed out has no further round."""
    left, done, rounds = list(runs), 0, options.rounds
    while done < rounds:
        begin = time.perf_counter()
        for run in list(left):
            one = run()
            if one.timed_out:
                left.remove(run)
            yield one
        done += 1
        if time.perf_counter() - begin > LONG:
            rounds = min(rounds, FEW)


def _our_pour(case: str, scene: Any, deck: Deck, duration: float, sleeping: bool, times: int = 1) -> Run:
    bodies, spheres = _size(deck)

    def run() -> BenchmarkResult:
        found: BenchmarkResult = apart(measure_pour, case, scene, SEED, duration, sleeping, times)
        return dataclasses.replace(found, bodies=bodies, spheres=spheres)

    return run


def _our_bed(bed: Bed, steps: int) -> Run:
    def run() -> BenchmarkResult:
        found: BenchmarkResult = apart(measure_bed, bed, steps)
        return found

    return run


def _bed_steps(engine: str, n: int) -> int:
    return max(20, round(SPHERE_STEPS[engine] / n))


def _peer_pours(case: str, deck: Deck, options: Options) -> list[Run]:
    return [
        _peer_run(case, engine, WRITERS[engine], deck, _size(deck), deck.dt, options.peer_limit)
        for engine in options.peers
    ]


def _peer_run(
    case: str,
    engine: str,
    write: Callable[[Path, Any], None],
    what: Any,
    size: tuple[int, int],
    dt: float,
    limit: float,
) -> Run:
    """What writes ``what`` and has it run by ``engine`` for ``limit`` [s] at most; ``size``: bodies, spheres."""

    def run() -> BenchmarkResult:
        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder), what)
            try:
                done = _run_peer(engine, Path(folder), None if math.isinf(limit) else limit)
            except PeerTimeout:
                return BenchmarkResult(case, engine, *size, 0, limit, 0.0, math.nan, math.nan, timed_out=True)
        name, simulated = f"{done.engine} {done.version}", done.steps * dt
        return BenchmarkResult(case, name, *size, done.steps, done.wall_s, simulated, math.nan, math.nan)

    return run


def _run_peer(engine: str, folder: Path, limit: float | None) -> PeerRun:
    return run_yade(folder, limit=limit) if engine == "yade" else run_liggghts(folder, limit=limit)


def _size(deck: Deck) -> tuple[int, int]:
    """Bodies and member spheres of a deck."""
    return deck.bodies, sum(len(deck.members(body)) for body in range(deck.bodies))


def _deck(scene: Any, duration: float) -> Deck:
    """What the peers are told: the bodies enter as they did in our own run."""
    from solver import run_pour
    from solver.scenes.scene import with_values

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
