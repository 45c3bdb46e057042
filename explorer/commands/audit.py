"""``explorer audit``: recompute what a published study prints, from its own tables."""

from __future__ import annotations

from pathlib import Path

import typer


def audit(
    folder: Path | None = typer.Argument(
        None,
        metavar="[FOLDER]",
        help="Folder with study.toml and its tables (doe/audit/README.md); the shipped article if not given.",
        show_default=False,
    ),
    json: bool = typer.Option(False, "--json", help="Print every finding as plain data."),
    author: str = typer.Option("", metavar="NAME", help="Who made it, for the report."),
    notes: str = typer.Option("", metavar="TEXT", help="Notes for the report."),
    report: Path | None = typer.Option(
        None, "--report", "--out", metavar="DIR", help="New folder for audit.json, the report, its figures and data."
    ),
) -> None:
    """Recompute every figure of a published calibration study that can be recomputed.

    Each is reproduced exactly, only if the runs or other inputs were rounded (with the slack), differs (with the
    recomputed value and how it came about), or cannot be checked (with the reason). Exit code 0 whatever was found.
    """
    from doe.audit import audit_study
    from explorer.audit.read_study import read_study, shipped_study
    from explorer.audit.report import audit_text, write_audit
    from explorer.files.run_folder import appearing, json_text
    from explorer.files.run_result import made_today

    found = audit_study(read_study(shipped_study() if folder is None else folder))
    if report is not None:
        with appearing(report, "--report") as temporary:
            write_audit(found, temporary, made_today(author, notes))
    typer.echo(json_text(found.to_dict()) if json else audit_text(found))
    if report is not None:
        typer.echo(f"{report}/report.html, report.md, audit.json", err=True)
