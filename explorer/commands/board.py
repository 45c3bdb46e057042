"""``explorer board``: a study or a diagnosis on one page, finished or at work, without a pour."""

from __future__ import annotations

from pathlib import Path

import typer


def board(
    folder: Path = typer.Argument(help="Output folder of `explorer calibrate` or `explorer diagnose`."),
    port: int = typer.Option(8080, min=0, max=65535, help="Port of the page; 0 takes a free one."),
    host: str = typer.Option("127.0.0.1", help="Address to listen on; one that others can reach needs a token."),
    token: str | None = typer.Option(
        None,
        envvar="EXPLORER_TOKEN",
        help="What a browser has to show, 16 characters or more. On the command line other users of this machine can "
        "read it: better in the environment.",
    ),
) -> None:
    """Show verdict, charts, answers and runs of a study or a diagnosis; what still runs is followed."""
    from explorer.viewer.app import board as serve_board

    serve_board(folder, host=host, port=port, token=token)
