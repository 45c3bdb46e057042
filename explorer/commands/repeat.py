"""``explorer repeat``: more seeds of one scene, into the store."""

from __future__ import annotations

from pathlib import Path

import typer


def repeat(
    source: str = typer.Argument(metavar="RIG_OR_FILE", help="As for `explorer simulate`."),
    material: str | None = typer.Option(None, help="Material in the rig: file or shipped name."),
    set_: list[str] = typer.Option([], "--set", metavar="PATH=VALUE", help="Set a parameter; may be repeated."),
    pours: int = typer.Option(
        8, min=1, max=10_000, help="Number of pours, with seeds that the store does not hold yet."
    ),
    out: Path | None = typer.Option(None, help="New folder for progress.jsonl, which the page reads, and log.jsonl."),
    store: Path | None = typer.Option(None, help="SQLite file that keeps every pour."),
    threads: int | None = typer.Option(None, min=1, help="Worker processes; one per core if not given."),
    scheduler: str = typer.Option("", metavar="tcp://…", help="Pour on the workers of this Dask scheduler."),
    json: bool = typer.Option(
        False, "--json", "--events", help="Print events for CI, one JSON object per line, and nothing else."
    ),
) -> None:
    """Pour a scene with more seeds, keep every pour in the store, and print what all of its seeds gave.

    Pours that a calibration has made of exactly this scene count as well.
    """
    from explorer.background.reporter import end_as_by_ctrl_c, reporter_of
    from explorer.population.run import PoursOrder, pour_more
    from explorer.scene.file import load_scene, with_settings
    from explorer.study.duration import large_pour_text
    from explorer.terminal.text_table import text_table
    from solver import check_scheduler

    check_scheduler(scheduler, threads)

    end_as_by_ctrl_c()
    scene = with_settings(load_scene(source, material), set_)
    if large := large_pour_text(scene):
        typer.echo(large, err=True)
    with reporter_of("repeat", json) as reporter:
        found = pour_more(PoursOrder(scene, pours, out, store, threads, scheduler), reporter)
    rows = [
        # One seed has a mean, and no standard deviation.
        [
            one.observable,
            f"{one.sample.mean:.4g}",
            f"{one.sample.sd:.4g}" if one.n > 1 else "-",
            str(one.n),
            str(one.void),
        ]
        for one in found
        if one.n
    ]
    reporter.say(text_table(["observable", "mean", "sd", "seeds", "void"], rows) if rows else "no valid pour")
