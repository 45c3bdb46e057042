"""Look at a recording: a page on 127.0.0.1, or rerun's native viewer."""

from __future__ import annotations

import subprocess
import tempfile
import webbrowser
from collections.abc import Callable
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from explorer.errors import CommandError
from explorer.logs.static_replay import quiet_environment, viewer_program, write_static_replay

HOST = "127.0.0.1"
MAGIC = (b"RRF", b"RRIO")
"""First bytes of a recording: "RRF2" and its successors, and the container of rerun from 0.20 on."""


def check_recording(path: Path) -> None:
    """Raise :class:`CommandError` unless ``path`` is a recording."""
    if not path.is_file():
        raise CommandError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}; a .rrd recording is needed")
    with path.open("rb") as file:
        start = file.read(4)
    if not start.startswith(MAGIC):
        raise CommandError(f"{path}: is not a rerun recording (.rrd)")


def serve_replay(recording: Path, *, port: int, open_browser: bool, announce: Callable[[str], None]) -> None:
    """Serve the recording on 127.0.0.1 until Ctrl-C; ``port`` 0 takes a free one.

    Raises :class:`CommandError` where the port is taken.
    """
    with (
        tempfile.TemporaryDirectory(prefix="explorer-replay-") as folder,
        replay_server(Path(folder), port) as server,
    ):
        write_static_replay(recording, Path(folder))
        address = f"http://{HOST}:{server.server_address[1]}/"
        announce(f"{address}  (Ctrl-C ends it)")
        if open_browser:
            webbrowser.open(address)
        server.serve_forever()


def replay_server(folder: Path, port: int) -> ThreadingHTTPServer:
    """A web server for ``folder`` on 127.0.0.1, not yet running."""
    try:
        return ThreadingHTTPServer((HOST, port), partial(_QuietHandler, directory=str(folder)))
    except OSError as error:
        raise CommandError(f"--port {port}: {error.strerror}; choose another or 0 for a free one") from None


def open_native(recording: Path) -> None:
    """Open rerun's native viewer, its statistics off, and wait until it is closed.

    Raises :class:`CommandError` if it cannot open a window.
    """
    ended = subprocess.run([viewer_program(), str(recording)], env=quiet_environment(), check=False)
    if ended.returncode != 0:
        raise CommandError(
            f"rerun's native viewer ended with {ended.returncode} (no screen?); "
            "without --native the recording opens in a browser"
        )


class _QuietHandler(SimpleHTTPRequestHandler):
    """Serves a folder without a line per request."""

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""
