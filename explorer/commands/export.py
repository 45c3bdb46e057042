"""``explorer export``: write a pour as an input deck of another engine."""

from __future__ import annotations

from pathlib import Path

import typer


def export(
    source: str = typer.Argument(
        metavar="RIG_OR_FILE",
        help="A rig (funnel), or a material, set-up or study, by file or shipped name.",
    ),
    folder: Path = typer.Argument(metavar="DIR", help="New folder for the deck."),
    to: str = typer.Option(..., metavar="ENGINE", help="liggghts or yade."),
    material: str | None = typer.Option(None, help="Material in the rig: file or shipped name."),
    set_: list[str] = typer.Option([], "--set", metavar="PATH=VALUE", help="Set a parameter; may be repeated."),
    seed: int = typer.Option(1, min=0, help="Seed of the pour."),
    time: float | None = typer.Option(None, min=0.0, help="Simulated time in s; that of our pour by default."),
) -> None:
    """Write a pour as an input deck that LIGGGHTS or YADE runs as it is.

    The pour runs here first: when and where a body enters depends on what lies in its way.
    """
    from explorer.errors import CommandError
    from explorer.export import WRITERS
    from explorer.export.deck import check_exportable, deck_of
    from explorer.files.run_folder import appearing
    from explorer.scene.file import load_scene, with_settings
    from solver import run_pour, value

    if to not in WRITERS:
        raise CommandError(f"--to {to}: not an engine; allowed: {', '.join(WRITERS)}")
    scene = with_settings(load_scene(source, material), set_)
    if time is not None and time < float(value(scene, "numerics.max_time")):
        scene = with_settings(scene, [f"numerics.max_time={time!r}"])
    check_exportable(scene)
    with appearing(folder, "DIR") as temporary:
        deck = deck_of(run_pour(scene, seed), time)
        WRITERS[to](temporary, deck)
    typer.echo(f"{folder}: {deck.bodies} bodies, {deck.steps} steps of {deck.dt:.4g} s; how to run it: README.txt")
