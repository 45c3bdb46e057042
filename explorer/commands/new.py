"""``explorer new``: start a material, a study, a project or measured data of one's own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import typer

app = typer.Typer(no_args_is_help=True)
NAME = typer.Argument(metavar="NAME", help="Its name: letters, digits, - and _.")
FOLDER = typer.Argument(metavar="NAME", help="The folder to make.")
OUT = typer.Option(Path(), help="Folder to write into.")


@app.callback()
def new() -> None:
    """Write a commented file that runs as it is, or a folder of measured data.

    Files that are there are never overwritten.
    """


@app.command()
def material(
    name: str = NAME,
    out: Path = OUT,
    like: str | None = typer.Option(None, metavar="MATERIAL", help="It starts as this one: name or file."),
    part: list[Path] = typer.Option(
        [], metavar="PART.toml", help="Measured parameters, from `explorer lab --out`; repeatable."
    ),
    from_liggghts: Path | None = typer.Option(
        None, metavar="FILE", help="From a LIGGGHTS input script: property/global, particletemplate."
    ),
    from_yade: Path | None = typer.Option(
        None, metavar="FILE", help="From a YADE script, which is read, not run: FrictMat, sphere."
    ),
    from_edem: Path | None = typer.Option(
        None, metavar="FILE", help="From a table of EDEM's values, or a folder of `export --to edem`."
    ),
) -> None:
    """Write NAME.toml, a material.

    From another program's input, how numbers were converted, what was not taken and what is assumed is told, and stands
    at the top of the file.
    """
    inputs = {"liggghts": from_liggghts, "yade": from_yade, "edem": from_edem}
    given = {program: file for program, file in inputs.items() if file is not None}
    if len(given) > 1 or (given and (like is not None or part)):
        from explorer.errors import CommandError

        raise CommandError(f"--from-{next(iter(given))}: allowed without --like, --part and another --from-…")
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
    material: str | None = typer.Option(None, help="Name or file; by default NAME.toml, written if missing."),
) -> None:
    """Write NAME_study.toml, a study.

    And NAME.toml, its material, where that is missing. A NAME that ends in _study means the same.
    """
    from explorer.scene.starter_files import STUDY_ENDING, write_study

    written = write_study(out, name, material)
    results = Path("results") / written[-1].stem.removesuffix(STUDY_ENDING)
    _tell(written, "calibrate", "--headless", "--study", written[-1], "--profile", "quick", "--out", results)


@app.command()
def project(
    name: str = FOLDER,
    out: Path = OUT,
    material: str | None = typer.Option(None, help="Name or file; by default a starter, written into the folder."),
) -> None:
    """Make a folder for `explorer serve`.

    It holds a material, a study and project.toml, and keeps what comes out of them.
    """
    from explorer.project.project import new_project

    _tell(new_project(out / name, material), "serve", out / name)


@app.command()
def measurement(
    name: str = FOLDER,
    out: Path = OUT,
    study: str | None = typer.Option(
        None, help="Study whose material, set-up and factors the data belong to; or --material."
    ),
    material: str | None = typer.Option(None, help="Material of the data: name or file."),
    set_: list[str] = typer.Option(
        [], "--set", metavar="PATH=VALUE", help="Set-up of the condition, rig.… and insertion.…; repeatable."
    ),
    condition: str = typer.Option("A", metavar="NAME", help="Condition that the files are of."),
    role: Literal["fit", "holdout"] | None = typer.Option(None, help="Of the condition; proposed if not given."),
    photo: list[str] = typer.Option(
        [],
        metavar="FILE",
        help="Photograph of the next pour's pile (or a shipped one's name), or of a drum's face; repeatable.",
    ),
    scale: float | None = typer.Option(None, metavar="MM_PER_PX", help="Pixel of the photographs."),
    angles: str | None = typer.Option(
        None, metavar="A,B,…|FILE.csv[:COLUMN]", help="Angles in degrees, one for each pour."
    ),
    balance: list[Path] = typer.Option(
        [], metavar="FILE.csv", help="time_s and mass_g of a balance, a file for each pour."
    ),
    starts: list[float] = typer.Option(
        [], metavar="S", help="When the flow began on the balance's clock: one for all files, or one for each."
    ),
    lag: float | None = typer.Option(None, min=0.0, metavar="S", help="Lag of the balance, to be taken off its times."),
    scan: list[Path] = typer.Option([], metavar="FILE", help="Scan of the next pour's pile; repeatable."),
    scan_unit: Literal["m", "cm", "mm", "um"] = typer.Option(
        "m", help="Unit of .ply, .stl, .xyz, .txt and .csv scans."
    ),
    drum: str | None = typer.Option(
        None, metavar="FILE.csv[:COMPONENT]", help="Sheet of `lab drum`, angles of a rotating drum."
    ),
    uncertainty: list[str] = typer.Option(
        [], metavar="NAME=VALUE", help="Standard deviation of one value, where one pour has no scatter."
    ),
    json: bool = typer.Option(False, "--json", help="Print what the data can tell as plain data."),
) -> None:
    """Make a folder of measured data for `diagnose`, or add to one.

    From photographs, angles, a balance's curves, scans and a drum's sheet of several pours of one condition, each kind
    in the same order of pours. The same folder with another --condition takes one more; which one is fitted and which
    held out is proposed, and what the data can tell is printed.
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
    """The files, and the command that uses them."""
    import shlex

    for path in written:
        typer.echo(f"wrote {path}")
    typer.echo(f"try it: explorer {shlex.join(map(str, command))}")
