"""``explorer serve``: session, server and page, from start to Ctrl-C."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from types import FrameType

from explorer.diagnosis.process import DiagnoseProcess
from explorer.logs.recording import recorded_lines
from explorer.scene.presets import data_folder
from explorer.scene.source import SceneSource
from explorer.session import Session
from explorer.study.process import CalibrationProcess
from explorer.viewer.guarded_server import address, guarded_server
from explorer.viewer.output.recording_switch import session_recorder
from explorer.viewer.page import Page
from solver.scenes.scene import Scene

LABEL = "Granular material explorer"


def print_address(url: str) -> None:
    """Tell on the terminal where the page is."""
    print(f"The page is at {url} (Ctrl-C ends it)", flush=True)


def serve(
    scene: Scene,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    seed: int = 1,
    study_file: Path | None = None,
    store: Path | None = None,
    record_path: Path | None = None,
    source: SceneSource | None = None,
    ready: Callable[[str], None] = print_address,
) -> None:
    """Serve the page of a live pour of ``scene``; blocks until SIGINT or SIGTERM (main thread only).

    Args:
        scene: what is poured first.
        host: address to listen on.
        port: port to listen on; 0 takes a free one.
        seed: seed of the first pour.
        study_file: the study that the page can run, None for a page without.
        store: file of the runs of study and diagnosis; None for the default store.
        record_path: new file (``.rrd``) that the session is recorded into; a restart begins another beside
            it. All of them are named on the terminal at the end.
        source: where ``scene`` came from, for the command line that repeats it.
        ready: called with the address once the page can be opened.

    Raises:
        PortError: the port is busy or the host is not of this machine.
        ParameterError: the scene is too big to be shown.
        CommandError: ``record_path`` cannot be a new recording.
    """
    with stopped_by_signals() as stop, ExitStack() as ending:
        # Ended in reverse order, with the signals still caught: a second one must not leave processes behind.
        recorder = session_recorder(record_path) if record_path else None
        if recorder:
            ending.callback(lambda: print("\n".join(recorded_lines(recorder.pours)), flush=True))
            ending.enter_context(closing(recorder))
        server = guarded_server(host, port, LABEL)
        ending.callback(server.stop)
        study = _study(study_file, store)
        if study is not None:
            ending.callback(study.close)
        diagnosis = DiagnoseProcess(diagnoses_folder(), store)
        ending.callback(diagnosis.close)
        session = ending.enter_context(closing(Session()))
        session.start(scene, seed, source)
        page = ending.enter_context(closing(Page(server, session, study, diagnosis, recorder)))
        ready(f"http://{address(host)}:{server.get_port()}")
        page.run(stop)


def replay(
    recording: Path, *, host: str = "127.0.0.1", port: int = 8080, ready: Callable[[str], None] = print_address
) -> None:
    """Serve a page that plays ``recording``; blocks until SIGINT or SIGTERM (main thread only).

    Raises:
        CommandError: it is no recording of a pour.
        PortError: the port is busy or the host is not of this machine.
    """
    # Imported here: rerun takes a second to load, and a live page needs none of it.
    from explorer.logs.recording_reader import read_recording
    from explorer.viewer.replay.replay_page import ReplayPage

    read = read_recording(recording)
    with stopped_by_signals() as stop, ExitStack() as ending:
        server = guarded_server(host, port, LABEL)
        ending.callback(server.stop)
        page = ReplayPage(server, read, recording.name)
        ready(f"http://{address(host)}:{server.get_port()}")
        page.run(stop)


def _study(file: Path | None, store: Path | None) -> CalibrationProcess | None:
    return None if file is None else CalibrationProcess(file, studies_folder(), store)


def studies_folder() -> Path:
    """Where studies that the page starts put their results."""
    return data_folder() / "studies"


def diagnoses_folder() -> Path:
    """Where diagnoses that the page starts put their results."""
    return data_folder() / "diagnoses"


@contextmanager
def stopped_by_signals() -> Iterator[threading.Event]:
    """An event that SIGINT and SIGTERM set; the handlers from before come back at the end."""
    stop = threading.Event()

    def set_stop(number: int, frame: FrameType | None) -> None:
        stop.set()

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, set_stop) for number in numbers]
    try:
        yield stop
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
