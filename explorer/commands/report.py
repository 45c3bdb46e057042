"""``explorer report``: one report of one or several finished folders."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import AUTHOR, NOTES


def report(
    folders: list[Path] = typer.Argument(
        metavar="FOLDER...",
        help="Output folder of calibrate or diagnose, folder of --report, or project (all of its folders).",
    ),
    out: Path = typer.Option(..., metavar="DIR", help="New folder for the report, its figures and data."),
    title: str = typer.Option("", metavar="TEXT", help="Title of the report; by default that of the last stage."),
    author: str = AUTHOR,
    notes: str = NOTES,
) -> None:
    """Join the results of an audit, photographs, bench tests, designs, calibration and diagnosis in one report.

    The report of a single folder is remade with the figures of this version of the program.
    """
    from explorer.files.output_file import check_vacant
    from explorer.files.run_folder import appearing
    from explorer.files.run_result import made_today
    from explorer.report.folder import write_report
    from explorer.report.project import finished_folders, project_report

    check_vacant(out)
    made = project_report(
        [one for folder in folders for one in finished_folders(folder)], title, made_today(author, notes)
    )
    with appearing(out) as folder:
        missing = write_report(made, folder)
    typer.echo(f"{out}/report.html, report.md")
    if missing:
        typer.echo(missing)
