"""``explorer export``: a pour as an input deck of another engine or as VTK files, a material as tables."""

from __future__ import annotations

from pathlib import Path

import typer


def export(
    source: str = typer.Argument(
        metavar="RIG_OR_FILE",
        help="A rig (funnel), or a material, set-up or study, by file or shipped name, or the folder of a calibration.",
    ),
    folder: Path = typer.Argument(metavar="DIR", help="New folder for the files."),
    to: str = typer.Option(..., metavar="PROGRAM", help="liggghts, yade, paraview or edem."),
    material: str | None = typer.Option(None, help="Material in the rig: file or shipped name."),
    set_: list[str] = typer.Option([], "--set", metavar="PATH=VALUE", help="Set a parameter; may be repeated."),
    seed: int = typer.Option(1, min=0, help="Seed of the pour."),
    time: float | None = typer.Option(None, min=0.0, help="Simulated time in s; that of our pour by default."),
    every: float | None = typer.Option(
        None,
        min=1e-3,
        max=60.0,
        metavar="S",
        help="paraview: a moment every so many simulated s, not the last one only.",
    ),
) -> None:
    """Write a pour for another program.

    liggghts, yade: an input deck that runs as it is. The pour runs here first: when and where a body enters depends
    on what lies in its way. paraview: bodies, true shapes, contacts and rig as VTK files. edem: the material as
    tables (CSV) with the convention of every coefficient; nothing is poured. The folder that `explorer calibrate` wrote
    stands for its study with the factors at the optimum.
    """
    from explorer.errors import CommandError
    from explorer.export import PROGRAMS
    from explorer.export.deck_of_scene import check_exportable, deck_of
    from explorer.export.decks import WRITERS
    from explorer.export.material_table import write_material_table
    from explorer.export.moments import moments
    from explorer.export.paraview import check_meshio, write_paraview
    from explorer.files.run_folder import appearing
    from explorer.scene.calibrated import calibrated_scene, is_calibration
    from explorer.scene.file import load_scene, with_settings
    from solver import run_pour, value

    if to not in PROGRAMS:
        raise CommandError(f"--to {to}: not a program; allowed: {', '.join(PROGRAMS)}")
    if every is not None and to != "paraview":
        raise CommandError(f"--every: belongs to --to paraview, not to {to}")
    if material is None and is_calibration(source):
        scene, caution = calibrated_scene(source)
        if caution:
            typer.echo(f"note: {caution}", err=True)
    else:
        scene = load_scene(source, material)
    scene = with_settings(scene, set_)
    if time is not None and time < float(value(scene, "numerics.max_time")):
        scene = with_settings(scene, [f"numerics.max_time={time!r}"])
    if to == "edem":
        with appearing(folder, "DIR") as temporary:
            write_material_table(temporary, scene)
        typer.echo(f"{folder}: materials, pairs and bodies; what the coefficients mean: conventions.csv")
        return
    if to == "paraview":
        check_meshio()
        with appearing(folder, "DIR") as temporary:
            seen, record = moments(scene, seed, every)
            write_paraview(temporary, record.scene, seen, seed, str(record.outcome))
        typer.echo(f"{folder}: {len(seen)} moment(s), the last at {seen[-1].time:.4g} s; what is in them: README.txt")
        return
    check_exportable(scene, to)
    with appearing(folder, "DIR") as temporary:
        deck = deck_of(run_pour(scene, seed), time)
        WRITERS[to](temporary, deck)
    typer.echo(f"{folder}: {deck.bodies} bodies, {deck.steps} steps of {deck.dt:.4g} s; how to run it: README.txt")
