"""``explorer store``: maintain the files that store pours."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import STORE

app = typer.Typer(help="Maintain the store of pours.", no_args_is_help=True)
FAILURE = 1
STUDY = typer.Option(..., metavar="NAME", help="Name of the study, as listed by `explorer runs`.")


@app.callback()
def store() -> None:
    """Maintain the store of pours."""


@app.command()
def check(file: Path | None = STORE) -> None:
    """Check that every page and raw pour can be read; exit with 1 if anything is damaged."""
    from doe import store_upkeep
    from doe.store import default_store

    path = file or default_store()
    found = store_upkeep.check(path)
    made = f"physics {found.physics}" if found.physics else "readings without raw pours"
    typer.echo(f"{path}: {made}, {sum(found.runs.values())} runs, {found.size / 1e6:.1f} MB")
    for study, number in sorted(found.runs.items()):
        typer.echo(f"  {study}: {number}")
    for line in found.damaged:
        typer.echo(f"damaged: {line}", err=True)
    if found.damaged:
        raise typer.Exit(FAILURE)
    typer.echo("intact: every raw pour can be read")


@app.command()
def export(
    to: Path = typer.Argument(..., metavar="NEW.sqlite", help="New store file for the copies."),
    study: str = STUDY,
    file: Path | None = STORE,
) -> None:
    """Copy a study's runs into a new store; to export readings as a table use `explorer runs --csv`."""
    from doe import store_upkeep
    from doe.store import default_store

    number = store_upkeep.export(file or default_store(), to, study)
    typer.echo(f"{to}: {number} runs of {study}")


@app.command()
def merge(
    other: Path = typer.Argument(..., metavar="OTHER.sqlite", help="Store file whose runs are added."),
    file: Path | None = STORE,
) -> None:
    """Add the runs of another store, such as another machine's; runs in both are stored once."""
    from doe import store_upkeep
    from doe.store import default_store

    path = file or default_store()
    found = store_upkeep.merge(path, other)
    typer.echo(f"{path}: {found.added} runs added, {found.known} were there already")


@app.command()
def prune(
    study: str = STUDY,
    file: Path | None = STORE,
    yes: bool = typer.Option(
        False, "--yes", help="Remove the runs; without this option their number is printed and nothing is removed."
    ),
) -> None:
    """Remove a study's runs and free their disk space."""
    from doe import store_upkeep
    from doe.store import default_store

    path = file or default_store()
    if not yes:
        number = store_upkeep.count(path, study)
        typer.echo(f"{path}: {number} runs of {study} would be removed; add --yes")
        return
    before = store_upkeep.size(path)
    number = store_upkeep.prune(path, study)
    freed = max(0, before - store_upkeep.size(path))
    typer.echo(f"{path}: {number} runs of {study} removed, {freed / 1e6:.1f} MB given back")
