"""The tab of what is taken along: command line, downloads, recordings."""

import io
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from explorer.errors import CommandError
from explorer.live.messages import SessionState
from explorer.logs.recording import RecordedPour
from explorer.logs.recording_reader import read_recording
from explorer.scene.file import load_scene
from explorer.scene.source import SceneSource, material_source
from explorer.viewer.actions import Actions
from explorer.viewer.output.engine_export import EngineExport
from explorer.viewer.output.output_panel import OutputPanel, command_html, picture
from explorer.viewer.output.recording_panel import DOWNLOAD, START, STOP, RecordingPanel
from explorer.viewer.output.recording_switch import BYTES_PER_BODY, HTML, RRD, session_recorder
from explorer.viewer.panel import Now
from tests.explorer.viewer.page_session import PageSession, event, finished, frame_of, page_context

SOURCE = material_source("sunflower_extract")


class Browser:
    """What is asked of a client: its size, its picture, and files for it."""

    def __init__(self, error=None):
        self.sent, self.error = {}, error
        self.camera = type("Camera", (), {"image_height": 90, "image_width": 5120})

    def send_file_download(self, name, content, save_immediately):
        assert save_immediately
        self.sent[name] = content

    def get_render(self, height, width, timeout):
        if self.error:
            raise self.error
        return np.full((height, width, 3), 7, dtype=np.uint8)


class FileRecorder:
    """Counts what it is handed."""

    def __init__(self, path):
        self.path, self.frames = path, 0

    @property
    def pours(self):
        return (RecordedPour(self.path, 0.0, 1.0),)

    def take(self, frame, status):
        self.frames += 1

    def close(self):
        self.path.write_text(f"{self.frames} frames")


class Bench:
    def __init__(self, server, folder, recorder=FileRecorder):
        self.session, self.actions, self.browser = PageSession(SOURCE), Actions(), Browser()
        self.session.newest = frame_of([0, 1, 2], [[0.0, 0.0, 0.01 * k] for k in range(3)])
        page = page_context(server, self.session, self.actions.post, folder)
        self.recording, self.background = page.recording, page.background
        self.recording._open_rrd = recorder
        self.panel, self.engine, self.switch = OutputPanel(page), EngineExport(page), RecordingPanel(page)

    def press(self, label):
        event(self.panel._exports[label], True, client=self.browser)
        return finished(self.actions, self.background)

    def record(self, chosen):
        event(self.switch._switch, chosen, client=self.browser)
        return finished(self.actions, self.background)

    def take(self, times):
        for number in range(times):
            frame = replace(frame_of([0], [[0.0, 0.0, 0.01 * number]]), number=number)
            self.recording.take(frame, self.session.now)

    def pour(self, times, **others):
        """The present pour at ``times`` [s], with a body more at each."""
        generation = self.session.now.generation
        for n, time in enumerate(times, start=1):
            frame = frame_of([0] * n, [[0.0, 0.0, 0.01 * k] for k in range(n)], generation=generation)
            status = replace(self.session.now, time=time, **others)
            self.recording.take(replace(frame, time=time), status)

    def told(self):
        self.switch.show(Now(self.session.status()))
        return self.switch._state.content


@pytest.fixture
def bench(server, tmp_path):
    return Bench(server, tmp_path / "recordings")


@pytest.fixture
def recorded(server, tmp_path):
    """A bench that records for real."""
    return Bench(server, tmp_path / "recordings", session_recorder)


def test_the_command_line_follows_what_is_on_the_screen(bench):
    bench.panel.show(Now(bench.session.status()))
    assert "explorer simulate sunflower_extract --seed 1<" in bench.panel._command.content
    bench.session.set_parameters({"pair.seed.seed.static_friction": 0.2})
    bench.panel.show(Now(bench.session.status()))
    assert "--set pair.seed.seed.static_friction=0.2" in bench.panel._command.content


def test_the_pour_is_exported_for_another_program(bench, monkeypatch):
    asked = []
    monkeypatch.setattr(
        "explorer.viewer.output.engine_export.packed_export", lambda scene, *order: asked.append(order) or b"zip"
    )
    engine = bench.engine
    engine._program.value = "yade"
    event(engine._button, True, client=bench.browser)
    assert finished(bench.actions, bench.background) == ""
    assert asked == [("yade", 1)]
    assert bench.browser.sent == {"pour_yade.zip": b"zip"}


def test_the_command_line_is_escaped_and_its_absence_explained():
    evil = SceneSource(("<img src=x>",), SOURCE.scene)
    assert "<img" not in command_html(evil, SOURCE.scene, 1)
    assert "save the scene file instead" in command_html(SceneSource((), SOURCE.scene), SOURCE.scene, 1)


def test_the_scene_file_is_the_scene_on_the_screen(bench, tmp_path):
    bench.session.set_parameters({"pair.seed.seed.static_friction": 1 / 3})
    assert bench.press("Scene (TOML)") == ""
    (tmp_path / "scene.toml").write_bytes(bench.browser.sent["scene.toml"])
    assert load_scene(str(tmp_path / "scene.toml")) == bench.session.now.scene


def test_bodies_are_sent_as_table_and_mesh(bench):
    assert bench.press("Bodies (CSV)") == bench.press("Bodies (STL)") == ""
    assert len(bench.browser.sent["bodies_1.250s.csv"].splitlines()) == 4
    assert len(bench.browser.sent["bodies_1.250s_mm.stl"]) > 1000
    bench.session.newest = None
    assert bench.press("Bodies (CSV)") == "no body has entered yet"


def test_a_picture_is_as_large_as_the_browser_up_to_a_limit(bench):
    assert bench.press("Picture (PNG)") == ""
    (content,) = bench.browser.sent.values()
    # Width and height of a PNG stand at byte 16.
    assert [int.from_bytes(content[k : k + 4], "big") for k in (16, 20)] == [2560, 45]


@pytest.mark.parametrize("error", [TimeoutError("too slow"), RuntimeError("gone")])
def test_a_browser_that_draws_no_picture_is_one_line(error):
    with pytest.raises(CommandError, match=f"picture: the browser did not draw it: {error}"):
        picture(Browser(error))


def test_a_recording_is_begun_ended_and_sent(bench):
    assert bench.record(STOP) == "recording: none is running"
    assert bench.record(DOWNLOAD) == "recording: nothing was recorded yet"
    assert bench.record(START) == ""
    assert "one is running" in bench.record(START)
    bench.take(3)
    bench.switch.show(Now(bench.session.status()))
    assert f"Recording into {bench.recording.path}" in bench.switch._state.content
    assert "stop it first" in bench.record(DOWNLOAD)
    assert bench.record(STOP) == ""
    bench.take(2)
    assert bench.record(DOWNLOAD) == ""
    path = bench.recording.path
    assert bench.browser.sent == {path.name: b"3 frames"}
    assert f"1 pour recorded:<br>{path}: 1.000 s" in bench.told()


def test_a_pour_that_is_begun_while_recording_is_what_is_downloaded(recorded, tmp_path):
    """Record, restart, stop, download: a moment of the pour before, and then the pour that a person wanted."""
    assert recorded.record(START) == ""
    recorded.pour([1.911], state=SessionState.ENDED)
    recorded.session.restart()
    recorded.pour([0.0, 0.02, 0.05, 0.06])
    first = recorded.recording.path
    second = first.with_stem(f"{first.stem}_2")
    assert f"Recording into {second} (pour 2 of this recording)" in recorded.told()
    assert recorded.record(STOP) == ""
    told = recorded.told()
    assert "2 pours recorded:" in told
    assert f"{first}: a single moment, at 1.911 s" in told
    assert f"{second}: 0.060 s, from 0.000 to 0.060 s" in told
    assert f"Download sends {second.name}" in told

    assert recorded.record(DOWNLOAD) == ""
    ((name, content),) = recorded.browser.sent.items()
    assert name == second.name
    (tmp_path / name).write_bytes(content)
    found = read_recording(tmp_path / name)
    assert found.times == pytest.approx([0.0, 0.02, 0.05, 0.06])
    (body,) = found.components
    # From its first body on.
    assert [len(body.at(time).scale) for time in found.times] == [1, 2, 3, 4]
    # The moment before the restart is not lost either.
    assert read_recording(first).times == pytest.approx([1.911])


def test_several_pours_are_downloaded_in_one_file(recorded, tmp_path):
    assert recorded.record(START) == ""
    recorded.pour([0.0, 0.1, 0.2])
    recorded.session.restart()
    recorded.pour([0.0, 0.05])
    recorded.session.restart()
    recorded.pour([0.0])
    assert recorded.record(STOP) == ""
    assert "3 pours recorded:" in recorded.told()
    assert "Download sends all in one ZIP file" in recorded.told()
    assert recorded.record(DOWNLOAD) == ""
    ((name, content),) = recorded.browser.sent.items()
    stem = recorded.recording.path.stem
    assert name == f"{stem}.zip"
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.namelist() == [f"{stem}.rrd", f"{stem}_2.rrd", f"{stem}_3.rrd"]
        archive.extractall(tmp_path)
    ends = [read_recording(tmp_path / name).times[-1] for name in archive.namelist()]
    assert ends == pytest.approx([0.2, 0.05, 0.0])


def test_a_recording_without_a_frame_is_none(recorded):
    assert recorded.record(START) == ""
    assert recorded.record(STOP) == ""
    assert recorded.record(DOWNLOAD) == "recording: nothing was recorded yet"
    assert "ecorded" not in recorded.told()


def test_the_scene_as_a_web_page_holds_what_moved(server, bench):
    bench.switch._kind.value = HTML
    node = server.scene.add_frame("/moving")
    assert bench.record(START) == ""
    for k in range(3):
        node.position = (0.125 * k, 0.0, 0.0)
        bench.take(k + 1)
    assert bench.record(STOP) == ""
    text = bench.recording.path.read_text()
    assert text.count("__VISER_EMBED_DATA__=") == 1
    assert bench.recording.files() == (bench.recording.path,)
    # Another one can be made after it.
    assert bench.record(START) == ""
    bench.recording.close()
    assert len(list(bench.recording.path.parent.iterdir())) == 2


def test_a_web_page_that_is_full_is_ended_and_written(bench, monkeypatch):
    monkeypatch.setattr("explorer.viewer.output.recording_switch.MOST_BYTES", 2.5 * BYTES_PER_BODY)
    bench.switch._kind.value = HTML
    assert bench.record(START) == ""
    bench.take(2)
    assert bench.recording.running
    bench.take(4)
    assert not bench.recording.running
    assert finished(bench.actions, bench.background) == ""
    assert "__VISER_EMBED_DATA__" in bench.recording.files()[0].read_text()


def test_a_kind_that_is_not_offered_is_refused(bench):
    bench.switch._kind.value = "<script>"
    assert "allowed: " in bench.record(START)
    assert not bench.recording.running


def test_the_end_of_the_page_leaves_a_whole_file(bench):
    bench.switch._kind.value = RRD
    assert bench.record(START) == ""
    bench.take(4)
    bench.recording.close()
    assert Path(bench.recording.path).read_text() == "4 frames"
    assert not bench.recording.running


def test_texts_of_the_state_are_escaped(bench):
    bench.switch.show(Now(bench.session.status(), notice="<img src=x>"))
    assert "<img" not in bench.switch._state.content
    assert bench.actions.carry_out() is None
    assert bench.record("Delete everything") == ""
    assert not bench.recording.running
