"""``explorer replay``: play a recording."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import PORT_HELP


def replay(
    recording: Path = typer.Argument(metavar="FILE.rrd", help="Recording to play."),
    port: int = typer.Option(0, min=0, max=65535, help=PORT_HELP),
    native: bool = typer.Option(False, "--native", help="Open rerun's native viewer instead of a page."),
    static: Path | None = typer.Option(
        None, metavar="DIR", help="Only write a new folder that any web server can serve."
    ),
    no_browser: bool = typer.Option(
        False, "--no-browser", help="Print the address of the page without opening a browser."
    ),
) -> None:
    """Play a recording.

    It is shown in the browser, served on 127.0.0.1 until Ctrl-C, or in rerun's native viewer, with rerun's usage
    statistics switched off.
    """
    from explorer.errors import CommandError
    from explorer.files.run_folder import appearing
    from explorer.recordings.replay import check_recording, open_native, serve_replay, write_static_replay

    if native and static:
        raise CommandError("--native and --static exclude each other")
    if (native or static) and (port or no_browser):
        raise CommandError("--port, --no-browser: not allowed with --native or --static, which open no page")
    check_recording(recording)
    if native:
        open_native(recording)
    elif static:
        with appearing(static) as folder:
            write_static_replay(recording, folder)
        typer.echo(f"wrote {static}: serve it with any web server, such as `python -m http.server -d {static}`")
    else:
        serve_replay(recording, port=port, open_browser=not no_browser, announce=typer.echo)
