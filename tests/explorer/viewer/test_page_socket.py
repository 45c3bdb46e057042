"""The page with a real solver behind it, driven over the socket as a browser drives it: clicks, keys, cameras."""

import asyncio
import contextlib
import json
import threading
from queue import SimpleQueue
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
import viser
import websockets
from viser import _messages

from explorer.diagnosis.process import DiagnoseProcess
from explorer.live.messages import SessionState
from explorer.live.session import Session
from explorer.scene.meshes import scene_height
from explorer.scene.source import SceneSource, prepared_source
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.look import drawn_look
from explorer.viewer.look.camera import LINK, view_of
from explorer.viewer.look.inspector import NOBODY
from explorer.viewer.look.look import COMPONENT
from explorer.viewer.shell.channel import PATH, ShellChannel
from explorer.viewer.shell.timeline import BACK, PLAY_PAUSE, STEP
from solver.scenes.scene import with_values
from tests.explorer.background.waiting import wait_for
from tests.explorer.beads import bead_scene
from tests.explorer.viewer.page_session import page_of
from tests.explorer.viewer.person import Person


class OpenSession(Session):
    """Remembers what it told the page last; what ``asked`` holds is done in the page's thread, which alone may use it.

    On the page no number says which pour it is, and no time has more than three digits.
    """

    def __init__(self):
        super().__init__()
        self.asked, self.now, self.newest, self.known = SimpleQueue(), None, None, None

    def frame(self):
        while not self.asked.empty():
            self.asked.get()(self)
        found = super().frame()
        self.newest = self.newest if found is None else found
        return found

    def status(self):
        self.now = super().status()
        return self.now

    def details(self):
        self.known = super().details()
        return self.known


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page in a thread of its own, the session behind it, and a person who reads it."""
    channel, session, stop = ShellChannel(), OpenSession(), threading.Event()
    server = guarded_server("127.0.0.1", 0, "test", channel=channel)
    session.start(bead_scene(), 1)
    data = tmp_path_factory.mktemp("data")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("explorer.viewer.page.data_folder", lambda: data)
        page = page_of(server, session, DiagnoseProcess(data / "diagnoses", None), data, channel)
    thread = threading.Thread(target=page.run, args=(stop,))
    thread.start()
    yield SimpleNamespace(server=server, session=session, channel=channel, person=Person(server))
    stop.set()
    thread.join()
    session.close()
    server.stop()


@pytest.fixture
def beads(page):
    """The page with a pour of its own, of beads that stand still in the air."""
    before, scene = page.session.now.generation, bead_scene()
    pour(page, scene, 1, SceneSource((), scene))
    page.session.asked.put(lambda session: session.run_to(0.35))
    stands(page, 1, 0.35, before)
    return page


def pour(page, scene, seed, source):
    """Begin a pour by another hand than that of a person at the page."""
    page.session.asked.put(lambda session: session.start(scene, seed, source))


class Browser:
    """As much of a browser as the server needs: a camera, and messages of one's own; what it is told it throws away."""

    def __init__(self, page):
        self._person, server, self.received = page.person, page.server, 0
        before = set(server.get_clients())
        self._server, self._loop, self._ready = server, asyncio.new_event_loop(), threading.Event()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._talk(),), daemon=True)
        self._thread.start()
        assert self._ready.wait(10)
        (self._id,) = wait_for(lambda: set(server.get_clients()) - before)

    @property
    def name(self):
        """What others are told that this one is called."""
        return f"browser {self._id + 1}"

    async def _talk(self):
        port = self._server.get_port()
        async with websockets.connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[f"viser-v{viser.__version__}"],
            origin=f"http://127.0.0.1:{port}",
            max_size=None,
            ping_interval=None,  # a machine that is held is no reason to go
        ) as self._socket:
            await self._socket.send(
                encoded(
                    "ViewerCameraMessage",
                    wxyz=(1, 0, 0, 0),
                    position=(1.0, 0.0, 0.0),
                    fov=0.5,
                    near=0.01,
                    far=100.0,
                    image_height=600,
                    image_width=800,
                    look_at=(0.0, 0.0, 0.0),
                    up_direction=(0.0, 0.0, 1.0),
                )
            )
            self._ready.set()
            with contextlib.suppress(websockets.ConnectionClosed):
                async for _ in self._socket:
                    self.received += 1

    def send(self, kind, **fields):
        asyncio.run_coroutine_threadsafe(self._socket.send(encoded(kind, **fields)), self._loop).result(10)

    def leave(self):
        """Close the connection, as a closed tab does."""
        self._loop.call_soon_threadsafe(self._socket.transport.abort)
        self._thread.join(10)
        wait_for(lambda: self._id not in self._server.get_clients())

    def press(self, label):
        """Trigger the command that the key of ``label`` triggers."""
        self.send("CommandTriggerMessage", uuid=self._person.key_uuid(label))

    def enter(self, label, value, within=None):
        """What a browser sends when a person moves a control, in the folder or tab ``within``."""
        place = self._person if within is None else self._person.within(within)
        self.send("GuiUpdateMessage", uuid=place.uuid(label), updates={"value": value})

    def click(self, origin, direction):
        self.send(
            "ScenePointerMessage",
            event_type="click",
            ray_origin=tuple(map(float, origin)),
            ray_direction=tuple(map(float, direction)),
            screen_pos=((0.5, 0.5),),
            modifier=None,
        )

    @property
    def camera(self):
        return self._server.get_clients()[self._id].camera


def encoded(kind, **fields):
    assert hasattr(_messages, kind)
    return msgspec.msgpack.encode({"type": kind, **fields})


@pytest.fixture
def browser(page):
    """The only one at the page."""
    browser = Browser(page)
    yield browser
    browser.leave()


def told(page):
    """What happened last, beside the controls."""
    return page.person.within("Controls").text


def status(page):
    """The last status that the page has taken in."""
    return page.session.now


def bodies(page):
    """The beads in 3-D."""
    return page.server.scene.get_handle_by_name("/bodies/0")


def test_no_box_of_the_page_drops_the_decimal_point_but_those_of_counts(page):
    boxes = page.person.number_boxes
    assert {one.label for one in boxes} >= {"Target: mean [°]", "Feed rate [g/s]", "Tap: time [ms]", "Mass [g]"}
    assert [one.label for one in boxes if not isinstance(one.value, int) and one.precision < 1] == []


def test_left_arrow_goes_back_and_space_goes_on(beads, browser):
    browser.press(PLAY_PAUSE)
    wait_for(lambda: status(beads).time > 0.4)
    if status(beads).state == SessionState.RUNNING:
        browser.press(PLAY_PAUSE)
    stands(beads, 1, 0.4)
    before = status(beads).time
    browser.press(BACK)
    wait_for(lambda: status(beads).time < before)
    back = status(beads)
    assert (back.state, back.earliest < 1e-3) == (SessionState.PAUSED, True)
    assert back.time == pytest.approx(before - 0.01, abs=0.002)
    places = stands(beads, 1, back.time).position
    wait_for(lambda: np.array_equal(bodies(beads).batched_positions[: len(places)], places))
    wait_for(lambda: f"Simulated time {back.time:.3f} s" in beads.person.within("Pour").text)
    browser.press(STEP)
    wait_for(lambda: status(beads).time > back.time)


def test_keys_colour_the_bodies_and_the_solver_sends_what_that_takes(beads, browser):
    person = beads.person
    browser.enter("Colour by", COMPONENT)
    wait_for(lambda: person.value("Colour by") == COMPONENT)
    browser.press("Colour by the next quantity")
    wait_for(lambda: person.value("Colour by") == "speed")
    wait_for(lambda: "speed [m/s]" in person.text)
    details = wait_for(lambda: beads.session.known)
    assert len(details.load) == status(beads).bodies
    wait_for(lambda: len(np.unique(bodies(beads).batched_colors[: status(beads).bodies], axis=0)) > 1)


def test_a_click_into_the_scene_finds_a_body_and_one_beside_lets_it_go(beads, browser):
    frame, look = beads.session.newest, beads.person.within("Look")
    top = int(np.argmax(frame.position[:, 2]))

    def click_the_top():
        browser.click(frame.position[top] + [0, 0, 1.0], (0, 0, -1))
        wait_for(lambda: f"bead no. {top + 1} of" in look.text)
        wait_for(lambda: "Coordination number" in look.text)

    click_the_top()
    browser.press("Follow the body that was clicked")
    wait_for(lambda: np.allclose(browser.camera.look_at, frame.position[top], atol=1e-3))
    browser.press("Let the body go")
    wait_for(lambda: NOBODY in look.html)
    click_the_top()
    browser.click((1.0, 1.0, 1.0), (0, 0, -1))
    wait_for(lambda: NOBODY in look.html)


def test_keys_move_the_camera_of_the_browser_that_pressed_them(beads, browser):
    browser.press("View: side")
    expected = view_of(scene_height(bead_scene()), "Side")
    # Two messages, one after the other.
    for part in ("position", "look_at"):
        wait_for(lambda part=part: np.allclose(getattr(browser.camera, part), getattr(expected, part)))


def test_following_nobody_is_told_in_a_line(beads, browser):
    browser.press("Follow the body that was clicked")
    wait_for(lambda: "click a body first" in told(beads))


def test_two_browsers_share_one_pour_and_a_change_tells_whose_it_was(beads, browser):
    second, label, pair = Browser(beads), "Static friction", "Pair (acts now)"

    def is_told(words):
        wait_for(lambda: words in told(beads), standing=lambda: f"{told(beads)}; {list(beads.server.get_clients())}")

    second.enter(label, 0.21, pair)
    is_told(f"· {second.name}")
    assert "→ 0.21" in told(beads)
    browser.enter(label, 0.33, pair)
    is_told(f"· {browser.name}")
    # One leaves in the middle of it all: nothing ends, and who is alone is not named.
    second.leave()
    browser.enter(label, 0.44, pair)
    is_told("→ 0.44")
    assert "· browser" not in told(beads)
    assert status(beads).state in (SessionState.RUNNING, SessionState.PAUSED, SessionState.ENDED)


def test_a_browser_that_comes_back_finds_the_pour_as_it_is(page, browser):
    """A reload is a new connection: the server sends it what stands, and the pour is the same one."""
    generation = status(page).generation
    again = Browser(page)
    wait_for(lambda: again.received > 0)
    assert status(page).generation == generation
    again.leave()


def test_shadows_are_switched_off_and_on(page, browser, monkeypatch):
    lit = []
    monkeypatch.setattr(drawn_look, "light", lambda server, shadows: lit.append(shadows))
    for shadows in (False, True):
        browser.enter("Shadows", shadows)
        wait_for(lambda shadows=shadows: lit[-1:] == [shadows])
    assert lit == [False, True]


def command(server, **asked):
    """Send what the script around the page sends."""

    async def send():
        address = f"127.0.0.1:{server.get_port()}"
        async with websockets.connect(f"ws://{address}{PATH}", origin=f"http://{address}") as channel:
            await channel.send(json.dumps(asked))

    asyncio.run(send())


def stands(page, seed, moment, after=0):
    """The frame of the pour with ``seed``, begun after generation ``after``, once it stands still at ``moment`` [s]."""

    def still():
        now, frame = status(page), page.session.newest
        there = now.seed == seed and now.generation > after and now.time >= moment
        at_rest = now.state in (SessionState.PAUSED, SessionState.ENDED)
        return there and at_rest and frame is not None and (frame.generation, frame.time) == (now.generation, now.time)

    def standing():
        now, frame = status(page), page.session.newest
        drawn = None if frame is None else (frame.generation, frame.time)
        return f"{now.state}, {now.message!r}, {(now.seed, now.generation, now.time)}, {drawn}, {notice(page)!r}"

    wait_for(still, standing=standing)
    return page.session.newest


def test_a_link_leads_back_to_the_same_scene_and_moment_bit_for_bit(page, browser):
    source = prepared_source("bouncing_beads")
    scene = with_values(source.scene, {"pair.bead.bead.restitution": 0.77})
    pour(page, scene, 5, source)
    page.session.asked.put(lambda session: session.run_to(0.1234))
    there, moment = stands(page, 5, 0.1234), status(page).time
    assert moment == pytest.approx(0.1234, abs=1e-3)
    browser.enter(LINK, True)
    wait_for(lambda: "#" in page.person.value("Address"))
    address = page.person.value("Address")
    link, text = address.split("#")
    assert "initialCameraPosition=" in link
    assert len(address) < 400

    pour(page, source.scene, 6, source)
    page.session.asked.put(lambda session: session.run_to(0.05))
    stands(page, 6, 0.05)
    other = status(page).generation
    # A browser that comes with the link in its address sends nothing of it by itself.
    again = Browser(page)
    assert status(page).generation == other
    again.leave()
    command(page.server, do="pour_link", text=text)
    back = stands(page, 5, moment, other)
    assert (status(page).state, status(page).scene) == (SessionState.PAUSED, scene)
    assert status(page).time == moment
    np.testing.assert_array_equal(back.position, there.position)
    np.testing.assert_array_equal(back.quaternion, there.quaternion)


@pytest.mark.parametrize("text", ["pour=/etc/passwd", "pour=mesh_funnel&set=rig.mesh%3D/etc/passwd", 7, "x" * 2001])
def test_a_link_that_is_not_allowed_is_refused_in_a_line_and_pours_nothing(page, browser, text):
    before = status(page).generation
    command(page.server, do="pour_link", text=text)
    wait_for(lambda: notice(page).startswith("link: "))
    assert status(page).generation == before
    # So that the next refusal is seen to be one of its own.
    browser.press("Let the body go")
    wait_for(lambda: notice(page) == "")


def notice(page):
    """What was refused last, as browsers are shown it below the page."""
    return page.channel.told["timeline"]["notice"]
