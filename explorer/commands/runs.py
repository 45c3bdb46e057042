"""`explorer runs`: what the store holds."""

from __future__ import annotations

import sys
from pathlib import Path

import typer


def runs(
    csv: bool = typer.Option(False, "--csv", help="Write every run as CSV to standard output."),
    study: str | None = typer.Option(None, help="Only the runs of this study."),
    store: Path | None = typer.Option(None, help="SQLite file that keeps the runs."),
) -> None:
    """List or export the stored runs."""
    from doe.store import Store, default_store, write_csv
    from explorer.errors import CommandError
    from explorer.tables.text_table import text_table

    path = store or default_store()
    if not path.is_file():
        raise CommandError(f"{path}: no store of runs there yet; `explorer calibrate --headless` makes one")
    kept = Store(path)
    if csv:
        write_csv(kept.runs(study), sys.stdout)
        return
    counted: dict[tuple[str, str, str], int] = {}
    for run in kept.runs(study):
        counted[run.study, run.stage, run.outcome] = counted.get((run.study, run.stage, run.outcome), 0) + 1
    rows = [[*key, str(number)] for key, number in counted.items()]
    typer.echo(text_table(["study", "stage", "outcome", "runs"], rows))
