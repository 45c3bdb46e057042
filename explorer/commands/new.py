"""``explorer new``: start a material, a study, a project or measured data of your own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import typer

from explorer.commands.shared_options import RESULT_JSON

app = typer.Typer(no_args_is_help=True)
NAME = typer.Argument(metavar="NAME", help="Name: letters, digits, - and _.")
FOLDER = typer.Argument(metavar="NAME", help="Folder name.")
OUT = typer.Option(Path(), metavar="DIR", help="Folder to write into.")


@app.callback()
def new() -> None:
    """Write a starter material, study, project or folder of measured data.

    A starter file is commented and runs as it is. Existing files are never overwritten.
    """


@app.command()
def material(
    name: str = NAME,
    out: Path = OUT,
    like: str | None = typer.Option(None, metavar="MATERIAL", help="Material to start from: file or shipped name."),
    part: list[Path] = typer.Option(
        [], metavar="PART.toml", help="Measured parameters from `explorer lab --out`; repeatable."
    ),
    from_liggghts: Path | None = typer.Option(
        None, metavar="FILE", help="LIGGGHTS input script to read: property/global, particletemplate."
    ),
    from_yade: Path | None = typer.Option(
        None, metavar="FILE", help="YADE script to read (it is not run): FrictMat, sphere."
    ),
    from_edem: Path | None = typer.Option(
        None, metavar="FILE", help="Table of EDEM values to read, or folder of `explorer export --to edem`."
    ),
) -> None:
    """Write NAME.toml, a material.

    When another program's input is read, the conversions, omissions and assumptions are printed and written at the top
    of the file.
    """
    inputs = {"liggghts": from_liggghts, "yade": from_yade, "edem": from_edem}
    given = {program: file for program, file in inputs.items() if file is not None}
    if len(given) > 1 or (given and (like is not None or part)):
        from explorer.errors import CommandError

        raise CommandError(f"--from-{next(iter(given))}: not allowed together with --like, --part or another --from-…")
    if given:
        from explorer.imported import write_imported

        path, notes = write_imported(out, name, *next(iter(given.items())))
        for note in notes:
            typer.echo(f"note: {note}")
    elif like is not None or part:
        from explorer.laboratory.part import write_measured_material

        path = write_measured_material(out, name, like, part)
    else:
        from explorer.scene.starter_files import write_material

        path = write_material(out, name)
    _tell([path], "simulate", path)


@app.command()
def study(
    name: str = NAME,
    out: Path = OUT,
    material: str | None = typer.Option(
        None, metavar="MATERIAL", help="Material: file or shipped name; by default NAME.toml, written if missing."
    ),
) -> None:
    """Write NAME_study.toml, a study.

    Its material, NAME.toml, is also written if it is missing. NAME may be given with or without _study.
    """
    from explorer.scene.starter_files import STUDY_ENDING, write_study

    written = write_study(out, name, material)
    results = Path("results") / written[-1].stem.removesuffix(STUDY_ENDING)
    _tell(written, "calibrate", "--headless", "--study", written[-1], "--profile", "quick", "--out", results)


@app.command()
def project(
    name: str = FOLDER,
    out: Path = OUT,
    material: str | None = typer.Option(
        None, metavar="MATERIAL", help="Material: file or shipped name; by default a starter, written into the folder."
    ),
) -> None:
    """Make a project folder for `explorer serve`.

    It contains a material, a study and project.toml, and stores their results.
    """
    from explorer.project.project import new_project

    _tell(new_project(out / name, material), "serve", out / name)


@app.command()
def measurement(
    name: str = FOLDER,
    out: Path = OUT,
    study: str | None = typer.Option(
        None,
        metavar="STUDY",
        help="Study whose material, set-up and factors apply to the data: file or shipped name.",
    ),
    material: str | None = typer.Option(
        None, metavar="MATERIAL", help="Material of the data, instead of --study: file or shipped name."
    ),
    set_: list[str] = typer.Option(
        [],
        "--set",
        metavar="PATH=VALUE",
        help="Set a parameter of the condition's set-up (rig.…, insertion.…); repeatable.",
    ),
    condition: str = typer.Option("A", metavar="NAME", help="Condition to which the files belong."),
    role: Literal["fit", "holdout"] | None = typer.Option(None, help="Role of the condition; by default proposed."),
    photo: list[str] = typer.Option(
        [],
        metavar="FILE",
        help="Photograph of a pile (file or shipped name) or of a drum's face, one per pour; repeatable.",
    ),
    scale: float | None = typer.Option(None, metavar="MM_PER_PX", help="Length of a pixel of the photographs [mm]."),
    angles: str | None = typer.Option(None, metavar="A,B,…|FILE.csv[:COLUMN]", help="Angles [°], one per pour."),
    balance: list[Path] = typer.Option(
        [], metavar="FILE.csv", help="Balance readings (time_s, mass_g), one file per pour; repeatable."
    ),
    starts: list[float] = typer.Option(
        [],
        metavar="S",
        help="Start of the flow on the balance's clock [s], one for all files or one per file; repeatable.",
    ),
    lag: float | None = typer.Option(
        None, min=0.0, metavar="S", help="Lag of the balance [s], subtracted from its times."
    ),
    scan: list[Path] = typer.Option([], metavar="FILE", help="Scan of a pile, one per pour; repeatable."),
    scan_unit: Literal["m", "cm", "mm", "um"] = typer.Option(
        "m", help="Unit of .ply, .stl, .xyz, .txt and .csv scans."
    ),
    drum: str | None = typer.Option(
        None, metavar="FILE.csv[:COMPONENT]", help="Sheet of `explorer lab drum` with the angles of a rotating drum."
    ),
    uncertainty: list[str] = typer.Option(
        [],
        metavar="NAME=VALUE",
        help="Standard deviation of one value of an observable, where replicates cannot give it; repeatable.",
    ),
    json: bool = RESULT_JSON,
) -> None:
    """Make a folder of measured data for `explorer diagnose`, or add a condition to one.

    Takes photographs, angles, balance curves, scans and a drum's sheet from several pours of one condition, each kind
    in the same order of pours. Another --condition for the same folder adds to it. The command proposes which condition
    to fit and which to hold out, and prints what the data can identify.
    """
    from explorer.errors import CommandError
    from explorer.files.run_folder import json_text
    from explorer.measured.folder import NewCondition, write_condition, written_text
    from explorer.measured.readings import Brought
    from explorer.terminal.measurement import check_result
    from solver.assets import asset_path

    if scale is not None and not 0.0 < scale < float("inf"):
        raise CommandError(f"--scale {scale:g} mm/px: must be positive and finite")
    brought = Brought(
        photographs=tuple(asset_path("photographs", one) for one in photo),
        pixel=None if scale is None else 1e-3 * scale,
        angles=angles,
        balances=tuple(balance),
        starts=tuple(starts),
        lag=lag,
        scans=tuple(scan),
        scan_unit=scan_unit,
        drum=drum,
    )
    asked = NewCondition(condition, role, study, material, tuple(set_), tuple(uncertainty))
    found = write_condition(out / name, asked, brought)
    if json:
        plain = {"written": list(map(str, found.files)), "told": list(found.told), "proposal": found.proposal}
        typer.echo(json_text(plain | check_result(found.measurement)))
        return
    typer.echo(written_text(found))
    _tell([], "diagnose", out / name)


def _tell(written: Sequence[Path], *command: str | Path) -> None:
    """Print the files written, and a command that uses them."""
    import shlex

    for path in written:
        typer.echo(f"wrote {path}")
    typer.echo(f"try it: explorer {shlex.join(map(str, command))}")
