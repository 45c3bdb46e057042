"""``explorer limit``: how often could any diagnosis name the right effect, from data of each kind?"""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import STORE, THREADS


def limit(
    source: str = typer.Argument(
        "",
        metavar="[DIR|FILE]",
        help="Folder of measured data (with measurement.toml), or shipped name, of which only the declarations are "
        "used; or file of a made-up laboratory. By default the shipped laboratory.",
    ),
    rounds: int = typer.Option(8, min=1, help="Rounds of reference pours; 8 rounds give 96 pours of each effect."),
    out: Path = typer.Option(
        Path("limit.json"), metavar="FILE", help="File for the effect strengths, the pairs that look alike, the limits."
    ),
    reference: Path = typer.Option(
        Path("reference.npz"),
        metavar="FILE",
        help="File for the features of the pours; rewritten after every round, and continued if it exists.",
    ),
    store: Path | None = STORE,
    threads: int | None = THREADS,
) -> None:
    """Print how often any diagnosis could name the right effect at best (Bayes limit), from many pours of each."""
    from doe.validation.laboratory import TREFOILS
    from explorer.background.reporter import end_as_by_ctrl_c
    from explorer.diagnosis.limit import LimitOrder, limit_text, run_limit
    from solver.assets import measurement_folder

    end_as_by_ctrl_c()
    path = Path(source) if source else TREFOILS
    order = LimitOrder(path if path.is_file() else measurement_folder(source), rounds, out, reference, store, threads)
    typer.echo(limit_text(*run_limit(order, typer.echo)))
