"""``explorer board``: show a finished or running study or diagnosis on one page, without a pour."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import HOST, PORT, TOKEN


def board(
    folder: Path = typer.Argument(
        metavar="FOLDER", help="Output folder of `explorer calibrate` or `explorer diagnose`."
    ),
    port: int = PORT,
    host: str = HOST,
    token: str | None = TOKEN,
) -> None:
    """Show the verdict, charts, answers and runs of a finished or running study or diagnosis on one page."""
    from explorer.viewer.app import board as serve_board

    serve_board(folder, host=host, port=port, token=token)
