"""``explorer simulate``: pour a scene and print what came out."""

from __future__ import annotations

import inspect
import os
from collections import deque
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from explorer.commands.listing import Listing

if TYPE_CHECKING:
    from solver import Record
    from solver.pours.pour import Pour

CHECKPOINT_INTERVAL = 0.5
"""Simulated time [s] between two checkpoints."""


class Rigs(Listing):
    """Lists rigs and bench tests."""

    heading = "Rigs and bench tests"

    def listed(self) -> Iterable[tuple[str, str]]:
        """With the first sentence of the file of each."""
        from solver.rigs import BENCH_RIGS, RIGS

        for name, kind in (*RIGS.items(), *BENCH_RIGS.items()):
            text = " ".join((inspect.getdoc(inspect.getmodule(kind)) or "").split())
            yield name, text.partition(". ")[0].rstrip(".") + "."


def simulate(
    source: str = typer.Argument(
        metavar="RIG_OR_FILE",
        help="A rig or bench test of those below, or a material, set-up or study, by file or shipped name.",
    ),
    material: str | None = typer.Option(None, help="Material in the rig: file or shipped name."),
    set_: list[str] = typer.Option([], "--set", metavar="PATH=VALUE", help="Set a parameter; may be repeated."),
    seed: int = typer.Option(1, min=0, help="Seed of the first pour."),
    replicates: int = typer.Option(1, min=1, max=10_000, help="Number of pours, with seeds SEED, SEED + 1, …"),
    threads: int | None = typer.Option(None, min=1, help="Pours at the same time; one per core if not given."),
    scheduler: str = typer.Option("", metavar="tcp://…", help="Pour on the workers of this Dask scheduler."),
    out: Path | None = typer.Option(None, help="New folder for result.json, curves, piles and parameters."),
    record: Path | None = typer.Option(
        None, metavar="FILE.rrd", help="New recording; FILE_<seed>.rrd for several pours."
    ),
    checkpoint: Path | None = typer.Option(
        None, metavar="FILE.npz", help="Keep the state of the pour in this file, twice per simulated second."
    ),
    resume: Path | None = typer.Option(None, metavar="FILE.npz", help="Go on from this checkpoint of the same scene."),
    json: bool = typer.Option(False, "--json", help="Print the result as JSON, and nothing else."),
    events: bool = typer.Option(
        False, "--events", help="Print events for CI instead, one JSON object per line, as the other long commands do."
    ),
) -> None:
    """Pour a scene and print what came out, or run a bench test and print what it measured beside what was put in.

    A jam, a lost body or a cut-off is an outcome, not an error: the result names it, and the exit code is 0.
    """
    import math
    import sys
    from contextlib import ExitStack
    from functools import partial
    from time import perf_counter

    from doe.declared.pours import Ended
    from explorer.background.progress import PourProgress, SimulatedTime
    from explorer.background.reporter import EVERY, Reporter, end_as_by_ctrl_c
    from explorer.errors import CommandError
    from explorer.files.checkpoint_writer import CheckpointWriter
    from explorer.files.run_folder import appearing, json_text, write_run
    from explorer.files.run_result import result_of
    from explorer.scene.file import load_scene, with_settings
    from explorer.study.duration import large_pour_text
    from explorer.tables.pours import RunTable, bench_data, bench_text, write_bench
    from solver import Job, check_scheduler, executor, run_pours
    from solver.arch import chosen
    from solver.pours.checkpoint import read_checkpoint
    from solver.rigs import BENCH_RIGS
    from solver.single_body import run_bench_test

    end_as_by_ctrl_c()
    if json and events:
        raise CommandError("--json prints the result, --events what happens meanwhile; name one of them")
    check_scheduler(scheduler, threads)
    if scheduler and (record or checkpoint):
        watched = "--record" if record else "--checkpoint"
        raise CommandError(f"{watched}: is for pours that run on this machine; leave --scheduler out")
    if replicates > 1 and (checkpoint or resume):
        raise CommandError("--checkpoint and --resume are for one pour, not for --replicates")
    interrupted = read_checkpoint(resume) if resume else None
    if interrupted:
        seed = interrupted.seed
    if checkpoint and not checkpoint.absolute().parent.is_dir():
        raise CommandError(f"--checkpoint: {checkpoint}: no folder {checkpoint.absolute().parent}")
    if record:
        from explorer.recordings.pour_recorder import recorder_of
        from explorer.recordings.recording import recorded_lines
    scene = with_settings(load_scene(source, material), set_)
    if scene.rig.name in BENCH_RIGS:
        if record or checkpoint or resume or replicates > 1 or events or scheduler:
            raise CommandError(
                f"{scene.rig.name} is a bench test: --record, --checkpoint, --resume, --replicates, --events and "
                "--scheduler are for pours"
            )
        with ExitStack() as stack:
            folder = stack.enter_context(appearing(out)) if out else None
            data = bench_data(scene, run_bench_test(scene, seed))
            if folder:
                write_bench(folder, data)
        typer.echo(json_text(data) if json else bench_text(data))
        return
    if large := large_pour_text(scene):
        typer.echo(large, err=True)
    seeds = range(seed, seed + replicates)
    if replicates == 1:
        # A world is computed by one thread, and with one its kernels are those of the page and of workers.
        threads = 1
    started = perf_counter()
    with ExitStack() as stack:
        people = partial(typer.echo, err=True)
        # With --json a pour that goes well says nothing else.
        every = math.inf if json else EVERY
        reporter = stack.enter_context(Reporter("simulate", people, sys.stdout if events else None, sys.stderr, every))
        folder = stack.enter_context(appearing(out)) if out else None
        reporter.begin(resumed=resume is not None)
        progress = PourProgress(reporter)
        progress.compiling()
        table = None if json or events else RunTable(typer.echo)
        recorder = recorder_of(record, seeds) if record else None
        if recorder:
            if table:
                # Also after Ctrl-C: it is called once the files are closed.
                stack.callback(lambda: typer.echo("\n".join(recorded_lines(recorder.pours))))
            stack.enter_context(recorder)
        numerics = scene.numerics
        within = SimulatedTime(reporter, numerics.duration or numerics.max_time) if replicates == 1 else None
        records: dict[int, Record] = {}
        kept = CheckpointWriter(checkpoint, CHECKPOINT_INTERVAL) if checkpoint else None

        def sample(k: int, pour: Pour) -> None:
            for listener in (recorder, kept):
                if listener:
                    listener.sample(k, pour)
            if within:
                within.sample(pour.time)

        jobs = [Job(scene, s, tag=k, interrupted=interrupted) for k, s in enumerate(seeds)]
        if scheduler or (replicates > 1 and not (recorder or kept) and chosen() == "cpu"):
            # Nobody looks at them from within, so they run in processes of their own: in one, all wait for the slowest.
            pool = stack.enter_context(executor(min(threads or os.cpu_count() or 1, replicates), scheduler))
            pours: Iterator[tuple[int, Record]] = (
                (job.tag, finished) for job, finished in pool.run_queue(deque(jobs), [scene])
            )
        else:
            pours = run_pours(jobs, threads=threads, on_sample=sample)
        for k, finished in pours:
            records[k] = finished
            if finished.outcome.unstable:
                reporter.diverged(scene, finished.seed, finished, folder, out)
            ended = Ended(scene.title, finished.seed, finished.outcome, finished.message, wall_s=finished.wall_s)
            progress.pour("pours", replicates - len(records), ended)
            if recorder:
                recorder.finish(k, finished)
            if table:
                table.add(finished)
        ordered = [records[k] for k in sorted(records)]
        result = result_of(scene, ordered, perf_counter() - started)
        if folder:
            write_run(folder, result, ordered)
            reporter.result = out and out / "result.json"
    if table:
        table.summarise(result)
    elif json:
        typer.echo(json_text(result))
