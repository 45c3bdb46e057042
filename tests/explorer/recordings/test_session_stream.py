"""A live session sent to a running rerun viewer: what arrives there is the pour."""

import contextlib
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from explorer.live.messages import SessionState, Status
from explorer.recordings.recording import RunningViewer
from explorer.recordings.recording_reader import read_recording
from explorer.recordings.session_recorder import SessionRecorder
from explorer.scene.source import material_source
from explorer.viewer.guarded_server import free_port
from tests.explorer.viewer.page_session import frame_of

SCENE = material_source("sunflower_extract").scene
PATIENCE = 60.0


@pytest.fixture
def viewer(tmp_path):
    """Address of rerun's own program, which writes what it is sent into a file, and that file."""
    port, path = free_port("127.0.0.1", 0), tmp_path / "arrived.rrd"
    program = Path(sys.executable).with_name("rerun")
    command = [str(program), "--save", str(path), "--port", str(port), "--bind", "127.0.0.1"]
    # A shell's background job ignores Ctrl-C, and so would what it starts.
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=listens_to_ctrl_c
    )
    yield f"rerun+http://127.0.0.1:{port}/proxy", path, process
    process.kill()
    process.wait(120)


def listens_to_ctrl_c():
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def interrupted(process):
    """Ctrl-C until it ends: one that comes while Python starts is lost."""
    end = time.monotonic() + PATIENCE
    while process.poll() is None:
        assert time.monotonic() < end, "it does not end"
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(2)


def test_bodies_and_changes_arrive_at_the_viewer(viewer):
    url, path, process = viewer
    stream = SessionRecorder(RunningViewer(url))
    status = Status(SessionState.RUNNING, "", SCENE, seed=1, generation=1, speed=1.0)
    places = np.array([[0.0, 0.0, 0.01], [0.0, 0.02, 0.01]])
    for k in range(3):
        now = 0.1 * (k + 1)
        frame = replace(frame_of([0, 1], places + np.array([0.0, 0.0, 0.001 * k])), time=now, number=k + 1)
        stream.take(frame, replace(status, time=now))
    stream.close()
    assert stream.pours == ()
    end = time.monotonic() + PATIENCE
    while not path.is_file() or path.stat().st_size < 10_000:
        assert time.monotonic() < end, "nothing arrived"
        time.sleep(0.1)
    interrupted(process)
    recording = read_recording(path)
    assert recording.times == pytest.approx([0.1, 0.2, 0.3])
    seeds = next(one for one in recording.components if one.shape.name == "seed")
    assert seeds.at(0.3).position[0] == pytest.approx([0.0, 0.0, 0.012], abs=1e-6)
