"""Pours of one scene, or a bench test of it, from an order to its files: what ``explorer simulate`` does."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from doe.declared.pour_end import Ended
from explorer.background.progress import PourProgress, SimulatedTime
from explorer.background.reporter import Reporter
from explorer.errors import CommandError
from explorer.files.checkpoint_writer import CheckpointWriter
from explorer.files.output_file import check_folder_of
from explorer.files.run_folder import appearing, write_result, write_run
from explorer.files.run_result import BenchTestResult, SimulationResult, bench_test_result, simulation_result
from explorer.scene.file import load_scene, with_settings
from explorer.terminal.pours import RunTable
from solver import Job, Record, Scene, available_cores, check_scheduler, executor, run_pours
from solver.arch import chosen
from solver.pours.checkpoint import Checkpoint, read_checkpoint
from solver.rigs import BENCH_RIGS
from solver.single_body import run_bench_test

if TYPE_CHECKING:
    from solver.pours.pour import Pour

CHECKPOINT_INTERVAL = 0.5
"""Simulated time [s] between two checkpoints."""


@dataclass(frozen=True, kw_only=True)
class SimulateOrder:
    """What a user asked for."""

    source: str
    """Rig or bench test, or material, set-up or study, by file or shipped name."""
    material: str | None = None
    settings: tuple[str, ...] = ()
    """``path=value``, in order."""
    seed: int | None = None
    """Of the first pour, the others follow one by one; None: 1, or that of an interrupted pour."""
    replicates: int = 1
    threads: int | None = None
    scheduler: str = ""
    """Address of a Dask scheduler whose workers pour; "" for processes of this machine."""
    out: Path | None = None
    record: Path | None = None
    """New recording, with the seed in its name where there are several pours."""
    checkpoint: Path | None = None
    """Where the state of the pour is kept meanwhile."""
    resume: Path | None = None
    """Checkpoint that is gone on from."""

    @property
    def watched(self) -> str:
        """The option by which a pour is followed from within, which needs it in this process; "" for none."""
        return "--record" if self.record else "--checkpoint" if self.checkpoint else ""


@dataclass(frozen=True)
class Simulation:
    """What is to be poured: ``scene`` once for each of ``seeds``, or on from where one was ``interrupted``."""

    scene: Scene
    seeds: Sequence[int]
    interrupted: Checkpoint | None = None

    @property
    def is_bench_test(self) -> bool:
        """Whether it is no pour but a test of one contact or one body."""
        return self.scene.rig.name in BENCH_RIGS


def simulation_of(order: SimulateOrder, events: bool = False) -> Simulation:
    """The scene and the seeds of an order; ``events``: whether they are asked for.

    Raises CommandError for options that do not go together, and whatever reading the scene and the checkpoint raises.
    """
    check_scheduler(order.scheduler, order.threads)
    if order.scheduler and order.watched:
        raise CommandError(f"{order.watched}: allowed only for pours on this machine; leave out --scheduler")
    if order.replicates > 1 and (order.checkpoint or order.resume):
        raise CommandError("--checkpoint and --resume: allowed for one pour only; leave out --replicates")
    interrupted = read_checkpoint(order.resume) if order.resume else None
    if order.checkpoint:
        check_folder_of(order.checkpoint, "--checkpoint")
    scene = with_settings(load_scene(order.source, order.material), order.settings)
    first = interrupted.seed if interrupted else 1 if order.seed is None else order.seed
    if order.seed not in (None, first):
        raise CommandError(f"--seed {order.seed}: the interrupted pour has the seed {first}; leave out --seed")
    found = Simulation(scene, range(first, first + order.replicates), interrupted)
    of_pours = order.watched or order.resume or order.replicates > 1 or events or order.scheduler or order.threads
    if found.is_bench_test and of_pours:
        raise CommandError(
            f"{scene.rig.name} is a bench test: --record, --checkpoint, --resume, --replicates, --threads, "
            "--scheduler and --events are for pours"
        )
    return found


def run_bench(simulation: Simulation, out: Path | None) -> BenchTestResult:
    """Make the bench test, into the new folder ``out`` where one is given; returns what it measured."""
    scene, (seed,) = simulation.scene, simulation.seeds
    with ExitStack() as stack:
        folder = stack.enter_context(appearing(out)) if out else None
        result = bench_test_result(scene, run_bench_test(scene, seed))
        if folder:
            write_result(folder, result)
    return result


def run_simulation(
    order: SimulateOrder, simulation: Simulation, reporter: Reporter, table: RunTable | None, say: Callable[[str], None]
) -> SimulationResult:
    """Pour and write the files; returns the content of ``result.json``.

    ``table`` is told of every pour as it ends, ``say`` of what was recorded, also where the pours are cut off.
    """
    scene, seeds, n = simulation.scene, simulation.seeds, len(simulation.seeds)
    if order.record:
        # rerun takes a second to import; only those who record pay for it.
        from explorer.recordings.pour_recorder import recorder_of
        from explorer.recordings.recording import recorded_lines
    started = perf_counter()
    with ExitStack() as stack:
        folder = stack.enter_context(appearing(order.out)) if order.out else None
        reporter.begin(resumed=order.resume is not None)
        progress = PourProgress(reporter)
        progress.compiling()
        recorder = recorder_of(order.record, seeds) if order.record else None
        if recorder:
            if table:
                # Called once the files are closed, also after Ctrl-C.
                stack.callback(lambda: say("\n".join(recorded_lines(recorder.pours))))
            stack.enter_context(recorder)
        kept = CheckpointWriter(order.checkpoint, CHECKPOINT_INTERVAL) if order.checkpoint else None
        numerics = scene.numerics
        within = SimulatedTime(reporter, numerics.duration or numerics.max_time) if n == 1 else None

        def sample(k: int, pour: Pour) -> None:
            for listener in (recorder, kept):
                if listener:
                    listener.sample(k, pour)
            if within:
                within.sample(pour.time)

        records: dict[int, Record] = {}
        for k, finished in _poured(order, simulation, stack, sample):
            records[k] = finished
            if finished.outcome.unstable:
                reporter.diverged(scene, finished.seed, finished, folder, order.out)
            ended = Ended(scene.title, finished.seed, finished.outcome, finished.message, wall_s=finished.wall_s)
            progress.pour("pours", n - len(records), ended)
            if recorder:
                recorder.finish(k, finished)
            if table:
                table.add(finished)
        ordered = [records[k] for k in sorted(records)]
        result = simulation_result(scene, ordered, perf_counter() - started)
        if folder and order.out:
            write_run(folder, result, ordered)
            reporter.result = order.out / "result.json"
    return result


def _poured(
    order: SimulateOrder, simulation: Simulation, stack: ExitStack, sample: Callable[[int, Pour], None]
) -> Iterator[tuple[int, Record]]:
    """Number and record of every pour as it ends; what pours them is closed with ``stack``."""
    scene, n = simulation.scene, len(simulation.seeds)
    jobs = [Job(scene, s, tag=k, interrupted=simulation.interrupted) for k, s in enumerate(simulation.seeds)]
    if order.scheduler or (n > 1 and not order.watched and chosen() == "cpu"):
        # Nobody looks at them from within, so they run in processes of their own: in one, all wait for the slowest.
        pool = stack.enter_context(executor(min(order.threads or available_cores(), n), order.scheduler))
        return ((job.tag, finished) for job, finished in pool.run_queue(deque(jobs), [scene]))
    # A world is computed by one thread, and with one its kernels are those of the page and of workers.
    return run_pours(jobs, threads=1 if n == 1 else order.threads, on_sample=sample)
