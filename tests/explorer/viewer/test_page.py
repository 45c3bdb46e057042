"""The page as a whole below the browser: one loop, all panels, another scene, a real recording."""

import errno
import json
import shutil
import threading
from dataclasses import replace
from types import SimpleNamespace
from urllib.parse import urlencode

import pytest

from explorer.diagnosis.process import DiagnoseProcess
from explorer.live.messages import Event, SessionState, Status
from explorer.project.project import study_project
from explorer.recordings.recording_reader import read_recording
from explorer.scene.source import material_source
from explorer.viewer.app import serve
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.panel import LOOK, SELDOM, Panel, Tab
from explorer.viewer.panels import PANELS
from explorer.viewer.shell.channel import ShellChannel
from solver.scenes.scene import value
from tests.explorer.background.waiting import wait_for
from tests.explorer.viewer.page_session import PageSession, frame_of, page_of
from tests.explorer.viewer.person import Person

SOURCE = material_source("sunflower_extract")
FRICTION = "pair.seed.seed.static_friction"


class Session(PageSession):
    """With the rest of what the page's loop asks; ``turns``: how often it has gone round."""

    turns = 0

    def new_events(self):
        self.turns += 1
        events = tuple(self.events)
        del self.events[: len(events)]  # what a test has put there meanwhile stays
        return events

    def step(self):
        pass

    def step_back(self):
        pass

    def details(self):
        return None

    def watch(self, wanted, body=None):
        pass

    def set_speed(self, factor):
        pass


class ClosableSession(Session):
    def close(self):
        pass


@pytest.fixture
def running(tmp_path, monkeypatch, request):
    """A page whose loop runs in a thread, the session behind it, and a person at it; of a parameter: its recorders."""
    monkeypatch.setattr("explorer.viewer.page.data_folder", lambda: tmp_path)
    channel, server = ShellChannel(), guarded_server("127.0.0.1", 0, "test")
    session, stop = Session(SOURCE), threading.Event()
    diagnosis = DiagnoseProcess(tmp_path / "diagnoses", tmp_path / "runs.sqlite")
    page = page_of(server, session, diagnosis, tmp_path, channel, getattr(request, "param", ()))
    loop = threading.Thread(target=page.run, args=(stop,))
    loop.start()

    def ask(**command):
        """As a person does in what stands around the page."""
        channel.take(json.dumps(command))

    node = server.scene.get_handle_by_name
    yield SimpleNamespace(person=Person(server), page=page, session=session, node=node, ask=ask)
    stop.set()
    loop.join(10)
    page.close()
    diagnosis.close()
    server.stop()


def change_friction(person):
    """0.57 → 0.2 between seeds."""
    person.enter("Pair", "seed – seed")
    wait_for(lambda: person.sees("Static friction"))
    person.enter("Static friction", 0.2)


def curves(person):
    """The chart of angle and mass; its last series are the marks of changes."""
    (chart,) = (one for one in person.within("Pour").curves if one.series[3]["label"] == "angle [°]")
    return chart


def test_a_change_reaches_list_chart_and_command_line_and_is_undone(running):
    person, changes = running.person, running.person.within("Changes and presets")
    change_friction(person)
    wait_for(lambda: "0.57 → <b>0.2</b>" in changes.html)
    wait_for(lambda: curves(person).series[-1]["label"].endswith("0.57 → 0.2"))
    wait_for(lambda: f"{FRICTION}=0.2" in person.within("Export").text)
    person.press("Undo (Z)")
    wait_for(lambda: "Everything is at its default" in changes.text)
    assert value(running.session.now.scene, FRICTION) == 0.57


def test_all_panels_follow_another_rig(running):
    person = running.person
    assert running.node("/rig/shell") is None
    link = {"pour": "rotating_drum", "material": "nine_sphere_seed", "seed": 3}
    running.ask(do="pour_link", text=urlencode(link))
    wait_for(lambda: "--seed 3" in (told := person.within("Export").text) and "rotating_drum" in told)
    wait_for(lambda: person.within("Set-up").sees("Speed rpm [rpm]"))
    wait_for(lambda: person.within("Rig and material").value("Rig") == "rotating_drum")
    wait_for(lambda: running.node("/rig/shell") is not None)
    assert running.node("/rig/cone") is None


def test_a_recording_of_the_page_holds_the_changes(running, tmp_path):
    rerun_chunk = pytest.importorskip("rerun.chunk")
    running.session.newest = frame_of([0, 1], [[0.0, 0.0, 0.01], [0.0, 0.02, 0.01]])
    person, export = running.person, running.person.within("Export")
    # What the page tells in one of its turns, it has recorded before.
    export.press("Start")
    wait_for(lambda: export.options("Record") == ("Stop",))
    change_friction(person)
    wait_for(lambda: f"{FRICTION}=0.2" in export.text)
    export.press("Stop")
    wait_for(lambda: "Download" in export.options("Record"))
    (path,) = (tmp_path / "recordings").iterdir()
    assert str(path) in export.text
    texts = []
    for chunk in rerun_chunk.RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if "TextLog:text" in batch.schema.names:
            texts += [text for row in batch["TextLog:text"].to_pylist() for text in row or ()]
    assert f"{FRICTION}: 0.57 → 0.2" in texts


def test_a_recording_whose_folder_is_gone_ends_in_one_line_and_the_page_goes_on(running, tmp_path):
    pytest.importorskip("rerun")
    session, export = running.session, running.person.within("Export")
    session.newest = frame_of([0], [[0.0, 0.0, 0.01]])
    export.press("Start")
    wait_for(lambda: export.options("Record") == ("Stop",))
    (begun,) = (tmp_path / "recordings").iterdir()
    wait_for(lambda: str(begun) in export.text)
    shutil.rmtree(tmp_path / "recordings")
    session.restart()
    session.newest = frame_of([0], [[0.0, 0.0, 0.01]], generation=2)
    wait_for(lambda: f"there is no folder {tmp_path / 'recordings'}" in export.text)
    wait_for(lambda: "Start" in export.options("Record"))


def test_a_file_that_was_sent_is_refused_by_its_name_without_its_folder(running, tmp_path):
    sheet = running.person.within("Filled sheet → model and optimum")
    sheet.upload("Upload: sheet", "runs.csv", b"run,angle\n1,\n")
    sheet.press("Analyse")
    laboratory = running.person.within("Laboratory")
    wait_for(lambda: "runs-" in laboratory.text)
    assert str(tmp_path) not in laboratory.text


class FullDisk:
    """A recorder that cannot go on."""

    asked = 0

    def take(self, frame, status):
        self.asked += 1
        raise OSError(errno.ENOSPC, "No space left on device", "live.rrd")


FULL_DISK = FullDisk()


@pytest.mark.parametrize("running", [(FULL_DISK,)], indirect=True)
def test_a_recording_of_the_command_line_that_cannot_go_on_is_left_out(running):
    running.session.newest = frame_of([0], [[0.0, 0.0, 0.01]])
    told = "the recording has ended: live.rrd: No space left on device"
    wait_for(lambda: told in running.person.within("Export").text)
    assert FULL_DISK.asked == 1


class RestartedPage:
    """Stands in for the page: it hands its recorder two pours, and ends."""

    def __init__(self, *others, place):
        (self.recorder,) = others[-1]

    def run(self, stop):
        for generation, times in ((1, (1.0,)), (2, (0.0, 0.5))):
            for now in times:
                status = Status(SessionState.RUNNING, "", SOURCE.scene, 1, generation, 1.0, time=now)
                frame = frame_of([0], [[0.0, 0.0, 0.01]], generation=generation)
                self.recorder.take(replace(frame, time=now), status)

    def close(self):
        pass


def test_the_end_of_serve_names_every_file_that_it_recorded(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setattr("explorer.viewer.app.Page", RestartedPage)
    monkeypatch.setattr("explorer.viewer.app.Session", lambda: ClosableSession(SOURCE))
    path = tmp_path / "live.rrd"
    serve(study_project("sunflower_extract"), SOURCE.scene, port=0, record_path=path, ready=lambda address: None)
    assert capsys.readouterr().out.splitlines()[-3:] == [
        "2 pours recorded:",
        f"{path}: a single moment, at 1.000 s",
        f"{tmp_path / 'live_2.rrd'}: 0.500 s, from 0.000 to 0.500 s",
    ]
    assert read_recording(tmp_path / "live_2.rrd").times == pytest.approx([0.0, 0.5])


class Magnets(Panel):
    """A made-up panel, in a folder of a tab of its own."""

    name, tab, title = "magnets", Tab("Magnets"), "Pull"

    def __init__(self, page):
        self.text, self.drawn, self.dark, self.closed = page.server.gui.add_markdown(""), 0, True, False

    def draw(self, now):
        self.drawn += 1

    def show(self, now):
        self.text.content = f"{now.status.scene.rig.name}: {now.notice}"

    def set_dark(self, dark):
        self.dark = dark

    def close(self):
        self.closed = True


class Poles(Magnets):
    """Another one, in a tab that there is, without a folder."""

    name, tab, title, every = "poles", LOOK, "", SELDOM


class Absent(Magnets):
    """One that this page has not, and so no tab for it."""

    name, tab = "absent", Tab("Absent")

    @classmethod
    def offered(cls, page):
        return False


@pytest.fixture
def plugged_in(monkeypatch):
    for kind in (Magnets, Poles, Absent):
        monkeypatch.setitem(PANELS.things, kind.name, kind)


def test_a_panel_of_a_plug_in_stands_in_its_tab_and_follows_the_page(plugged_in, running):
    person, page = running.person, running.page
    magnets, poles = page.panels["magnets"], page.panels["poles"]
    controls, study = person.tabs
    assert controls == ["Controls", "Set-up", "Look", "Export"]
    assert study == ["Pour", "Calibrate", "Diagnose", "Laboratory", "Reports", "Magnets"]
    assert "absent" not in page.panels
    running.ask(do="pour_link", text="pour=strong")
    told = "funnel: link: 'strong' is neither a shipped scene nor the one that this page started with"
    wait_for(lambda: person.within("Magnets").within("Pull").text == told)
    wait_for(lambda: person.within("Look").text.endswith(told))
    with pytest.raises(AssertionError, match="nothing is called ''"):
        person.within("Look").within(poles.title)  # no folder of its own
    for panel in (magnets, poles):
        wait_for(lambda panel=panel: panel.drawn > 3)
    running.ask(do="theme")
    wait_for(lambda: not magnets.dark)
    page.close()
    assert magnets.closed


def test_an_event_that_is_no_change_is_no_mark(running):
    """Of two events the one that is a change is marked, and the other is not."""
    person, session = running.person, running.session
    session.now = replace(session.now, time=0.5)
    session.events += [Event(1, 0.4, "refused: nothing"), Event(1, 0.45, "friction", is_change=True)]
    wait_for(lambda: curves(person).data[-1].any())
    moments, *_, marks = curves(person).data
    assert moments[marks > 0.0].tolist() == [0.45]
