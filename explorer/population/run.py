"""More pours of one scene, with seeds that the store does not hold yet; every one is kept there."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import count, islice
from pathlib import Path

from doe.population import Population
from doe.pour_runner import PourRunner
from doe.run_records import Setting
from doe.store import Store, default_store
from explorer.background.progress import RunProgress, told_of_pauses
from explorer.background.reporter import Reporter
from explorer.files.output_file import check_vacant
from explorer.population.process import populations
from solver import Scene, available_cores, executor, observable_names, run_queue
from solver.arch import chosen

STAGE = "pours"
"""Name of the one stage, in the progress and in the store."""
MOST_SEEDS = 20
"""Seeds that are told one by one."""


@dataclass(frozen=True)
class PoursOrder:
    """What a user asked for: ``pours`` more of ``scene``; ``out`` takes the progress, None for none."""

    scene: Scene
    pours: int
    out: Path | None = None
    store: Path | None = None
    threads: int | None = None
    scheduler: str = ""
    """Address of a Dask scheduler whose workers pour; "" for processes of this machine."""


def pour_more(order: PoursOrder, reporter: Reporter) -> tuple[Population, ...]:
    """Pour, and return the population of every observable of the rig, earlier pours included.

    Seeds are the smallest from 1 on that the store does not hold for this scene. Finished pours are kept whatever
    happens to the rest.
    """
    if order.out is not None:
        check_vacant(order.out)
    path = order.store or default_store()
    workers = min(order.threads or available_cores(), order.pours)
    with ExitStack() as stack:
        # Before anything is made: perhaps no scheduler answers.
        pool = stack.enter_context(executor(workers, order.scheduler)) if chosen() == "cpu" else None
        store = Store(path)
        stack.callback(store.close)
        seeds = new_seeds((run.seed for run in store.pours_of(order.scene)), order.pours)
        told = ", ".join(map(str, seeds)) if len(seeds) <= MOST_SEEDS else f"{seeds[0]} … {seeds[-1]}"
        reporter.say(f"{order.scene.title}: {order.pours} pours, seeds {told}; store {path}")
        if order.out is not None:
            order.out.mkdir(parents=True, exist_ok=True)
        reporter.begin(order.out)
        progress = RunProgress(reporter, {STAGE: order.pours})
        stack.enter_context(told_of_pauses(progress.went_on))
        progress.compiling()
        pours = reporter.watched(pool.run_queue if pool else partial(run_queue, threads=order.threads))
        name = order.scene.title
        runner = PourRunner(order.scene, store, name, 0, order.threads, on_run=progress.run, pours=pours, seeds=seeds)
        for _ in runner.each(STAGE, [Setting(STAGE, {}, order.pours)]):
            pass  # told by then, and in the store: memory must not grow with the number of pours
        reporter.result = path
        return populations(store, order.scene, observable_names(order.scene))


def new_seeds(stored: Iterable[int], n: int) -> tuple[int, ...]:
    """The ``n`` smallest seeds from 1 on that are not ``stored``."""
    known = set(stored)
    return tuple(islice((seed for seed in count(1) if seed not in known), n))
