"""Recordings of the moving scene: begun, ended, downloaded and replayed by the user.

A replay is a page of its own beside the live page and in the same process: no other program has to be started.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import ExitStack
from html import escape
from pathlib import Path
from typing import Any

import viser

from explorer.errors import CommandError
from explorer.files.exports import zipped
from explorer.recordings.recording import recorded_lines
from explorer.viewer.guarded_server import GuardedServer, guarded_server
from explorer.viewer.output.recording_switch import HTML, RRD, RecordingSwitch
from explorer.viewer.output.send_file import refuse_large, send_file
from explorer.viewer.panel import EXPORT, Now, PageContext, Panel
from explorer.viewer.shell.web_pages import WebPages
from explorer.viewer.view import small_html

START, STOP, DOWNLOAD, REPLAY = "Start", "Stop", "Download", "Replay here"


class RecordingPanel(Panel):
    """Kind, buttons, and where the files are; the page hands its frames to the recording itself."""

    name, tab = "recording", EXPORT

    def __init__(self, page: PageContext) -> None:
        self._recording, self._background, gui = page.recording, page.background, page.server.gui
        gui.add_markdown("**Recording** of the moving scene")
        self._kind = gui.add_dropdown(
            "Kind",
            (RRD, HTML),
            hint="rerun: bodies, curves, changes, parameters, for `explorer replay`. Web page: the scene alone, one "
            "file for any browser.",
        )
        self._switch = gui.add_button_group(
            "Record",
            (START,),
            hint="Every pour that is begun meanwhile has a file of its own; Download sends several as a ZIP file. "
            "Replay here gives a link to a page for each, which opens beside this one. Recordings stay in the folder "
            "named below.",
        )
        self._server, self._replays = page.server, list[ReplayBeside]()
        self._state = gui.add_html("")

        @self._switch.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                client, chosen = event.client, str(event.target.value)
                page.post(lambda: self._record(client, chosen))

    def show(self, now: Now) -> None:
        """Show the state of the recording, or the page's last message."""
        running, kept = self._recording.running, self._recording.path is not None
        options = (STOP,) if running else (START, DOWNLOAD, REPLAY) if kept else (START,)
        if tuple(self._switch.options) != options:
            self._switch.options = options
        state = recording_html(self._recording, self._background.busy_with, now.notice)
        state += small_html(replay_links(self._replays)) if self._replays else ""
        if self._state.content != state:
            self._state.content = state

    def close(self) -> None:
        """End a recording that was begun on the page, with a complete file, and the pages that replay one."""
        self._recording.close()
        self._show_replays([])

    def _record(self, client: Any, chosen: str) -> None:
        if chosen == START:
            self._recording.begin(str(self._kind.value))
        elif chosen == STOP:
            self._recording.end()
        elif chosen == REPLAY:
            pours = [path for path in self._recording.files() if path.suffix == ".rrd"]
            if not pours:
                raise CommandError("recording: a web page replays itself; download and open it")
            self._background.start(
                "reading the recording",
                lambda: replays_beside(pours, self._server),
                self._show_replays,
            )
        elif chosen == DOWNLOAD and client is not None:
            files = self._recording.files()
            refuse_large(files)
            if len(files) == 1:
                send_file(client, files[0].name, files[0].read_bytes())
            else:
                self._background.start(
                    "packing the recording",
                    lambda: zipped({file.name: file for file in files}),
                    lambda made: send_file(client, f"{files[0].stem}.zip", made),
                )

    def _show_replays(self, replays: list[ReplayBeside]) -> None:
        """Show the replays of the last recording; earlier ones are closed."""
        for replay in self._replays:
            replay.close()
        self._replays = replays


class ReplayBeside:
    """Serves ``recording`` on a free port until it is closed; plays when the first browser comes.

    ``live``: server of the live page, whose host and token are this one's.

    Raises :class:`explorer.errors.CommandError` if the recording cannot be read.
    """

    def __init__(self, recording: Path, live: GuardedServer) -> None:
        # Imported here: rerun takes a second to load, and most sessions are never replayed.
        from explorer.recordings.recording_reader import read_recording
        from explorer.viewer.replay.replay_page import ReplayPage

        read = read_recording(recording)
        self._server, self._stop = (
            guarded_server(live.get_host(), 0, "Replay", WebPages("Replay", around=False), token=live.token),
            threading.Event(),
        )
        try:
            page = ReplayPage(self._server, read, recording.name)
        except BaseException:
            self._server.stop()
            raise
        self.address = live.address(self._server.get_port())
        self.seconds = float(read.times[-1]) - read.zero
        """Duration of the recording [s]."""
        self._loop = threading.Thread(target=page.run, args=(self._stop,), daemon=True, name="explorer-replay")
        self._loop.start()

    def close(self) -> None:
        """Close the page."""
        self._stop.set()
        self._loop.join()
        self._server.stop()


def replays_beside(recordings: Sequence[Path], live: GuardedServer) -> list[ReplayBeside]:
    """One replay for each of ``recordings``; none is left open if one of them cannot be read."""
    with ExitStack() as stack:
        replays = []
        for path in recordings:
            replays.append(ReplayBeside(path, live))
            stack.callback(replays[-1].close)
        stack.pop_all()
    return replays


def replay_links(replays: Sequence[ReplayBeside]) -> str:
    """Links to the pages of the pours of a recording."""
    links = (
        f"<a href='{escape(one.address)}' target='_blank' rel='noopener'>Replay pour {k}</a> ({one.seconds:.3f} s)"
        for k, one in enumerate(replays, start=1)
    )
    return "<br>".join(links)


def recording_html(recording: RecordingSwitch, busy_with: str, notice: str) -> str:
    """What is being recorded or done, and where the files are."""
    lines = [notice, f"Busy {busy_with}." if busy_with else ""]
    pours = recording.pours
    if recording.running:
        lines.append(f"● {recording.state.words}: into {pours[-1].path if pours else recording.path}")
    elif pours:
        lines += recorded_lines(pours)
        if len(pours) > 1 and not busy_with:
            files = recording.files()
            lines.append(f"Download sends {files[0].name}" if len(files) == 1 else "Download sends all in one ZIP file")
    elif recording.path is not None and recording.path.is_file():
        lines.append(f"Recorded: {recording.path}")
    return small_html("<br>".join(escape(line) for line in lines if line))
