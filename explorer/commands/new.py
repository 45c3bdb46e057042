"""``explorer new``: start a material, a study or a project of one's own."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path

import typer


class StarterKind(StrEnum):
    """What can be started."""

    MATERIAL = "material"
    STUDY = "study"
    PROJECT = "project"


def new(
    kind: StarterKind = typer.Argument(help="What to start."),
    name: str = typer.Argument(metavar="NAME", help="Its name: letters, digits, - and _; of a project, a folder."),
    out: Path = typer.Option(Path(), help="Folder to write into."),
    material: str | None = typer.Option(
        None,
        help="Material of the study: name or file. By default NAME.toml beside it, written if it is missing.",
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
) -> None:
    """Write a commented file that runs as it is.

    NAME.toml for a material, NAME_study.toml for a study (and NAME.toml beside it, where that is missing; a NAME
    that ends in _study means the same); for a project, a folder NAME with both and project.toml. Files that are there
    are never overwritten. From another program's input, how numbers were converted, what was not taken and what is
    assumed is told, and stands at the top of the file.
    """
    import shlex

    from explorer.errors import CommandError
    from explorer.scene.starter_files import STUDY_ENDING, write_material, write_study

    if kind == StarterKind.MATERIAL and material is not None:
        raise CommandError("--material: belongs to `new study` and `new project`")
    inputs = {"liggghts": from_liggghts, "yade": from_yade, "edem": from_edem}
    given = {program: file for program, file in inputs.items() if file is not None}
    if kind != StarterKind.MATERIAL and (like is not None or part or given):
        raise CommandError("--like, --part, --from-…: belong to `new material`")
    if len(given) > 1 or (given and (like is not None or part)):
        raise CommandError(f"--from-{next(iter(given))}: allowed without --like, --part and another --from-…")
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
