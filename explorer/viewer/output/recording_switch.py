"""Recordings that are begun and ended on the page, in addition to the one of the command line.

A rerun recording is one file per pour; a web page is the moving scene, which any browser plays without a server.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Protocol

import viser

from explorer.errors import CommandError
from explorer.files.output_file import write_whole
from explorer.live.frames import Frame
from explorer.live.messages import Status
from explorer.recordings.recording import RecordedPour, RunningViewer
from explorer.viewer.actions import BackgroundWork

MOST_BYTES = 150e6
"""Size of the poses kept, before packing: half an hour of 80 bodies, 20 s of as many as a frame holds."""
BYTES_PER_BODY = 32
LONGEST_PAUSE = 0.5
"""A pause in the pour takes no longer than this [s] in the playback."""
RRD, HTML = "rerun (.rrd)", "web page (.html)"


@dataclass(frozen=True)
class RecordingState:
    """What is being recorded."""

    running: bool
    kind: str = ""
    """One of ``RRD`` and ``HTML``; empty before the first recording."""
    pours: int = 0
    """Number of pours in the present or last recording, so far."""
    seconds: float = 0.0
    """Wall time since the recording was begun; 0 if none is running."""

    @property
    def words(self) -> str:
        """``REC 1:05``, and from the second pour on its number; empty if none is running."""
        if not self.running:
            return ""
        minutes, seconds = divmod(int(self.seconds), 60)
        return f"REC {minutes}:{seconds:02d}" + (f" · pour {self.pours}" if self.pours > 1 else "")


class Recorder(Protocol):
    """Something that keeps what the page shows, in one file per pour."""

    @property
    def pours(self) -> tuple[RecordedPour, ...]:
        """What has been recorded so far."""

    def take(self, frame: Frame, status: Status) -> None:
        """Called about 30 times a second with the newest frame and the newest status."""

    def close(self) -> None:
        """End the recording; its files are then complete."""


def session_recorder(to: Path | RunningViewer) -> Recorder:
    """A rerun recording into the new file ``to``, or into an open viewer."""
    # Imported here: rerun takes a second to load, and most sessions are never recorded.
    from explorer.recordings.session_recorder import SessionRecorder

    return SessionRecorder(to)


class RecordingSwitch:
    """One recording at a time, into ``folder``; ``open_rrd`` begins a rerun recording."""

    def __init__(
        self,
        server: viser.ViserServer,
        folder: Path,
        background: BackgroundWork,
        open_rrd: Callable[[Path], Recorder] = session_recorder,
    ) -> None:
        self._server, self._folder, self._open_rrd, self._background = server, folder, open_rrd, background
        self._recorder: Recorder | ScenePlayback | None = None
        self._path: Path | None = None
        self._pours: tuple[RecordedPour, ...] = ()
        self._unwritten: ScenePlayback | None = None
        """A web page that has ended and is not in its file yet."""
        self._began = 0.0

    @property
    def state(self) -> RecordingState:
        """What is being recorded, for display on the page."""
        kind = "" if self._path is None else RRD if self._path.suffix == ".rrd" else HTML
        since = time.monotonic() - self._began if self.running else 0.0
        return RecordingState(self.running, kind, len(self.pours), since)

    @property
    def running(self) -> bool:
        """Whether something is being recorded."""
        return self._recorder is not None

    @property
    def path(self) -> Path | None:
        """First file of the present or last recording; None before the first."""
        return self._path

    @property
    def pours(self) -> tuple[RecordedPour, ...]:
        """Files of the present or last rerun recording, one per pour; a web page is one file for all pours."""
        if self._recorder is None or isinstance(self._recorder, ScenePlayback):
            return self._pours
        return self._recorder.pours

    def begin(self, kind: str) -> None:
        """Begin a recording of one of the two kinds; raises CommandError while one is running, or for another kind."""
        if self.running:
            raise CommandError(f"recording: one is running, into {self._path}; stop it first")
        if kind not in (RRD, HTML):
            raise CommandError(f"recording: unknown kind {kind[:40]!r}; allowed: {RRD}, {HTML}")
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._folder / f"pour-{datetime.now():%Y%m%d-%H%M%S-%f}{'.rrd' if kind == RRD else '.html'}"
        if kind == HTML:
            self._take_up(path, ScenePlayback(self._server))
        else:
            # Off the loop: rerun takes a second to load.
            self._background.start(
                "beginning the recording", lambda: self._open_rrd(path), lambda made: self._take_up(path, made)
            )

    def end(self) -> None:
        """End the recording; raises CommandError if there is none."""
        recorder, path = self._recorder, self._path
        if recorder is None or path is None:
            raise CommandError("recording: none is running")
        if isinstance(recorder, ScenePlayback):
            # Refused while another job is being done; the recording then continues.
            self._pack(path, recorder)
            self._recorder = None
            return
        # In this order: whoever sees that the recording has ended may open the files.
        try:
            recorder.close()
        finally:
            self._pours, self._recorder = recorder.pours, None

    def take(self, frame: Frame, status: Status) -> None:
        """Hand on what the page shows, if it is being recorded; a web page that is full is ended.

        A recording that cannot continue is also ended, and its error is raised.
        """
        if self._recorder is None:
            return
        try:
            self._recorder.take(frame, status)
        except (ValueError, OSError):
            self.end()
            raise
        if isinstance(self._recorder, ScenePlayback) and self._recorder.full and not self._background.busy_with:
            self.end()

    def files(self) -> tuple[Path, ...]:
        """Files of the last recording for download: one per pour since its beginning, or the web page.

        Raises CommandError if there is none, or while it is being written.
        """
        if self.running or self._background.busy_with:
            raise CommandError("recording: stop it first, and wait until it is written")
        if self._unwritten is not None and self._path is not None:
            self._pack(self._path, self._unwritten)
            raise CommandError("recording: it could not be written and is now written again; wait until that is done")
        found = [pour.path for pour in self._pours]
        if not found and self._path is not None and self._path.is_file():
            found = [self._path]  # a web page
        if not found:
            raise CommandError("recording: nothing was recorded yet")
        return tuple(found)

    def close(self) -> None:
        """End the running recording, with a complete file."""
        recorder, self._recorder = self._recorder or self._unwritten, None
        if isinstance(recorder, ScenePlayback) and self._path is not None:
            write_whole(self._path, recorder.html())
        elif recorder is not None:
            recorder.close()

    def _pack(self, path: Path, recorder: ScenePlayback) -> None:
        """Write a web page off the loop; it is kept until that is done, in case the server ends or the disk is full."""

        def written(_: object) -> None:
            self._unwritten = None

        self._unwritten = recorder
        self._background.start("packing the recording", lambda: write_whole(path, recorder.html()), written)

    def _take_up(self, path: Path, recorder: Recorder | ScenePlayback) -> None:
        self._path, self._recorder, self._pours, self._unwritten = path, recorder, (), None
        self._began = time.monotonic()


class ScenePlayback:
    """Keeps what is sent to browsers from its creation on; a recorder of the page."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._serializer: Any = server.get_scene_serializer()  # records all that is sent until it is packed
        self._last = time.monotonic()
        self._number, self._bytes = -1, 0.0
        self._html: str | None = None

    def take(self, frame: Frame, status: Status) -> None:
        """Note how much wall time has passed since the previous frame, as the user saw it."""
        if self._html is not None or frame.number == self._number:
            return
        now = time.monotonic()
        self._serializer.insert_sleep(min(now - self._last, LONGEST_PAUSE))
        self._last, self._number = now, frame.number
        self._bytes += BYTES_PER_BODY * len(frame.component)

    @property
    def full(self) -> bool:
        """Whether it keeps as much as one file should hold."""
        return self._bytes > MOST_BYTES

    def close(self) -> None:
        """End the playback; :meth:`html` returns it."""
        if self._html is None:
            self._html = self._serializer.as_html(dark_mode=True)

    def html(self) -> str:
        """The file; ends the playback."""
        self.close()
        return self._html or ""
