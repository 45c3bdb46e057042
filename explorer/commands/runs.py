"""``explorer runs``: list or export the stored runs."""

from __future__ import annotations

import sys
from pathlib import Path

import typer

from explorer.commands.shared_options import STORE


def runs(
    csv: bool = typer.Option(False, "--csv", help="Write every run as CSV to standard output."),
    study: str | None = typer.Option(None, metavar="NAME", help="Only the runs of this study."),
    store: Path | None = STORE,
) -> None:
    """List or export the stored runs, as read by this version of the program."""
    from doe.store import Store, StoreError, default_store, observables_in_rig, observables_of, write_csv
    from explorer.errors import CommandError
    from explorer.terminal.text_table import text_table

    path = store or default_store()
    # The default folder holds one store file for each version of the physics.
    others = sorted(set(path.parent.glob("*.sqlite")) - {path}) if store is None else []
    if path.is_dir():
        raise CommandError(f"--store {path}: is a folder; name the file of a store")
    if not path.is_file():
        beside = f"; other stores there: {', '.join(other.name for other in others)}" if others else ""
        raise CommandError(f"{path}: no store of runs there yet; `explorer calibrate --headless` makes one{beside}")
    kept = Store(path, pouring=False)
    if study is not None and not any(True for _ in kept.runs(study)):
        raise CommandError(
            f"--study {study}: no runs of this study in {path}; `explorer runs --store {path}` lists its studies"
        )
    if csv:
        # List all runs before reading any: new readings are written back to the store.
        write_csv(
            [kept.read(run, observables_in_rig(run), observables_of) for run in list(kept.runs(study))], sys.stdout
        )
        return
    typer.echo(f"{path}: {kept.version}")
    counted: dict[tuple[str, str, str], int] = {}
    for run in kept.runs(study):
        counted[run.study, run.stage, run.outcome] = counted.get((run.study, run.stage, run.outcome), 0) + 1
    rows = [[*key, str(number)] for key, number in counted.items()]
    typer.echo(text_table(["study", "stage", "outcome", "runs"], rows))
    for other in others:
        try:
            typer.echo(f"{other.name}: {Store(other, pouring=False).version}; `--store {other}` lists it")
        except StoreError as error:
            typer.echo(f"note: {error}", err=True)
