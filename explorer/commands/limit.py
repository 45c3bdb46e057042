"""``explorer limit``: how often could any diagnosis name the right effect, from data of each kind?"""

from __future__ import annotations

from pathlib import Path

import typer


def limit(
    source: str = typer.Argument(
        "",
        metavar="[DIR|FILE]",
        help="Folder with measurement.toml, or a shipped data set's name; only what it declares is used. Or a made-up "
        "laboratory's file; the shipped one if not given.",
    ),
    rounds: int = typer.Option(8, min=1, help="Rounds of reference pours; 8 give 96 of each effect."),
    out: Path = typer.Option(Path("limit.json"), help="File for the strengths, the pairs that look alike, the limits."),
    reference: Path = typer.Option(
        Path("reference.npz"), help="File of the pours' features; written after every round, and gone on with."
    ),
    store: Path | None = typer.Option(None, help="SQLite file that keeps every pour."),
    threads: int | None = typer.Option(None, min=1, help="Worker processes; one per core if not given."),
) -> None:
    """Pour every effect many times and print the Bayes limit: what scalars, profiles and scans can tell at best."""
    from doe.validation.laboratory import TREFOILS
    from explorer.background.reporter import end_as_by_ctrl_c
    from explorer.diagnosis.limit import LimitOrder, limit_text, run_limit
    from solver.assets import measurement_folder

    end_as_by_ctrl_c()
    path = Path(source) if source else TREFOILS
    order = LimitOrder(path if path.is_file() else measurement_folder(source), rounds, out, reference, store, threads)
    typer.echo(limit_text(*run_limit(order, typer.echo)))
