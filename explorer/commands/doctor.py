"""``explorer doctor``: what is missing on this machine, and what that limits."""

from __future__ import annotations

import typer

NOT_READY = 1


def doctor(
    port: int = typer.Option(8080, min=1, max=65535, help="Port to check for the page."),
    json: bool = typer.Option(False, "--json", help="Print plain data."),
) -> None:
    """Say what this machine has, what is missing, what that limits and how to get it.

    Exit code 0 where pouring, calibrating, diagnosing and the page work, 1 where something is missing that they need.
    Nothing is installed, poured or compiled; it takes some seconds.
    """
    from explorer.installation import examined, examined_result, examined_text, ready

    findings = examined(port)
    if json:
        from explorer.files.run_folder import json_text

        typer.echo(json_text(examined_result(findings)))
    else:
        typer.echo(examined_text(findings))
    if not ready(findings):
        raise typer.Exit(NOT_READY)
