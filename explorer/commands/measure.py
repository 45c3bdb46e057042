"""``explorer measure``: the angle of repose from photographs."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import AUTHOR, NOTES, report_option

FAILURE = 1


def measure(
    photos: list[str] = typer.Argument(
        metavar="PHOTO...",
        help="Photograph of one pile from the side (JPEG, PNG, TIFF, BMP or WebP): file or shipped name.",
    ),
    scale: float | None = typer.Option(None, metavar="MM_PER_PX", help="Length of a pixel [mm]."),
    reference_length: float | None = typer.Option(
        None,
        metavar="MM",
        help="Length [mm] of the only straight bar in the picture, or between the ends given by --reference.",
    ),
    reference: str | None = typer.Option(
        None, metavar="X0,Y0,X1,Y1", help="Ends of --reference-length [px], from the top left corner."
    ),
    baseline: str = typer.Option(
        "auto",
        metavar="auto|Y0,Y1",
        help="Height of the plate at the left and right edges of the picture [px from the top]; the lens is then "
        "corrected with --checkerboard only.",
    ),
    checkerboard: str | None = typer.Option(
        None,
        metavar="PHOTO",
        help="Photograph of a printed checkerboard from the same camera, for correcting lens distortion.",
    ),
    json: bool = typer.Option(False, "--json", help="Print the result as JSON, with the profiles, and nothing else."),
    plot: Path | None = typer.Option(
        None, metavar="FILE.png", help="New picture of the photographs with the readings drawn in."
    ),
    outline: Path | None = typer.Option(
        None, metavar="FILE.csv", help="New file for the outline, which the page can show over a simulated pile."
    ),
    target: Path | None = typer.Option(
        None,
        metavar="DIR|STUDY.toml",
        help="Folder that stores the photographs for `explorer calibrate --target`; or study into which mean, SD and n "
        "are written.",
    ),
    report: Path | None = report_option("photograph.json", "--report"),
    author: str = AUTHOR,
    notes: str = NOTES,
    from_simulation: str | None = typer.Option(
        None,
        metavar="SOURCE",
        help="Also read a simulated pile in the same way: pile_*.npz, a folder of `explorer simulate --out`, or "
        "any source that `explorer simulate` accepts.",
    ),
) -> None:
    """Read the angle of repose from photographs of piles.

    The exit code is 1 if a picture shows no readable pile; the message gives the reason.
    """
    from doe.studies.study import load_study
    from explorer.errors import CommandError
    from explorer.files.output_file import check_vacant
    from explorer.files.run_folder import appearing, json_text
    from explorer.photograph.run import measure_order, run_measure, write_drawings
    from explorer.photograph.target import check_targets, keep_target, write_into_study
    from explorer.terminal.photograph import measure_result, measure_text, refusal_lines

    order = measure_order(
        photos, scale, reference_length, reference, baseline, plot, outline, from_simulation, checkerboard
    )
    if report is not None:
        check_vacant(report, "--report")
    elif author or notes:
        raise CommandError("--author and --notes: are printed in a report; add --report DIR")
    study = target if target is not None and target.suffix.lower() == ".toml" and not target.is_dir() else None
    if study is not None:
        if not study.is_file():
            raise CommandError(f"--target {study}: no such study; `explorer new study NAME` writes one")
        check_targets(load_study(str(study)).targets)
    measured = run_measure(order)
    # The target first: it alone may refuse what was measured, and files written before would be in the way next time.
    if target is not None and not measured.refusals:
        line = (
            write_into_study(study, measured)
            if study is not None
            else f"{target}: {keep_target(target, order.pictures, measured).line}"
        )
        typer.echo(line, err=json)
    write_drawings(order, measured)
    if report is not None:
        from explorer.photograph.result import photograph_result
        from explorer.report.folder import write_report
        from explorer.report.photograph import photograph_report, read_picture

        result = photograph_result(measured, author, notes)
        text = json_text(result.to_dict()) + "\n"
        with appearing(report, "--report") as folder:
            write_report(photograph_report(result, read_picture(order, measured)), folder, {result.NAME: text})
    if json:
        typer.echo(json_text(measure_result(measured)))
    else:
        typer.echo(measure_text(measured))
    for line in refusal_lines(measured.refusals):
        typer.echo(line, err=True)
    if measured.refusals:
        if target is not None:
            typer.echo(f"--target {target}: nothing is written while a picture has no angle", err=True)
        raise typer.Exit(FAILURE)
