"""``explorer measure``: the angle of repose from photographs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import typer

FAILURE = 1


def measure(
    photos: list[str] = typer.Argument(
        metavar="PHOTO...", help="JPEG, PNG, TIFF, BMP or WebP of one pile from the side; or a shipped one's name."
    ),
    scale: float | None = typer.Option(None, metavar="MM_PER_PX", help="Length of a pixel in mm."),
    reference_length: float | None = typer.Option(
        None, metavar="MM", help="Length in mm of the one straight bar in the picture, or between --reference."
    ),
    reference: str | None = typer.Option(
        None, metavar="X0,Y0,X1,Y1", help="Ends of the reference length in px, from the top left corner."
    ),
    baseline: str = typer.Option(
        "auto", metavar="auto|Y0,Y1", help="Plate in px from the top, at the left and the right edge of the picture."
    ),
    checkerboard: str | None = typer.Option(
        None, metavar="PHOTO", help="A printed checkerboard by the same camera: its corners tell the lens, taken out."
    ),
    json: bool = typer.Option(False, "--json", help="Print plain data, with the profiles, and nothing else."),
    plot: Path | None = typer.Option(None, metavar="FILE.png", help="New file: the pictures with what was read."),
    outline: Path | None = typer.Option(
        None, metavar="FILE.csv", help="New file: the outline, for the page to lay over a simulated pile."
    ),
    target: Path | None = typer.Option(
        None,
        metavar="DIR|STUDY.toml",
        help="Keep the pictures in this folder, for `calibrate --target`; or write mean, SD and n into this study.",
    ),
    report: Path | None = typer.Option(None, metavar="DIR", help="New folder for the report, its figures and data."),
    author: str = typer.Option("", metavar="NAME", help="Who made it, for the report."),
    notes: str = typer.Option("", metavar="TEXT", help="Notes for the report."),
    from_simulation: str | None = typer.Option(
        None,
        metavar="SOURCE",
        help="Beside it a simulated pile, read alike: pile_*.npz, a folder of simulate --out, or what simulate takes.",
    ),
) -> None:
    """Read the angle of repose off photographs of a pile.

    Exit code 1 where a picture shows no pile that could be read; the line says why.
    """
    from doe.studies.study import load_study
    from explorer.errors import CommandError
    from explorer.files.output_file import check_vacant
    from explorer.files.run_folder import appearing, json_text
    from explorer.photograph.run import measure_order, run_measure
    from explorer.photograph.target import check_targets, keep_target, write_into_study
    from explorer.terminal.photograph import measure_result, measure_text, refusal_lines

    order = measure_order(
        photos, scale, reference_length, reference, baseline, plot, outline, from_simulation, checkerboard
    )
    _refuse_twins(order.pictures)
    if report is not None:
        check_vacant(report, "--report")
    study = target if target is not None and target.suffix == ".toml" and not target.is_dir() else None
    if study is not None:
        if not study.is_file():
            raise CommandError(f"--target {study}: no such study; `explorer new study NAME` writes one")
        check_targets(load_study(str(study)).targets)
    measured = run_measure(order)
    if report is not None:
        from explorer.photograph.result import photograph_result
        from explorer.report.folder import write_report
        from explorer.report.photograph import photograph_report, read_picture

        result = photograph_result(measured, author, notes)
        text = json_text(result.to_dict()) + "\n"
        with appearing(report, "--report") as folder:
            write_report(photograph_report(result, read_picture(order, measured)), folder, {result.NAME: text})
    if target is not None and not measured.refusals:
        line = (
            write_into_study(study, order.pictures, measured)
            if study is not None
            else f"{target}: {keep_target(target, order.pictures, measured).line}"
        )
        typer.echo(line, err=json)
    if json:
        typer.echo(json_text(measure_result(measured)))
    else:
        typer.echo(measure_text(measured))
    for line in refusal_lines(measured.refusals):
        typer.echo(line, err=True)
    if measured.refusals:
        raise typer.Exit(FAILURE)


def _refuse_twins(pictures: Sequence[Path]) -> None:
    """Raise CommandError where a picture stands twice, under whatever name: a pile would be counted as two."""
    from explorer.errors import CommandError

    seen: dict[bytes, Path] = {}
    for picture in pictures:
        if (twin := seen.setdefault(picture.read_bytes(), picture)) is not picture:
            raise CommandError(f"{picture}: is the same picture as {twin}; name each pile once")
