"""``explorer simulate``: pour a scene and print what came out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from solver import Record


def simulate(
    source: str = typer.Argument(
        metavar="RIG_OR_FILE",
        help="A rig (funnel), or a material, set-up or study, by file or shipped name.",
    ),
    material: str | None = typer.Option(None, help="Material in the rig: file or shipped name."),
    set_: list[str] = typer.Option([], "--set", metavar="PATH=VALUE", help="Set a parameter; may be repeated."),
    seed: int = typer.Option(1, min=0, help="Seed of the first pour."),
    replicates: int = typer.Option(1, min=1, max=10_000, help="Number of pours, with seeds SEED, SEED + 1, …"),
    threads: int | None = typer.Option(None, min=1, help="CPU threads; all by default."),
    out: Path | None = typer.Option(None, help="New folder for result.json, curves, piles and parameters."),
    record: Path | None = typer.Option(
        None, metavar="FILE.rrd", help="New recording; FILE_<seed>.rrd for several pours."
    ),
    json: bool = typer.Option(False, "--json", help="Print the result as JSON, and nothing else."),
) -> None:
    """Pour a scene and print what came out.

    A jam, a lost body or a cut-off is an outcome, not an error: the result names it, and the exit code is 0.
    """
    from contextlib import ExitStack
    from time import perf_counter

    from explorer.run_folder import appearing, json_text, write_run
    from explorer.run_result import result_of
    from explorer.run_table import RunTable
    from explorer.scene_file import load_scene, with_settings
    from solver import Job, run_pours

    if record:
        from explorer.logs.pour_recorder import recorder_of
    scene = with_settings(load_scene(source, material), set_)
    seeds = range(seed, seed + replicates)
    started = perf_counter()
    with ExitStack() as stack:
        folder = stack.enter_context(appearing(out)) if out else None
        recorder = stack.enter_context(recorder_of(record, seeds)) if record else None
        table = None if json else RunTable(typer.echo)
        records: dict[int, Record] = {}
        for k, finished in run_pours(
            [Job(scene, s) for s in seeds], threads=threads, on_sample=recorder.sample if recorder else None
        ):
            records[k] = finished
            if recorder:
                recorder.finish(k, finished)
            if table:
                table.add(finished)
        ordered = [records[k] for k in sorted(records)]
        result = result_of(scene, ordered, perf_counter() - started)
        if folder:
            write_run(folder, result, ordered)
    if table:
        table.summarise(result)
    else:
        typer.echo(json_text(result))
