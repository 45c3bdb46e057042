"""``explorer measurements``: what a measured data set contains and can identify, before anything is simulated."""

from __future__ import annotations

import typer

from explorer.commands.shared_options import RESULT_JSON

app = typer.Typer(help="Check measured data.", no_args_is_help=True)


@app.callback()
def measurements() -> None:
    """Check measured data."""


@app.command()
def check(
    folder: str = typer.Argument(
        ..., metavar="DIR", help="Folder of measured data (with measurement.toml), or shipped name."
    ),
    json: bool = RESULT_JSON,
) -> None:
    """Read measured data and report what they can and cannot identify.

    Lists conditions, observables, parameter ranges and ignored data, and what no fit could reveal.
    """
    from doe.measurement import load_measurement
    from explorer.files.run_folder import json_text
    from explorer.terminal.measurement import check_result, check_text
    from solver.assets import measurement_folder

    measurement = load_measurement(measurement_folder(folder))
    typer.echo(json_text(check_result(measurement)) if json else check_text(measurement))
