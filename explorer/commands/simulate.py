"""``explorer simulate``: pour a scene and print the results."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from pathlib import Path

import typer

from explorer.commands.listing import Listing
from explorer.commands.shared_options import EVENTS_HELP, RESULT_JSON, RIG_MATERIAL, SCHEDULER, SET, THREADS


class Rigs(Listing):
    """Lists rigs and bench tests."""

    heading = "Rigs and bench tests"

    def listed(self) -> Iterable[tuple[str, str]]:
        """Name of each, with the first sentence of its module's docstring."""
        from solver.rigs import BENCH_RIGS, RIGS

        for name, kind in (*RIGS.items(), *BENCH_RIGS.items()):
            text = " ".join((inspect.getdoc(inspect.getmodule(kind)) or "").split())
            yield name, text.partition(". ")[0].rstrip(".") + "."


def simulate(
    source: str = typer.Argument(
        metavar="RIG_OR_FILE",
        help="Name of a rig or bench test from the list below, or file or shipped name of a material, set-up or study.",
    ),
    material: str | None = RIG_MATERIAL,
    set_: list[str] = SET,
    seed: int | None = typer.Option(None, min=0, help="Seed of the first pour; 1 by default."),
    replicates: int = typer.Option(
        1, min=1, max=10_000, metavar="N", help="Number of pours, with seeds SEED, SEED + 1, …"
    ),
    threads: int | None = THREADS,
    scheduler: str = SCHEDULER,
    out: Path | None = typer.Option(
        None, metavar="DIR", help="New folder for result.json, curves, piles and parameters."
    ),
    record: Path | None = typer.Option(
        None, metavar="FILE.rrd", help="New recording; with several pours, one FILE_<seed>.rrd each."
    ),
    checkpoint: Path | None = typer.Option(
        None, metavar="FILE.npz", help="File for the state of the pour, rewritten every 0.5 s of simulated time."
    ),
    resume: Path | None = typer.Option(
        None, metavar="FILE.npz", help="Continue from this checkpoint of the same scene."
    ),
    json: bool = RESULT_JSON,
    events: bool = typer.Option(False, "--events", help=EVENTS_HELP),
) -> None:
    """Pour a scene and print the results, or run a bench test and compare measured with input values.

    A jam, a lost body or a cut-off is an outcome, not an error: the result names it, and the exit code is 0.
    """
    import math
    import sys
    from functools import partial

    from explorer.background.reporter import EVERY, Reporter, end_as_by_ctrl_c
    from explorer.errors import CommandError
    from explorer.files.run_folder import json_text
    from explorer.scene.pour_cost import large_pour_text
    from explorer.simulation import SimulateOrder, run_bench, run_simulation, simulation_of
    from explorer.terminal.pours import RunTable, bench_text

    end_as_by_ctrl_c()
    if json and events:
        raise CommandError("--json prints the result, --events the progress; allowed: one of the two")
    order = SimulateOrder(
        source=source,
        material=material,
        settings=tuple(set_),
        seed=seed,
        replicates=replicates,
        threads=threads,
        scheduler=scheduler,
        out=out,
        record=record,
        checkpoint=checkpoint,
        resume=resume,
    )
    simulation = simulation_of(order, events)
    if simulation.is_bench_test:
        measured = run_bench(simulation, out)
        typer.echo(json_text(measured.to_dict()) if json else bench_text(measured))
        return
    if large := large_pour_text(simulation.scene):
        typer.echo(large, err=True)
    table = None if json or events else RunTable(typer.echo)
    # With --json, a pour without problems prints nothing but the result.
    people, every = partial(typer.echo, err=True), math.inf if json else EVERY
    with Reporter("simulate", people, sys.stdout if events else None, sys.stderr, every) as reporter:
        result = run_simulation(order, simulation, reporter, table, typer.echo)
    if table:
        table.summarise(result)
    elif json:
        typer.echo(json_text(result.to_dict()))
