"""``explorer serve``: session, server and page, from start to Ctrl-C."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from queue import SimpleQueue
from types import FrameType

from explorer.background.command_process import PourPlace
from explorer.diagnosis.process import DiagnoseProcess
from explorer.live.session import Session
from explorer.project.project import Project
from explorer.recordings.recording import RunningViewer, recorded_lines
from explorer.study.process import CalibrationProcess
from explorer.viewer.board.folder_board import FolderBoard
from explorer.viewer.guarded_server import address, guarded_server
from explorer.viewer.output.recording_switch import session_recorder
from explorer.viewer.page import Page
from explorer.viewer.shell.channel import ShellChannel
from explorer.viewer.shell.web_pages import WebPages
from solver.scenes.scene import Scene

LABEL = "Granular material explorer"
FOLLOW_INTERVAL = 2.0
"""Seconds between two checks of the folder of a board."""


def print_address(url: str) -> None:
    """Print the address of the page on the terminal."""
    print(f"The page is at {url} (Ctrl-C ends it)", flush=True)


def serve(
    project: Project,
    scene: Scene,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    seed: int = 1,
    store: Path | None = None,
    record_path: Path | None = None,
    rerun_viewer: str = "",
    token: str | None = None,
    scheduler: str = "",
    ready: Callable[[str], None] = print_address,
) -> None:
    """Serve the page of a live pour of ``scene``; blocks until SIGINT or SIGTERM (main thread only).

    Args:
        project: the project that the page works on.
        scene: what is poured first.
        host: address to listen on.
        port: port to listen on; 0 takes a free one.
        seed: seed of the first pour.
        store: file of the runs of study and diagnosis; None for the default store.
        record_path: new file (``.rrd``) into which the session is recorded; a restart begins another beside
            it. All of them are listed on the terminal at the end.
        rerun_viewer: address of a running rerun viewer to which the session is sent; empty: none.
        token: token that a browser has to show; None: none, which is allowed only for a loopback address.
        scheduler: address of a Dask scheduler whose workers pour for study, diagnosis and population, unless chosen
            otherwise on the page; empty: none.
        ready: called with the address once the page can be opened.

    Raises:
        PortError: the port is busy, the host is not of this machine, or others can reach it without a token.
        ParameterError: the scene is too large to be shown.
        CommandError: ``record_path`` cannot be a new recording.
    """
    with stopped_by_signals() as stop, ExitStack() as ending:
        # Closed in reverse order, with the signals still caught: a second signal must not leave processes behind.
        recorder = session_recorder(record_path) if record_path else None
        if recorder:
            ending.callback(lambda: print("\n".join(recorded_lines(recorder.pours)), flush=True))
            ending.enter_context(closing(recorder))
        recorders = [recorder] if recorder else []
        if rerun_viewer:
            recorders.append(ending.enter_context(closing(session_recorder(RunningViewer(rerun_viewer)))))
        pages, channel = WebPages(f"{project.title} · {LABEL}"), ShellChannel()
        server = guarded_server(host, port, LABEL, pages, channel, token)
        ending.callback(server.stop)
        place = PourPlace(scheduler)
        study = CalibrationProcess(project.study, project.studies, store, target=project.target, place=place)
        ending.callback(study.close)
        diagnosis = DiagnoseProcess(project.diagnoses, store, place=place)
        ending.callback(diagnosis.close)
        session = ending.enter_context(closing(Session()))
        session.start(scene, seed, project.source)
        page = Page(server, session, project, study, diagnosis, channel, pages, recorders, place=place)
        ending.enter_context(closing(page))
        ready(f"http://{address(host)}:{server.get_port()}")
        page.run(stop)


def replay(
    recording: Path,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    token: str | None = None,
    ready: Callable[[str], None] = print_address,
) -> None:
    """Serve a page that plays ``recording``; blocks until SIGINT or SIGTERM (main thread only).

    Raises:
        CommandError: it is not a recording of a pour.
        PortError: the port is busy, the host is not of this machine, or others can reach it without a token.
    """
    # Imported here: rerun takes a second to load, and a live page does not need it.
    from explorer.recordings.recording_reader import read_recording
    from explorer.viewer.replay.replay_page import ReplayPage

    read = read_recording(recording)
    with stopped_by_signals() as stop, ExitStack() as ending:
        server = guarded_server(host, port, LABEL, WebPages(f"{recording.name} · {LABEL}", around=False), token=token)
        ending.callback(server.stop)
        page = ReplayPage(server, read, recording.name)
        ready(f"http://{address(host)}:{server.get_port()}")
        page.run(stop)


def board(
    folder: Path,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    token: str | None = None,
    ready: Callable[[str], None] = print_address,
) -> None:
    """Serve the board of the study or diagnosis in ``folder``; blocks until SIGINT or SIGTERM (main thread only).

    Raises:
        CommandError: the folder holds no result, or one of another version.
        PortError: the port is busy, the host is not of this machine, or others can reach it without a token.
    """
    pages = WebPages(LABEL)
    # Before the address is printed: what cannot be shown is refused at once.
    found = FolderBoard(folder, pages)
    with stopped_by_signals() as stop, ExitStack() as ending:
        server = guarded_server(host, port, LABEL, pages, token=token)
        ending.callback(server.stop)
        ready(f"http://{address(host)}:{server.get_port()}/shell/board.html#{found.address}")
        while not stop.wait(FOLLOW_INTERVAL):
            found.follow()


@contextmanager
def stopped_by_signals() -> Iterator[threading.Event]:
    """An event that SIGINT and SIGTERM set; the former handlers are restored at the end."""
    stop, asked = threading.Event(), SimpleQueue[int]()

    def set_stop(number: int, frame: FrameType | None) -> None:
        # Not the event itself: if a signal interrupts this thread in stop.wait, the lock is held and never released.
        asked.put(number)

    def set_when_asked() -> None:
        asked.get()
        stop.set()

    threading.Thread(target=set_when_asked, daemon=True, name="explorer-stop").start()
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, set_stop) for number in numbers]
    try:
        yield stop
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
        asked.put(0)  # so that the thread also ends
