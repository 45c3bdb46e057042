"""``explorer report``: the report of finished folders, one or several joined."""

from __future__ import annotations

from pathlib import Path

import typer


def report(
    folders: list[Path] = typer.Argument(
        metavar="FOLDER...",
        help="Of calibrate, diagnose, or --report of another command; or a project, for all of its.",
    ),
    out: Path = typer.Option(..., metavar="DIR", help="New folder for the report, its figures and data."),
    title: str = typer.Option("", metavar="TEXT", help="Of the report; that of the last stage if not given."),
    author: str = typer.Option("", metavar="NAME", help="Who made it, for the report."),
    notes: str = typer.Option("", metavar="TEXT", help="Notes for the report."),
) -> None:
    """Join an audit, photographs, bench tests, designs, calibration and diagnosis in one report.

    Of one folder the report is made again, with today's figures.
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
