"""``explorer validate-diagnosis``: how often the diagnosis finds what made-up laboratories hide from it."""

from __future__ import annotations

from pathlib import Path

import typer


def validate_diagnosis(
    n: int = typer.Option(327, "--n", min=1, help="Data sets; 327 are three rounds of all cases."),
    out: Path = typer.Option(Path("validation"), help="Folder for sets.csv, one row per data set."),
    minutes: float | None = typer.Option(
        None, min=0.0, help="Stop after so long; the same command goes on. 0: only the table of what is there."
    ),
    store: Path | None = typer.Option(None, help="SQLite file that keeps every pour."),
    threads: int | None = typer.Option(None, min=1, help="Worker processes; one per core if not given."),
) -> None:
    """Diagnose made-up data with known truths and print how often the answer is right."""
    import math

    from doe.validation.campaign import CampaignOrder, run_campaign
    from explorer.tables.validation import campaign_text

    order = CampaignOrder(out, n, store, minutes if minutes is not None else math.inf, threads)
    typer.echo(campaign_text(run_campaign(order, typer.echo)))
