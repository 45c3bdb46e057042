"""Options that several commands have, each declared once."""

from __future__ import annotations

from typing import Any

import typer

AUTHOR = typer.Option("", metavar="NAME", help="Author named in the report.")
NOTES = typer.Option("", metavar="TEXT", help="Remarks printed in the report.")

STORE_HELP = "SQLite file that stores the pours; by default $REPOSE_STORE or a file in the user's data directory."
STORE = typer.Option(None, "--store", metavar="FILE", help=STORE_HELP)
THREADS = typer.Option(None, min=1, metavar="N", help="Number of simultaneous pours; by default one per CPU core.")
SCHEDULER = typer.Option("", metavar="tcp://…", help="Run the pours on the workers of this Dask scheduler.")
RESUME = typer.Option(False, "--resume", help="Continue in an output folder that is not empty.")

SCENE_HELP = "Name of a rig, or file or shipped name of a material, set-up or study."
RIG_MATERIAL = typer.Option(None, metavar="MATERIAL", help="Material in the rig: file or shipped name.")
SET = typer.Option(
    [], "--set", metavar="PATH=VALUE", help="Set a parameter (`explorer parameters` lists them); repeatable."
)

RESULT_JSON = typer.Option(False, "--json", help="Print the result as JSON and nothing else.")
EVENTS_HELP = "Print progress events, one JSON object per line, and nothing else; messages go to standard error."
EVENTS = typer.Option(False, "--json", "--events", help=EVENTS_HELP)

PORT_HELP = "Port of the page; 0 picks a free one."
PORT = typer.Option(8080, min=0, max=65535, help=PORT_HELP)
HOST = typer.Option("127.0.0.1", help="Address to listen on; an address that others can reach requires a token.")
TOKEN = typer.Option(
    None,
    envvar="EXPLORER_TOKEN",
    help="Token that a browser must present, at least 16 characters. Prefer the environment variable: other users of "
    "this machine can read the command line.",
)


def parts_of(text: str) -> tuple[str, ...]:
    """The parts of an option that is a list with commas."""
    return tuple(part.strip() for part in text.split(",") if part.strip())


def report_option(result: str, *names: str) -> Any:
    """Return the option, with these ``names``, for a new folder with a report and its data file ``result``."""
    text = f"New folder for the report, its figures and data, and {result}."
    return typer.Option(None, *names, metavar="DIR", help=text)
