"""The page as a whole below the browser: one loop, all panels, another scene, a real recording."""

import threading
import time
from dataclasses import replace

import pytest

from explorer.diagnosis.process import DiagnoseProcess
from explorer.live.messages import Event, SessionState, Status
from explorer.logs.recording_reader import read_recording
from explorer.project.project import study_project
from explorer.scene.source import material_source, rig_source
from explorer.viewer.app import serve
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.panel import LOOK, SELDOM, Panel, Tab
from explorer.viewer.panels import PANELS
from solver.scenes.scene import value
from tests.explorer.background.waiting import wait_for
from tests.explorer.viewer.page_session import PageSession, frame_of, page_of

SOURCE = material_source("sunflower_extract")
FRICTION = "pair.seed.seed.static_friction"


class Session(PageSession):
    """With the rest of what the page's loop asks."""

    def new_events(self):
        events, self.events = tuple(self.events), []
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
def running(tmp_path, monkeypatch):
    """A page whose loop runs in a thread, and its session."""
    monkeypatch.setattr("explorer.viewer.page.data_folder", lambda: tmp_path)
    server, session, stop = guarded_server("127.0.0.1", 0, "test"), Session(SOURCE), threading.Event()
    diagnosis = DiagnoseProcess(tmp_path / "diagnoses", tmp_path / "runs.sqlite")
    page = page_of(server, session, diagnosis, tmp_path)
    loop = threading.Thread(target=page.run, args=(stop,))
    loop.start()
    yield page, session
    stop.set()
    loop.join(10)
    page.close()
    diagnosis.close()
    server.stop()


def test_a_change_reaches_list_chart_and_command_line_and_is_undone(running):
    page, session = running
    page._actions.post(lambda: session.set_parameters({FRICTION: 0.2}))
    wait_for(lambda: "0.57 → <b>0.2</b>" in page.panels["changes"]._list.content)
    wait_for(lambda: page.panels["chart"]._plot.series[-1]["label"].endswith("0.57 → 0.2"))
    wait_for(lambda: f"{FRICTION}=0.2" in page.panels["output"]._command.content)
    page._actions.post(page.panels["changes"]._undo)
    wait_for(lambda: "Everything is at its default" in page.panels["changes"]._list.content)
    assert value(session.now.scene, FRICTION) == 0.57


def test_all_panels_follow_another_rig(running):
    page, session = running
    drum = rig_source("rotating_drum", "nine_sphere_seed")
    page._actions.post(lambda: session.start(drum.scene, 3, drum))
    wait_for(lambda: "--seed 3" in (told := page.panels["output"]._command.content) and "rotating_drum" in told)
    wait_for(lambda: "rig.speed_rpm" in page.panels["set_up"]._controls._inputs)
    assert page.panels["scene"]._rig.value == "rotating_drum"
    assert page.panels["look"]._status.scene == drum.scene


def test_a_recording_of_the_page_holds_the_changes(running, tmp_path):
    rerun_chunk = pytest.importorskip("rerun.chunk")
    page, session = running
    session.newest = frame_of([0, 1], [[0.0, 0.0, 0.01], [0.0, 0.02, 0.01]])
    page._actions.post(lambda: page._context.recording.begin("rerun (.rrd)"))
    wait_for(lambda: page._context.recording.running)
    time.sleep(0.2)
    page._actions.post(lambda: session.set_parameters({FRICTION: 0.2}))
    wait_for(lambda: f"{FRICTION}=0.2" in page.panels["output"]._command.content)
    time.sleep(0.2)
    page._actions.post(page._context.recording.end)
    wait_for(lambda: not page._context.recording.running)
    path = page._context.recording.path
    assert path.parent == tmp_path / "recordings"
    texts = []
    for chunk in rerun_chunk.RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if "TextLog:text" in batch.schema.names:
            texts += [text for row in batch["TextLog:text"].to_pylist() for text in row or ()]
    assert f"{FRICTION}: 0.57 → 0.2" in texts


class RestartedPage:
    """Stands in for the page: it hands its recorder two pours, and ends."""

    def __init__(self, *others, place):
        (self._recorder,) = others[-1]

    def run(self, stop):
        for generation, times in ((1, (1.0,)), (2, (0.0, 0.5))):
            for now in times:
                status = Status(SessionState.RUNNING, "", SOURCE.scene, 1, generation, 1.0, time=now)
                frame = frame_of([0], [[0.0, 0.0, 0.01]], generation=generation)
                self._recorder.take(replace(frame, time=now), status)

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
    page, _ = running
    gui, magnets, poles = page._server.gui, page.panels["magnets"], page.panels["poles"]
    containers = gui._container_handle_from_uuid.values()
    groups = {id(one._parent): one._parent._tab_handles for one in containers if hasattr(one, "_parent")}
    controls, study = groups.values()
    assert [tab._label for tab in controls] == ["Controls", "Set-up", "Look", "Export"]
    assert [tab._label for tab in study] == ["Pour", "Calibrate", "Diagnose", "Laboratory", "Reports", "Magnets"]
    (folder,) = study[-1]._children.values()
    assert (folder.label, list(folder._children.values())) == ("Pull", [magnets.text])
    assert list(controls[2]._children.values())[-1] is poles.text
    assert "absent" not in page.panels
    page._actions.post(lambda: float("strong"))
    for panel in (magnets, poles):
        wait_for(lambda panel=panel: panel.text.content == "funnel: could not convert string to float: 'strong'")
        wait_for(lambda panel=panel: panel.drawn > 3)
    page._actions.post(lambda: page._switch_theme())
    wait_for(lambda: not magnets.dark)
    page.close()
    assert magnets.closed


def test_an_event_that_is_no_change_is_no_mark(running):
    page, session = running
    session.events.append(Event(1, 0.4, "refused: nothing"))
    session.now = replace(session.now, time=0.5)
    wait_for(lambda: len(page._events) == 1)
    time.sleep(0.3)
    assert page.panels["chart"]._plot.data[-1].sum() == 0
