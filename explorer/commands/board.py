"""``explorer board``: a study or a diagnosis on one page, finished or at work, without a pour."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.serve import HOST, TOKEN


def board(
    folder: Path = typer.Argument(help="Output folder of `explorer calibrate` or `explorer diagnose`."),
    port: int = typer.Option(8080, min=0, max=65535, help="Port of the page; 0 takes a free one."),
    host: str = HOST,
    token: str | None = TOKEN,
) -> None:
    """Show verdict, charts, answers and runs of a study or a diagnosis; what still runs is followed."""
    from explorer.viewer.app import board as serve_board

    serve_board(folder, host=host, port=port, token=token)
