"""``explorer audit``: recompute what a published study prints, from its own tables."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import AUTHOR, NOTES, RESULT_JSON, report_option


def audit(
    folder: Path | None = typer.Argument(
        None,
        metavar="[FOLDER]",
        help="Folder with study.toml and its tables (doe/audit/README.md); by default the shipped article.",
        show_default=False,
    ),
    json: bool = RESULT_JSON,
    author: str = AUTHOR,
    notes: str = NOTES,
    report: Path | None = report_option("audit.json", "--report", "--out"),
) -> None:
    """Recompute the figures of a published calibration study from its own tables.

    Each figure is reproduced exactly, reproduced only if the runs or other inputs were rounded (with the slack),
    different (with the recomputed value and its derivation) or not checkable (with the reason). The exit code is 0
    whatever is found.
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
