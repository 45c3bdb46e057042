"""What stands around viser's page: pages of our own, the channel to it, the timeline and the state line."""

import asyncio
import http.client
import json
import math
import threading
from dataclasses import replace

import pytest
import websockets

from explorer.background.command_process import CommandStatus
from explorer.errors import CommandError
from explorer.live.messages import Event, SessionState, Status
from explorer.project.steps import Finished, Room, Step, StepState, command_step, measured_step, next_step, pour_step
from explorer.scene.source import material_source
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.panel import Now
from explorer.viewer.shell.channel import LONGEST_COMMAND, PATH, ShellChannel
from explorer.viewer.shell.state_line import StateLine
from explorer.viewer.shell.timeline import FASTEST, Timeline, timeline_state
from explorer.viewer.shell.web_pages import WebPage, WebPages, first_page
from solver.observables.observable import Value
from solver.pours.record import Outcome
from tests.explorer.background.waiting import wait_for
from tests.explorer.viewer.page_session import PageSession, page_context
from tests.explorer.viewer.study_panel_at_hand import FakeStudy

IDLE = CommandStatus("idle")
SCENE = material_source("sunflower_extract").scene


@pytest.fixture(scope="module")
def served():
    """Server, pages and channel."""
    pages, channel = WebPages("Beans & more"), ShellChannel()
    server = guarded_server("127.0.0.1", 0, "test", pages, channel)
    yield server.get_port(), pages, channel
    server.stop()


def get(port, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders()), answer.read()


def test_viser_s_first_page_carries_our_style_and_script(served):
    port = served[0]
    status, headers, body = get(port, "/")
    assert status == 200
    assert headers["Content-Type"].startswith("text/html")
    text = body.decode()
    assert "/shell/shell.js" in text
    assert "/shell/shell.css" in text
    assert "<title>Beans &amp; more</title>" in text
    for name, kind in (("shell.js", "text/javascript"), ("shell.css", "text/css"), ("plotly.js", "text/javascript")):
        status, headers, body = get(port, f"/shell/{name}")
        assert (status, headers["Content-Type"].split(";")[0]) == (200, kind)
        assert len(body) > 1000


def test_another_first_page_of_viser_is_refused_at_once():
    with pytest.raises(CommandError, match="another version is needed"):
        first_page("title", "<html><title>Something else</title></html>")


def test_a_folder_is_served_by_an_id_and_nothing_outside_it(served, tmp_path):
    port, pages, _ = served
    folder = tmp_path / "study-20261126"
    (folder / "figures").mkdir(parents=True)
    (folder / "report.html").write_text("<p>verdict</p>", encoding="utf-8")
    (folder / "figures" / "one.svg").write_text("<svg/>", encoding="utf-8")
    (folder / "runs.sqlite").write_bytes(b"secret")
    (tmp_path / "secret.html").write_text("secret", encoding="utf-8")
    (folder / "link.html").symlink_to(tmp_path / "secret.html")
    address = pages.publish_folder(folder)
    assert "study" not in address
    status, headers, body = get(port, f"{address}report.html")
    assert (status, body) == (200, b"<p>verdict</p>")
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert get(port, f"{address}figures/one.svg")[0] == 200
    for name in ("runs.sqlite", "link.html", "../secret.html", "%2e%2e/secret.html", "..%2fsecret.html", ""):
        assert get(port, address + name)[0] == 404, name
    (folder / "report.html").unlink()
    assert get(port, f"{address}report.html")[0] == 404


def test_pages_obey_the_rules_of_host_and_origin(served):
    port, pages, _ = served
    pages.publish("/study/abc.json", WebPage("application/json", b"{}"))
    assert get(port, "/study/abc.json")[0] == 200
    assert get(port, "/study/abc.json", Host="evil.example")[0] == 421
    assert get(port, "/study/abc.json", **{"Sec-Fetch-Site": "cross-site"})[0] == 403
    assert get(port, "/study/abc.json", **{"Sec-Fetch-Site": "same-origin"})[0] == 200
    assert get(port, "/study/other.json")[0] == 404


def talk(port, origin, *sent, told=1):
    """Messages that the channel sends, after ``sent``."""

    async def attempt():
        async with websockets.connect(f"ws://127.0.0.1:{port}{PATH}", origin=origin) as socket:
            for one in sent:
                await socket.send(one)
            return [json.loads(await asyncio.wait_for(socket.recv(), 20)) for _ in range(told)]

    return asyncio.run(attempt())


def test_the_channel_tells_what_is_new_and_takes_named_commands_only(served):
    port, _, channel = served
    taken = []
    channel.offer("seek", lambda command: (taken.append(command), channel.tell("answer", len(taken))))
    channel.tell("theme", {"dark": True})
    origin = f"http://127.0.0.1:{port}"
    noise = ["nothing", "[1]", '{"do": ["seek"]}', json.dumps({"do": "seek", "x": "y" * LONGEST_COMMAND})]
    first, second = talk(port, origin, *noise, json.dumps({"do": "seek", "time": 0.5}), told=2)
    assert first["theme"] == {"dark": True}
    assert second == {"answer": 1}
    assert taken == [{"do": "seek", "time": 0.5}]


@pytest.mark.parametrize("origin", ["http://evil.example", "null", None])
def test_a_foreign_page_has_no_channel(served, origin):
    with pytest.raises(websockets.InvalidStatus):
        talk(served[0], origin)


class Moved(PageSession):
    def play(self):
        self.asked.append("play")

    def pause(self):
        self.asked.append("pause")

    def step_back(self):
        self.asked.append("back")

    def back_to(self, time):
        self.asked.append(("back to", time))

    def step(self):
        self.asked.append("step")

    def set_speed(self, factor):
        self.asked.append(("speed", factor))


@pytest.fixture
def at_hand(server):
    session = Moved(material_source("sunflower_extract"))
    session.now = replace(session.now, time=0.8, earliest=0.2)
    context = page_context(server, session, study=FakeStudy(), diagnosis=FakeStudy())
    return session, context


def test_a_pause_of_a_pour_that_is_starting_is_shown_and_taken_back(at_hand):
    """Both would be "pause", as the pour reports nothing else before it has started."""
    session, context = at_hand
    session.now = replace(session.now, state=SessionState.STARTING)
    timeline, told = Timeline(context), []
    context.channel.tell = lambda name, state: told.append(state["playing"])

    def shown():
        timeline.show(Now(session.now))
        return told.pop()

    assert shown()
    for playing in (False, True, False):
        context.channel.take(json.dumps({"do": "toggle"}))
        assert shown() is playing
    assert session.asked == ["pause", "play", "pause"]
    session.now = replace(session.now, generation=session.now.generation + 1)
    assert shown()  # the next pour begins as ever


def test_the_timeline_goes_back_to_a_moment_that_is_kept_and_no_further(at_hand):
    session, context = at_hand
    Timeline(context)
    for wanted, moment in ((0.5, 0.5), (0.0, 0.2), (0.2, 0.2)):
        context.channel.take(json.dumps({"do": "seek", "time": wanted}))
        assert session.asked.pop() == ("back to", moment)
    context.channel.take(json.dumps({"do": "seek", "time": 0.9}))
    assert not session.asked
    with pytest.raises(ValueError, match="time"):
        context.channel.take(json.dumps({"do": "seek", "time": "soon"}))
    context.channel.take(json.dumps({"do": "speed", "factor": 1000}))
    assert session.asked == [("speed", FASTEST)]


@pytest.mark.parametrize("state", SessionState)
def test_the_main_button_does_what_stands_on_it(at_hand, state):
    session, context = at_hand
    Timeline(context)
    session.now = replace(session.now, state=state)
    context.channel.take(json.dumps({"do": "toggle"}))
    assert session.asked == ["pause" if timeline_state(Now(session.now), "")["playing"] else "play"]


def test_the_timeline_shows_this_pour_s_events_up_to_now():
    status = Status(SessionState.RUNNING, "", SCENE, 1, 2, 1.0, time=1.0, earliest=math.nan, real_time_factor=0.5)
    events = [Event(1, 0.5, "before"), Event(2, 0.4, "friction"), Event(2, 1.5, "to come")]
    state = timeline_state(Now(status, events=events, notice="no such folder"), "")
    assert [one["text"] for one in state["events"]] == ["friction"]
    assert state["playing"]
    assert state["earliest"] == 0.0
    assert "0.50 × real time" in state["condition"]
    assert state["notice"] == "no such folder"
    json.dumps(state, allow_nan=False)


def test_the_beginning_is_on_the_timeline_of_a_pour_that_is_kept_from_its_first_step_on():
    status = Status(SessionState.PAUSED, "", SCENE, 1, 2, 1.0, time=0.01, earliest=7e-6)
    now = Now(status, events=[Event(2, 0.0, "poured anew")])
    state = timeline_state(now, "")
    assert (state["earliest"], state["events"][0]["time"]) == (0.0, 0.0)
    later = timeline_state(Now(replace(status, earliest=0.004), events=now.events), "")
    assert later["earliest"] == 0.004


def test_the_timeline_says_what_is_done_beside_the_pour(at_hand):
    session, context = at_hand
    timeline = Timeline(context)
    held = threading.Event()
    context.bench_work.start("reading the photograph", held.wait, lambda _: None)
    timeline.show(Now(session.now))
    assert context.channel.told["timeline"]["busy"] == "Busy reading the photograph …"
    held.set()
    wait_for(lambda: not context.bench_work.busy_with)
    timeline.show(Now(session.now))
    assert context.channel.told["timeline"]["busy"] == ""


def test_the_state_line_says_how_far_a_project_is(at_hand):
    session, context = at_hand
    StateLine(context).show(Now(session.now))
    told = context.channel.told["project"]
    assert [(one["name"], one["state"]) for one in told["steps"]] == [
        ("Material", "assumed"),
        ("Measured", "assumed"),
        ("Pour", "running"),
        ("Calibrate", "empty"),
        ("Diagnose", "empty"),
        ("Report", "empty"),
    ]
    assert "calibration" in told["next"]
    assert told["next_room"] == "Calibrate"


def test_a_pour_without_a_pile_is_a_failed_step_that_comes_first():
    jammed = Status(SessionState.ENDED, "", SCENE, 1, 1, 1.0, outcome=Outcome.JAMMED)
    assert pour_step(jammed).state == StepState.FAILED
    heap = replace(jammed, outcome=Outcome.AT_REST, observables={"angle_of_repose_deg": Value(24.1, None)})
    assert (pour_step(heap).state, pour_step(heap).said) == (StepState.DONE, "24.1°")
    assert measured_step(()).state == StepState.EMPTY
    before = [measured_step(()), command_step("Calibrate", "", Room.CALIBRATE, IDLE, None)]
    after = [command_step("Diagnose", "", Room.DIAGNOSE, IDLE, None)]
    assert next_step([*before, pour_step(jammed), *after]) == ("see under Pour why there is no pile", Room.POUR)
    assert next_step([*before, pour_step(heap), *after])[1] == Room.LABORATORY


def test_a_study_that_broke_off_is_looked_at_before_the_model_is_doubted():
    broken = command_step("Calibrate", "", Room.CALIBRATE, CommandStatus("failed"), None)
    missed = command_step("Calibrate", "", Room.CALIBRATE, CommandStatus("idle"), Finished("out of reach", False, True))
    idle = CommandStatus("idle")
    rest = [measured_step(()), command_step("Diagnose", "", Room.DIAGNOSE, idle, None)]
    pour = Step("Pour", StepState.DONE, "", "", Room.POUR)
    assert next_step([pour, broken, *rest]) == ("see under Calibrate why it stopped", Room.CALIBRATE)
    measured = Step("Measured", StepState.MEASURED, "25°", "", Room.LABORATORY)
    assert next_step([pour, missed, measured, rest[1]]) == ("ask which effect the model lacks", Room.DIAGNOSE)
    running = command_step("Calibrate", "", Room.CALIBRATE, CommandStatus("running", done=17, planned=50), None)
    assert (running.state, running.said) == (StepState.RUNNING, "34%")
