"""Look at a recording: a page on 127.0.0.1, a folder that any web server can show, or rerun's native viewer.

The web viewer is part of the rerun package and is handed out only by its own server, so that is started for the moment
it takes to copy three files. Its page asks other hosts for fonts, news and statistics; the copy is not allowed to.
"""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import rerun_cli  # type: ignore[import-untyped]

from explorer.errors import CommandError

RECORDING_NAME = "recording.rrd"
VIEWER_FILES = ("re_viewer.js", "re_viewer_bg.wasm")
START_LIMIT = 20.0
"""Wall time [s] that the viewer's server may take to answer."""
# The viewer is WebAssembly and starts from an inline script; everything comes from the folder itself.
POLICY = (
    "default-src 'self' data: blob:; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; connect-src 'self' data: blob:"
)
OPENING = f"""<meta http-equiv="Content-Security-Policy" content="{POLICY}">
    <script>
      if (!new URLSearchParams(location.search).has("url")) {{
        location.replace("?url=" + encodeURIComponent(new URL("{RECORDING_NAME}", location.href)));
      }}
    </script>"""
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


class _QuietHandler(SimpleHTTPRequestHandler):
    """Serves a folder without a line per request."""

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


def write_static_replay(recording: Path, folder: Path) -> None:
    """Fill ``folder`` with the viewer, a page that opens the recording, and a copy of the recording."""
    with _viewer_server() as address:
        page = _fetch(f"{address}/").decode("utf-8")
        for name in VIEWER_FILES:
            (folder / name).write_bytes(_fetch(f"{address}/{name}"))
    (folder / "index.html").write_text(replay_page(page), encoding="utf-8")
    shutil.copyfile(recording, folder / RECORDING_NAME)


def replay_page(viewer_page: str) -> str:
    """The viewer's page, opening the recording beside it and confined to its own host.

    Raises :class:`CommandError` if the page is not the one that this program knows how to change.
    """
    if viewer_page.count("<head>") != 1:
        raise CommandError("rerun's viewer page has no <head>: this version of rerun-sdk is not supported")
    return viewer_page.replace("<head>", f"<head>\n    {OPENING}")


@contextmanager
def _viewer_server() -> Iterator[str]:
    """Address of rerun's web viewer, served on 127.0.0.1 while the block runs."""
    page, data = _free_port(), _free_port()
    command = [viewer_program(), "--serve-web", "--bind", "127.0.0.1"]
    command += ["--web-viewer-port", str(page), "--port", str(data)]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=quiet_environment())
    try:
        address = f"http://127.0.0.1:{page}"
        _wait_for(address, server)
        yield address
    finally:
        server.terminate()
        server.wait()


def _wait_for(address: str, server: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + START_LIMIT
    while time.monotonic() < deadline and server.poll() is None:
        try:
            _fetch(f"{address}/re_viewer.js")
            return
        except OSError:  # refused, or reset while the server starts
            time.sleep(0.05)
    raise CommandError(f"rerun's web viewer does not start ({viewer_program()})")


def _fetch(url: str) -> bytes:
    # No proxy: an environment's proxy could not reach this machine's own address.
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with opener.open(url, timeout=START_LIMIT) as answer:
        content: bytes = answer.read()
    return content


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return port


def open_native(recording: Path) -> None:
    """Open rerun's native viewer, its statistics off, and wait until it is closed.

    Raises :class:`CommandError` if it cannot open a window.
    """
    ended = subprocess.run([viewer_program(), str(recording)], env=quiet_environment(), check=False)
    if ended.returncode != 0:
        raise CommandError(
            f"rerun's native viewer ended with exit code {ended.returncode} (no screen?); "
            "without --native the recording opens in a browser"
        )


def viewer_program() -> str:
    """Path of rerun's own binary. The script `rerun` is a wrapper that leaves it running when it is ended."""
    name = "rerun.exe" if os.name == "nt" else "rerun"
    return str(Path(rerun_cli.__file__).with_name(name))


def quiet_environment() -> dict[str, str]:
    """This process's environment with rerun's statistics switched off, for one child only.

    rerun sends none where ``CI`` is set ("Analytics disabled on CI", 0.41). Its other switch is a file among
    the user's settings, which are not ours to change.
    """
    return {**os.environ, "CI": "1"}
