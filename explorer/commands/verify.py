"""``explorer verify``: the solver beside closed forms, conservation laws and a published benchmark."""

from __future__ import annotations

from pathlib import Path

import typer


def verify(
    only: list[str] = typer.Option([], metavar="NAME", help="Run only this part, e.g. T4; may be repeated."),
    json: Path | None = typer.Option(None, "--json", metavar="FILE", help="Write every row to this file."),
    every: bool = typer.Option(False, "--all", help="Print every point, not only the furthest of each curve."),
) -> None:
    """Check the solver against known answers.

    Chung & Ooi (2011) T1 to T8, restitution and invariants. Exit code 0 if every limit is kept, 1 if not; a row
    without a limit is shown for comparison.
    """
    from explorer.errors import CommandError
    from explorer.files.run_folder import json_text
    from explorer.files.whole_file import write_whole
    from explorer.tables.verification import result_of, summary_text, table_text
    from solver.verification import FAMILIES
    from solver.verification import verify as rows_of

    by_lower_case = {name.lower(): name for name in FAMILIES}
    for name in only:
        if name.lower() not in by_lower_case:
            raise CommandError(f"--only: {name!r} is not one of {', '.join(FAMILIES)}")
    if json and not json.absolute().parent.is_dir():
        raise CommandError(f"--json: {json}: no folder {json.absolute().parent}")
    wanted = {by_lower_case[name.lower()] for name in only}
    rows = list(rows_of([name for name in FAMILIES if name in wanted or not wanted]))
    if json:
        write_whole(json, json_text(result_of(rows)) + "\n")
    typer.echo(table_text(rows, every))
    typer.echo(summary_text(rows))
    if not all(row.passed for row in rows):
        raise typer.Exit(1)
