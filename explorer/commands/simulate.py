"""``explorer simulate``: pour a scene and print what came out."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from pathlib import Path

import typer

from explorer.commands.listing import Listing


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
    from functools import partial

    from explorer.background.reporter import EVERY, Reporter, end_as_by_ctrl_c
    from explorer.errors import CommandError
    from explorer.files.run_folder import json_text
    from explorer.simulation import SimulateOrder, run_bench, run_simulation, simulation_of
    from explorer.study.duration import large_pour_text
    from explorer.terminal.pours import RunTable, bench_text

    end_as_by_ctrl_c()
    if json and events:
        raise CommandError("--json prints the result, --events what happens meanwhile; name one of them")
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
    # With --json a pour that goes well says nothing else.
    people, every = partial(typer.echo, err=True), math.inf if json else EVERY
    with Reporter("simulate", people, sys.stdout if events else None, sys.stderr, every) as reporter:
        result = run_simulation(order, simulation, reporter, table, typer.echo)
    if table:
        table.summarise(result)
    elif json:
        typer.echo(json_text(result.to_dict()))
