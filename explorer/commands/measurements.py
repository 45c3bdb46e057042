"""``explorer measurements``: what a measured data set holds, and what it can tell before anything is simulated."""

from __future__ import annotations

import typer

app = typer.Typer(help="Look at measured data.", no_args_is_help=True)


@app.callback()
def measurements() -> None:
    """Look at measured data."""


@app.command()
def check(
    folder: str = typer.Argument(..., metavar="DIR", help="Folder of a measured data set, or a shipped one's name."),
    json: bool = typer.Option(False, "--json", help="Print plain data."),
) -> None:
    """Read measured data and say what they can tell.

    Lists conditions, observables and parameter ranges, what was ignored, and what no amount of fitting could reveal.
    """
    from doe.measurement import load_measurement
    from explorer.files.run_folder import json_text
    from explorer.terminal.measurement import check_result, check_text
    from solver.assets import measurement_folder

    measurement = load_measurement(measurement_folder(folder))
    typer.echo(json_text(check_result(measurement)) if json else check_text(measurement))
