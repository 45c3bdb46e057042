"""A recording on a page of its own, beside the live page and in its process: no other program has to be started."""

from __future__ import annotations

import threading
from pathlib import Path

from explorer.viewer.guarded_server import address, guarded_server

LABEL = "Replay"


class ReplayBeside:
    """Serves ``recording`` on a free port of ``host`` until it is closed; plays when the first browser comes.

    Raises :class:`explorer.errors.CommandError` where it cannot be read.
    """

    def __init__(self, recording: Path, host: str) -> None:
        # Imported here: rerun takes a second to load, and most sessions are not replayed.
        from explorer.logs.recording_reader import read_recording
        from explorer.viewer.replay.replay_page import ReplayPage

        read = read_recording(recording)
        self._server, self._stop = guarded_server(host, 0, LABEL), threading.Event()
        page = ReplayPage(self._server, read, recording.name)
        self.address = f"http://{address(host)}:{self._server.get_port()}"
        self.seconds = float(read.times[-1]) - read.zero
        """How much it holds [s]."""
        self._loop = threading.Thread(target=page.run, args=(self._stop,), daemon=True, name="explorer-replay")
        self._loop.start()

    def close(self) -> None:
        """End the page."""
        self._stop.set()
        self._loop.join()
        self._server.stop()
