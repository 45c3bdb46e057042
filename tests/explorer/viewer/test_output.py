"""The tab of what is taken along: command line, downloads, recordings."""

import errno
import io
import math
import re
import threading
import urllib.error
import urllib.request
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import PIL.Image
import pytest
from viser import _messages

from explorer.errors import CommandError
from explorer.live.messages import SessionState
from explorer.recordings.recording import RecordedPour
from explorer.recordings.recording_reader import read_recording
from explorer.scene.file import load_scene
from explorer.scene.source import SceneSource, material_source
from explorer.viewer.actions import Actions
from explorer.viewer.look.colour_by import ColourKey
from explorer.viewer.output.engine_export import EngineExport
from explorer.viewer.output.output_panel import OutputPanel, command_html
from explorer.viewer.output.picture import (
    DARK_GROUND,
    NO_GROUND,
    WHITE_GROUND,
    Legend,
    bar_length,
    composed,
    length_words,
    pixels_per_metre,
    rendered,
)
from explorer.viewer.output.recording_panel import DOWNLOAD, REPLAY, START, STOP, RecordingPanel
from explorer.viewer.output.recording_switch import (
    BYTES_PER_BODY,
    HTML,
    RRD,
    RecordingState,
    RecordingSwitch,
    session_recorder,
)
from explorer.viewer.output.send_file import send_file, send_files
from explorer.viewer.palette import BODY_COLOURS, STILL, VIRIDIS
from explorer.viewer.panel import Now
from tests.explorer.viewer.page_session import PageSession, finished, frame_of, page_context
from tests.explorer.viewer.person import Browser, Person

SOURCE = material_source("sunflower_extract")


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
    """The panels of the tab with a person at them, whose browser the files are sent to."""

    def __init__(self, server, folder, recorder=FileRecorder):
        self.session, self.actions, self.browser = PageSession(SOURCE), Actions(), Browser()
        self.session.newest = frame_of([0, 1, 2], [[0.0, 0.0, 0.01 * k] for k in range(3)])
        page = page_context(server, self.session, self.actions.post, folder)
        self.background, self.look = page.background, page.look
        self.recording = RecordingSwitch(server, folder / "recordings", page.background, recorder)
        page.__dict__["recording"] = self.recording
        with server.gui.add_folder("files") as files:
            self.panel = OutputPanel(page)
            EngineExport(page)
        with server.gui.add_folder("recording") as recording:
            self.switch = RecordingPanel(page)
        self.files, self.recorder = (Person(place, self.finished, self.browser) for place in (files, recording))

    def finished(self):
        return finished(self.actions, self.background)

    def record(self, chosen):
        """Press a button of the recording that is there now. The line of a refusal."""
        self.told()
        return self.recorder.press(chosen)

    def record_late(self, chosen):
        """Press one that is no more or not yet there, at a page that was not told so. The line of a refusal."""
        self.told()
        assert chosen not in self.recorder.options("Record")
        return self.recorder.send("Record", chosen)

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
        """What the page says of the recording now."""
        self.switch.show(Now(self.session.status()))
        return self.recorder.text


@pytest.fixture
def bench(server, tmp_path):
    return Bench(server, tmp_path / "recordings")


@pytest.fixture
def recorded(server, tmp_path):
    """A bench that records for real."""
    return Bench(server, tmp_path / "recordings", session_recorder)


def test_the_command_line_follows_what_is_on_the_screen(bench):
    bench.panel.show(Now(bench.session.status()))
    assert "in force: explorer simulate sunflower_extract --seed 1 **Files of" in bench.files.text
    bench.session.set_parameters({"pair.seed.seed.static_friction": 0.2})
    bench.panel.show(Now(bench.session.status()))
    assert "--set pair.seed.seed.static_friction=0.2" in bench.files.text


def test_the_pour_is_exported_for_another_program(bench, monkeypatch):
    asked = []
    monkeypatch.setattr(
        "explorer.viewer.output.engine_export.packed_export", lambda scene, *order: asked.append(order) or b"zip"
    )
    bench.files.enter("For another program", "yade")
    assert bench.files.press("Export (ZIP)") == ""
    assert asked == [("yade", 1)]
    assert bench.browser.sent == {"pour_yade.zip": b"zip"}


def test_the_command_line_is_escaped_and_its_absence_explained():
    evil = SceneSource(("<img src=x>",), SOURCE.scene)
    assert "<img" not in command_html(evil, SOURCE.scene, 1)
    assert "save the scene file instead" in command_html(SceneSource((), SOURCE.scene), SOURCE.scene, 1)


def test_the_scene_file_is_the_scene_on_the_screen(bench, tmp_path):
    bench.session.set_parameters({"pair.seed.seed.static_friction": 1 / 3})
    assert bench.files.press("Scene (TOML)") == ""
    (tmp_path / "scene.toml").write_bytes(bench.browser.sent["scene.toml"])
    assert load_scene(str(tmp_path / "scene.toml")) == bench.session.now.scene


def test_bodies_are_sent_as_table_and_mesh(bench):
    assert bench.files.press("Bodies (CSV)") == bench.files.press("Bodies (STL)") == ""
    assert len(bench.browser.sent["bodies_1.250s.csv"].splitlines()) == 4
    assert len(bench.browser.sent["bodies_1.250s_mm.stl"]) > 1000
    bench.session.newest = None
    assert bench.files.press("Bodies (CSV)") == "no body has entered yet"


def taken(bench):
    """The picture that the browser was sent, as RGBA or RGB."""
    assert bench.files.press("Picture (PNG)") == ""
    return PIL.Image.open(io.BytesIO(bench.browser.sent.pop("picture_0.000s.png")))


def test_a_picture_is_a_multiple_of_the_browser_up_to_a_limit(bench):
    assert taken(bench).size == (5120, 90)
    bench.files.enter("Picture size", "4×")
    assert taken(bench).size == (7680, 135)  # 20480 would be too wide
    bench.browser.camera.image_width = 160
    assert taken(bench).size == (640, 360)
    bench.files.send("Picture size", "8×")
    assert "picture size: '8×' is not one of 1×, 2×, 4×" in bench.files.press("Picture (PNG)")


def test_a_picture_has_the_ground_that_was_chosen(bench):
    bench.browser.camera.image_width = 160
    for ground, corner in (
        (DARK_GROUND, (20, 20, 20)),
        (WHITE_GROUND, (255, 255, 255)),
        (NO_GROUND, (255, 255, 255, 0)),
    ):
        bench.files.enter("Picture background", ground)
        assert taken(bench).getpixel((159, 89)) == corner


def test_a_metre_across_the_axis_has_as_many_pixels_as_the_camera_gives_it():
    """tan(fov / 2) = h / (2 d): a picture 1 m high at 2 m, however the camera is tilted."""
    field = 2.0 * math.atan(0.25)
    level = SimpleNamespace(position=np.array([0.0, -2.0, 0.0]), look_at=np.zeros(3), fov=field)
    assert pixels_per_metre(level, 800) == pytest.approx(800.0)
    tilted = SimpleNamespace(position=2.0 * np.array([0.6, 0.0, 0.8]), look_at=np.zeros(3), fov=field)
    assert pixels_per_metre(tilted, 800) == pytest.approx(800.0)
    away = SimpleNamespace(position=np.array([0.0, -2.0, 0.0]), look_at=np.array([0.0, -3.0, 0.0]), fov=field)
    with pytest.raises(CommandError, match="looks away"):
        pixels_per_metre(away, 800)


@pytest.mark.parametrize(
    ("per_metre", "width", "length", "words"),
    [(1000.0, 800, 0.2, "20 cm"), (1000.0, 799, 0.1, "10 cm"), (8e4, 800, 2e-3, "2 mm"), (100.0, 800, 2.0, "2 m")],
)
def test_the_scale_bar_is_as_long_as_it_says(per_metre, width, length, words):
    assert bar_length(per_metre, width) == pytest.approx(length)
    assert length_words(bar_length(per_metre, width)) == words
    blank = np.zeros((400, width, 4), dtype=np.uint8)
    image = PIL.Image.open(io.BytesIO(composed(blank, WHITE_GROUND, per_metre, Legend(), 1.0)))
    row = (np.asarray(image)[400 - 25] < 100).all(axis=1)
    assert row.sum() == pytest.approx(length * per_metre, abs=2)


def test_the_key_shows_components_colours_and_thickness():
    blank = np.zeros((400, 600, 4), dtype=np.uint8)
    key = ColourKey("speed [m/s]", "", (0.0, 0.5, 1.0), "at rest")

    def colours(legend):
        image = PIL.Image.open(io.BytesIO(composed(blank, WHITE_GROUND, 1000.0, legend, 1.0)))
        return set(map(tuple, np.asarray(image).reshape(-1, 3).tolist()))

    plain = colours(Legend())
    two = colours(Legend([("seed", BODY_COLOURS[0]), ("petiole", BODY_COLOURS[2])]))
    assert {BODY_COLOURS[0], BODY_COLOURS[2]} <= two - plain
    assert {VIRIDIS[0], VIRIDIS[-1], STILL} <= colours(Legend(colours=key)) - plain
    assert STILL not in colours(Legend(colours=replace(key, still="")))


def test_the_key_of_a_picture_is_that_of_the_page(bench, monkeypatch):
    legends = []
    monkeypatch.setattr("explorer.viewer.output.picture.picture", lambda *order: legends.append(order[-1]) or b"png")
    assert bench.files.press("Picture (PNG)") == ""
    bench.look.change(colour_by="speed", automatic=False, low=1.0, high=3.0, logarithmic=False)
    assert bench.files.press("Picture (PNG)") == ""
    components, quantity = legends
    assert components == Legend([("seed", BODY_COLOURS[0]), ("plate", BODY_COLOURS[1]), ("petiole", BODY_COLOURS[2])])
    assert (quantity.components, quantity.colours.numbers) == ((), (1.0, 2.0, 3.0))


@pytest.mark.parametrize("error", [TimeoutError("too slow"), RuntimeError("gone")])
def test_a_browser_that_draws_no_picture_is_one_line(error):
    with pytest.raises(CommandError, match=f"picture: the browser did not draw it: {error}"):
        rendered(Browser(error), 1)


def test_a_recording_is_begun_ended_and_sent(bench):
    assert bench.record_late(STOP) == "recording: none is running"
    assert bench.record_late(DOWNLOAD) == "recording: nothing was recorded yet"
    assert bench.record(START) == ""
    assert "one is running" in bench.record_late(START)
    bench.take(3)
    assert re.search(rf"● REC \d:\d\d: into {re.escape(str(bench.recording.path))}", bench.told())
    assert "stop it first" in bench.record_late(DOWNLOAD)
    assert bench.record(STOP) == ""
    bench.take(2)
    assert bench.record(DOWNLOAD) == ""
    path = bench.recording.path
    assert bench.browser.sent == {path.name: b"3 frames"}
    assert f"1 pour recorded: {path}: 1.000 s" in bench.told()


def test_a_pour_that_is_begun_while_recording_is_what_is_downloaded(recorded, tmp_path):
    """Record, restart, stop, download: a moment of the pour before, and then the pour that a person wanted."""
    assert recorded.record(START) == ""
    recorded.pour([1.911], state=SessionState.ENDED)
    recorded.session.restart()
    recorded.pour([0.0, 0.02, 0.05, 0.06])
    first = recorded.recording.path
    second = first.with_stem(f"{first.stem}_2")
    assert re.search(rf"● REC \d:\d\d · pour 2: into {re.escape(str(second))}", recorded.told())
    assert recorded.record(STOP) == ""
    told = recorded.told()
    assert "2 pours recorded:" in told
    assert f"{first}: a single moment, at 1.911 s" in told
    assert f"{second}: 0.060 s, from 0.000 to 0.060 s" in told
    assert "Download sends all in one ZIP file" in told

    assert recorded.record(DOWNLOAD) == ""
    ((name, content),) = recorded.browser.sent.items()
    assert name == f"{first.stem}.zip"
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(tmp_path)
    found = read_recording(tmp_path / second.name)
    assert found.times == pytest.approx([0.0, 0.02, 0.05, 0.06])
    (body,) = found.components
    # From its first body on.
    assert [len(body.at(time).scale) for time in found.times] == [1, 2, 3, 4]
    # The moment before the restart is not lost either.
    assert read_recording(tmp_path / first.name).times == pytest.approx([1.911])


def test_what_is_recorded_is_replayed_without_another_server(recorded):
    """Record, restart, stop, replay: both pours have a page, and the page shows what was recorded."""
    assert recorded.record_late(REPLAY) == "recording: nothing was recorded yet"
    assert recorded.record(START) == ""
    recorded.pour([0.0, 0.1, 0.2])
    recorded.session.restart()
    recorded.pour([0.0, 0.05])
    assert "stop it first" in recorded.record_late(REPLAY)
    assert recorded.record(STOP) == ""
    assert recorded.record(REPLAY) == ""
    assert "Replay pour 1 (0.200 s) Replay pour 2 (0.050 s)" in recorded.told()
    addresses = re.findall(r"<a href='([^']+)'", recorded.recorder.html)
    assert len(addresses) == 2
    for address in addresses:
        with urllib.request.urlopen(address, timeout=10.0) as answer:
            assert b"<html" in answer.read()
    recorded.switch.close()
    assert "Replay pour" not in recorded.told()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(addresses[0], timeout=10.0)


def test_the_state_of_a_recording_is_told_in_words(bench):
    assert bench.recording.state == RecordingState(False)
    assert bench.recording.state.words == ""
    assert bench.record(START) == ""
    bench.take(1)
    state = bench.recording.state
    assert (state.running, state.kind, state.pours) == (True, RRD, 1)
    assert replace(state, seconds=65.9).words == "REC 1:05"
    assert replace(state, seconds=605.0, pours=3).words == "REC 10:05 · pour 3"
    assert bench.record(STOP) == ""
    assert bench.recording.state == RecordingState(False, RRD, 1)


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
    bench.recorder.enter("Kind", HTML)
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
    bench.recorder.enter("Kind", HTML)
    assert bench.record(START) == ""
    bench.take(2)
    assert bench.recording.running
    bench.take(4)
    assert not bench.recording.running
    assert bench.finished() == ""
    assert "__VISER_EMBED_DATA__" in bench.recording.files()[0].read_text()


def test_a_web_page_that_cannot_be_packed_yet_goes_on_being_recorded(bench):
    bench.recorder.enter("Kind", HTML)
    assert bench.record(START) == ""
    done = threading.Event()
    bench.background.start("exporting", lambda: done.wait(60.0), lambda _: None)
    with pytest.raises(CommandError, match="wait until this is done: exporting"):
        bench.recording.end()
    assert bench.recording.running
    done.set()
    assert bench.finished() == ""
    assert bench.record(STOP) == ""
    assert "__VISER_EMBED_DATA__" in bench.recording.files()[0].read_text()


def test_a_web_page_that_could_not_be_written_is_written_again(bench, monkeypatch):
    def full(path, text):
        raise OSError(errno.ENOSPC, "No space left on device")

    bench.recorder.enter("Kind", HTML)
    assert bench.record(START) == ""
    with monkeypatch.context() as patched:
        patched.setattr("explorer.viewer.output.recording_switch.write_whole", full)
        assert "No space left" in bench.record(STOP)
    assert not bench.recording.running
    with pytest.raises(CommandError, match="is now written again"):
        bench.recording.files()
    assert bench.finished() == ""
    assert "__VISER_EMBED_DATA__" in bench.recording.files()[0].read_text()


def test_the_end_of_the_server_leaves_a_web_page_that_was_being_packed(bench, monkeypatch):
    bench.recorder.enter("Kind", HTML)
    assert bench.record(START) == ""
    monkeypatch.setattr(bench.background, "start", lambda *_: None)  # a thread that ends with the server
    bench.recording.end()
    bench.recording.close()
    assert "__VISER_EMBED_DATA__" in bench.recording.path.read_text()


def test_a_kind_that_is_not_offered_is_refused(bench):
    bench.recorder.send("Kind", "<script>")
    assert "allowed: " in bench.record(START)
    assert not bench.recording.running


def test_the_end_of_the_page_leaves_a_whole_file(bench):
    bench.recorder.enter("Kind", RRD)
    assert bench.record(START) == ""
    bench.take(4)
    bench.recording.close()
    assert Path(bench.recording.path).read_text() == "4 frames"
    assert not bench.recording.running


def test_texts_of_the_state_are_escaped(bench):
    bench.switch.show(Now(bench.session.status(), notice="<img src=x>"))
    assert "&lt;img src=x&gt;" in bench.recorder.html
    assert "<img" not in bench.recorder.html


def test_a_button_of_the_recording_that_is_not_there_does_nothing(bench):
    assert bench.actions.carry_out() is None
    assert bench.record_late("Delete everything") == ""
    assert not bench.recording.running


def test_all_files_of_an_answer_are_sent_together():
    """The buffer of a real browser holds the first file when the second is sent."""
    browser = Browser()
    waiting, send = browser.waiting, browser.send_file_download

    def sent(name, content, save_immediately):
        send(name, content, save_immediately)
        waiting[len(waiting)] = _messages.FileTransferPart("", len(waiting), b"", "")

    browser.send_file_download = sent
    send_files(browser, {"part.toml": b"a", "report.html": b"b"})
    assert browser.sent == {"part.toml": b"a", "report.html": b"b"}
    with pytest.raises(CommandError, match=r"^later\.csv: this browser has not yet received"):
        send_file(browser, "later.csv", b"c")
