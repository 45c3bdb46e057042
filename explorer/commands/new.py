"""``explorer new``: start a material, a study, a project or measured data of one's own."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Literal

import typer


class StarterKind(StrEnum):
    """What can be started."""

    MATERIAL = "material"
    STUDY = "study"
    PROJECT = "project"
    MEASUREMENT = "measurement"


def new(
    kind: StarterKind = typer.Argument(help="What to start."),
    name: str = typer.Argument(
        metavar="NAME", help="Its name: letters, digits, - and _; of a project or a measurement, a folder."
    ),
    out: Path = typer.Option(Path(), help="Folder to write into."),
    material: str | None = typer.Option(
        None,
        help="Material of a study or measurement: name or file. Of a study by default NAME.toml, written if missing.",
    ),
    like: str | None = typer.Option(None, metavar="MATERIAL", help="A new material starts as this one: name or file."),
    part: list[Path] = typer.Option(
        [], metavar="PART.toml", help="Measured parameters for the new material, from `explorer lab --out`; repeatable."
    ),
    from_liggghts: Path | None = typer.Option(
        None, metavar="FILE", help="A new material from a LIGGGHTS input script: property/global, particletemplate."
    ),
    from_yade: Path | None = typer.Option(
        None, metavar="FILE", help="A new material from a YADE script, which is read, not run: FrictMat, sphere."
    ),
    from_edem: Path | None = typer.Option(
        None, metavar="FILE", help="A new material from a table of EDEM's values, or a folder of `export --to edem`."
    ),
    study: str | None = typer.Option(
        None, help="New measurement: study whose material, set-up and factors the data belong to; or --material."
    ),
    set_: list[str] = typer.Option(
        [], "--set", metavar="PATH=VALUE", help="New measurement: set-up of the condition, rig.… and insertion.…"
    ),
    condition: str | None = typer.Option(
        None, metavar="NAME", help="New measurement: condition that the files are of; A by default."
    ),
    role: Literal["fit", "holdout"] | None = typer.Option(
        None, help="New measurement: of the condition; proposed if not given."
    ),
    photo: list[str] = typer.Option(
        [],
        metavar="FILE",
        help="New measurement: photograph of the next pour's pile (or a shipped one's name), or of a drum's face.",
    ),
    scale: float | None = typer.Option(None, metavar="MM_PER_PX", help="New measurement: pixel of the photographs."),
    angles: str | None = typer.Option(
        None, metavar="A,B,…|FILE.csv[:COLUMN]", help="New measurement: angles in degrees, one for each pour."
    ),
    balance: list[Path] = typer.Option(
        [], metavar="FILE.csv", help="New measurement: time_s and mass_g of a balance, a file for each pour."
    ),
    starts: list[float] = typer.Option(
        [], metavar="S", help="When the flow began on the balance's clock: one for all files, or one for each."
    ),
    lag: float | None = typer.Option(None, min=0.0, metavar="S", help="Lag of the balance, to be taken off its times."),
    scan: list[Path] = typer.Option([], metavar="FILE", help="New measurement: scan of the next pour's pile."),
    scan_unit: Literal["m", "cm", "mm", "um"] | None = typer.Option(
        None, help="Unit of .ply, .stl, .xyz, .txt and .csv scans; m by default."
    ),
    drum: str | None = typer.Option(
        None, metavar="FILE.csv[:COMPONENT]", help="New measurement: sheet of `lab drum`, angles of a rotating drum."
    ),
    uncertainty: list[str] = typer.Option(
        [],
        metavar="NAME=VALUE",
        help="New measurement: standard deviation of one value, where one pour has no scatter.",
    ),
    json: bool = typer.Option(False, "--json", help="New measurement: print what the data can tell as plain data."),
) -> None:
    """Write a commented file that runs as it is, or measured data as a folder.

    NAME.toml for a material, NAME_study.toml for a study (and NAME.toml beside it, where that is missing; a NAME
    that ends in _study means the same); for a project, a folder NAME with both and project.toml. Files that are there
    are never overwritten. From another program's input, how numbers were converted, what was not taken and what is
    assumed is told, and stands at the top of the file.

    A measurement is a folder for `diagnose`: photographs, angles, a balance's curves, scans and a drum's sheet from
    several pours of one condition, each kind in the same order of pours. The same folder with another --condition
    takes one more; which one is fitted and which held out is proposed, and what the data can tell is printed.
    """
    import shlex

    from explorer.errors import CommandError
    from explorer.scene.starter_files import STUDY_ENDING, write_material, write_study

    if kind == StarterKind.MATERIAL and material is not None:
        raise CommandError("--material: belongs to `new study`, `new project` and `new measurement`")
    measured = (study, *set_, role, *photo, scale, angles, *balance, *starts, lag, *scan, drum, *uncertainty)
    measured += (condition, scan_unit)
    if kind != StarterKind.MEASUREMENT and (json or any(one is not None for one in measured)):
        raise CommandError(
            "--study, --set, --photo, --angles, --balance, --scan, --drum, …: belong to `new measurement`"
        )
    inputs = {"liggghts": from_liggghts, "yade": from_yade, "edem": from_edem}
    given = {program: file for program, file in inputs.items() if file is not None}
    if kind != StarterKind.MATERIAL and (like is not None or part or given):
        raise CommandError("--like, --part, --from-…: belong to `new material`")
    if len(given) > 1 or (given and (like is not None or part)):
        raise CommandError(f"--from-{next(iter(given))}: allowed without --like, --part and another --from-…")
    if kind == StarterKind.MEASUREMENT:
        from explorer.files.run_folder import json_text
        from explorer.measured.folder import NewCondition, write_condition, written_text
        from explorer.measured.readings import Brought
        from explorer.terminal.measurement import check_result
        from solver.assets import asset_path

        if scale is not None and not 0.0 < scale < float("inf"):
            raise CommandError(f"--scale {scale:g} mm/px: must be positive and finite")
        asked = NewCondition(condition or "A", role, study, material, tuple(set_), tuple(uncertainty))
        pixel = None if scale is None else 1e-3 * scale
        photographs = tuple(asset_path("photographs", one) for one in photo)
        brought = Brought(
            photographs=photographs,
            pixel=pixel,
            angles=angles,
            balances=tuple(balance),
            starts=tuple(starts),
            lag=lag,
            scans=tuple(scan),
            scan_unit=scan_unit or "m",
            drum=drum,
        )
        found = write_condition(out / name, asked, brought)
        if json:
            plain = {"written": list(map(str, found.files)), "told": list(found.told), "proposal": found.proposal}
            typer.echo(json_text(plain | check_result(found.measurement)))
            return
        typer.echo(written_text(found))
        typer.echo(f"try it: explorer {shlex.join(['diagnose', str(out / name)])}")
        return
    if given:
        from explorer.imported import write_imported

        path, notes = write_imported(out, name, *next(iter(given.items())))
        written = [path]
        for note in notes:
            typer.echo(f"note: {note}")
    elif like is not None or part:
        from explorer.laboratory.part import write_measured_material

        written = [write_measured_material(out, name, like, part)]
    elif kind == StarterKind.PROJECT:
        from explorer.project.project import new_project

        written = new_project(out / name, material)
    else:
        written = [write_material(out, name)] if kind == StarterKind.MATERIAL else write_study(out, name, material)
    for path in written:
        typer.echo(f"wrote {path}")
    file = str(written[-1])
    command = ["simulate", file]
    if kind == StarterKind.STUDY:
        results = Path("results") / written[-1].stem.removesuffix(STUDY_ENDING)
        command = ["calibrate", "--headless", "--study", file, "--profile", "quick", "--out", str(results)]
    if kind == StarterKind.PROJECT:
        command = ["serve", str(out / name)]
    typer.echo(f"try it: explorer {shlex.join(command)}")
