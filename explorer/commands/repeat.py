"""``explorer repeat``: pour one scene with more seeds, and store the pours."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import EVENTS, RIG_MATERIAL, SCENE_HELP, SCHEDULER, SET, STORE, THREADS


def repeat(
    source: str = typer.Argument(metavar="RIG_OR_FILE", help=SCENE_HELP),
    material: str | None = RIG_MATERIAL,
    set_: list[str] = SET,
    pours: int = typer.Option(
        8, min=1, max=10_000, metavar="N", help="Number of pours, with seeds that are not yet in the store."
    ),
    out: Path | None = typer.Option(
        None, metavar="DIR", help="New folder for progress.jsonl, which the page reads, and log.jsonl."
    ),
    store: Path | None = STORE,
    threads: int | None = THREADS,
    scheduler: str = SCHEDULER,
    json: bool = EVENTS,
) -> None:
    """Pour a scene with further seeds, store the pours, and print mean and SD over all seeds.

    Pours that a calibration has already made of exactly this scene are included.
    """
    from explorer.background.reporter import end_as_by_ctrl_c, reporter_of
    from explorer.population.run import PoursOrder, pour_more
    from explorer.scene.file import load_scene, with_settings
    from explorer.scene.pour_cost import large_pour_text
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
        # A single seed has a mean but no standard deviation.
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
