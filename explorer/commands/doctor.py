"""``explorer doctor``: what is missing on this machine, and what that limits."""

from __future__ import annotations

import typer

from explorer.commands.shared_options import RESULT_JSON

NOT_READY = 1


def doctor(
    port: int = typer.Option(8080, min=1, max=65535, help="Port of the page, checked for availability."),
    json: bool = RESULT_JSON,
) -> None:
    """List what this machine has, what is missing, what that limits and how to get it.

    The exit code is 0 if pouring, calibrating, diagnosing and the page work, and 1 if they need something that is
    missing. Nothing is installed, poured or compiled; the check takes a few seconds.
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
