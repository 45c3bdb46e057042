"""The page with a real solver behind it, driven over the socket as a browser drives it: clicks, keys, cameras."""

import asyncio
import contextlib
import json
import threading
import time
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
import viser
import websockets
from viser import _messages

from explorer.diagnosis.process import DiagnoseProcess
from explorer.live.messages import SessionState
from explorer.scene.meshes import scene_height
from explorer.scene.source import prepared_source
from explorer.session import Session
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.look import drawn_look
from explorer.viewer.look.camera import LINK, view_of
from explorer.viewer.shell.channel import PATH, ShellChannel
from explorer.viewer.shell.timeline import BACK, PLAY_PAUSE, STEP
from solver.scenes.scene import with_values
from tests.explorer.background.waiting import wait_for
from tests.explorer.beads import bead_scene
from tests.explorer.viewer.page_session import page_of


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page in a thread of its own, and the session behind it; no one else uses that while the thread runs."""
    channel, session, stop = ShellChannel(), Session(), threading.Event()
    server = guarded_server("127.0.0.1", 0, "test", channel=channel)
    session.start(bead_scene(), 1)
    data = tmp_path_factory.mktemp("data")
    page = page_of(server, session, DiagnoseProcess(data / "diagnoses", None), data, channel)
    thread = threading.Thread(target=page.run, args=(stop,))
    thread.start()
    yield SimpleNamespace(server=server, page=page, look=page.panels["look"])
    stop.set()
    thread.join()
    session.close()
    server.stop()


class Browser:
    """As much of a browser as the server needs: a camera, and messages of one's own; what it is told it throws away."""

    def __init__(self, server):
        self.received = 0
        before = len(server.get_clients())
        self._server, self._loop, self._ready = server, asyncio.new_event_loop(), threading.Event()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._talk(),), daemon=True)
        self._thread.start()
        assert self._ready.wait(10)
        wait_for(lambda: len(server.get_clients()) > before)

    async def _talk(self):
        port = self._server.get_port()
        async with websockets.connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[f"viser-v{viser.__version__}"],
            origin=f"http://127.0.0.1:{port}",
            max_size=None,
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

    def press(self, label):
        """Trigger the command that the key of ``label`` triggers."""
        commands = self._server.gui._command_handle_from_uuid
        (uuid,) = [uuid for uuid, handle in commands.items() if handle._impl.props.label == label]
        self.send("CommandTriggerMessage", uuid=uuid)

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
        client = next(iter(self._server.get_clients().values()))
        return client.camera


def encoded(kind, **fields):
    assert hasattr(_messages, kind)
    return msgspec.msgpack.encode({"type": kind, **fields})


@pytest.fixture(scope="module")
def browser(page):
    return Browser(page.server)


def told(page):
    """What happened last, beside the controls."""
    return page.page.panels["standing"]._box.content


def status(page):
    """The last status that the page has taken in."""
    return page.page._session._status


def test_left_arrow_goes_back_and_space_goes_on(page, browser):
    wait_for(lambda: status(page).state in (SessionState.RUNNING, SessionState.ENDED))
    wait_for(lambda: status(page).time > 0.3)
    if status(page).state == SessionState.RUNNING:
        browser.press(PLAY_PAUSE)
    wait_for(lambda: status(page).state in (SessionState.PAUSED, SessionState.ENDED))
    time.sleep(0.3)
    before = status(page).time
    browser.press(BACK)
    wait_for(lambda: status(page).time < before)
    back = status(page)
    assert (back.state, back.earliest < 1e-3) == (SessionState.PAUSED, True)
    assert back.time == pytest.approx(before - 0.01, abs=0.002)
    wait_for(lambda: page.look._drawn.time == back.time)
    wait_for(lambda: f"{back.time:.3f} s" in page.page.panels["readings"]._html.content)
    browser.press(STEP)
    wait_for(lambda: status(page).time > back.time)


def test_keys_colour_the_bodies_and_the_solver_sends_what_that_takes(page, browser):
    browser.press("Colour by the next quantity")
    wait_for(lambda: page.look._settings.look.colour_by == "speed")
    wait_for(lambda: "speed [m/s]" in page.look._colours._bar.content)
    wait_for(lambda: page.page._session.details() is not None)
    details = page.page._session.details()
    assert len(details.load) == status(page).bodies
    (node,) = page.look._nodes.bodies.nodes
    wait_for(lambda: len(np.unique(node.batched_colors[: status(page).bodies], axis=0)) > 1)


def test_a_click_into_the_scene_finds_a_body_and_one_beside_lets_it_go(page, browser):
    # The step of the first test has ended and its last frame is on the page: from here on no body moves.
    wait_for(lambda: status(page).state in (SessionState.PAUSED, SessionState.ENDED))
    wait_for(lambda: page.look._drawn is not None and page.look._drawn.time == status(page).time)
    frame = page.look._drawn
    top = int(np.argmax(frame.position[:, 2]))
    browser.click(frame.position[top] + [0, 0, 1.0], (0, 0, -1))
    wait_for(lambda: page.look._selected == top)
    wait_for(lambda: f"bead no. {top + 1} of" in page.look._text.content)
    wait_for(lambda: "Coordination number" in page.look._text.content)
    browser.press("Follow the body that was clicked")
    wait_for(lambda: np.allclose(browser.camera.look_at, frame.position[top], atol=1e-3))
    browser.press("Let the body go")
    wait_for(lambda: page.look._selected is None)
    browser.click((1.0, 1.0, 1.0), (0, 0, -1))
    time.sleep(0.2)
    assert page.look._selected is None


def test_keys_move_the_camera_of_the_browser_that_pressed_them(page, browser):
    browser.press("View: side")
    expected = view_of(scene_height(bead_scene()), "Side")
    # Two messages, one after the other.
    for part in ("position", "look_at"):
        wait_for(lambda part=part: np.allclose(getattr(browser.camera, part), getattr(expected, part)))


def test_following_nobody_is_told_in_a_line(page, browser):
    browser.press("Follow the body that was clicked")
    wait_for(lambda: "click a body first" in told(page))


def move_slider(page, browser, label, value):
    """What a browser sends when a person moves a slider."""
    handles = page.server.gui._gui_input_handle_from_uuid
    uuid = next(uuid for uuid, handle in handles.items() if handle._impl.props.label == label)
    browser.send("GuiUpdateMessage", uuid=uuid, updates={"value": value})


def test_two_browsers_share_one_pour_and_a_change_tells_whose_it_was(page, browser):
    second = Browser(page.server)
    wait_for(lambda: page.page._people.present == 2)
    move_slider(page, second, "Static friction", 0.21)
    wait_for(lambda: "· browser 2" in told(page))
    assert "0.21" in told(page)
    move_slider(page, browser, "Static friction", 0.33)
    wait_for(lambda: "· browser 1" in told(page))
    # The first one leaves in the middle of it all: nothing ends, and who is alone is not named.
    second.leave()
    wait_for(lambda: page.page._people.present == 1)
    move_slider(page, browser, "Static friction", 0.44)
    wait_for(lambda: "0.44" in told(page).split("· browser")[0])
    assert status(page).state in (SessionState.RUNNING, SessionState.PAUSED, SessionState.ENDED)


def test_a_browser_that_comes_back_finds_the_pour_as_it_is(page, browser):
    """A reload is a new connection: the server sends it what stands, and the pour is the same one."""
    generation = status(page).generation
    again = Browser(page.server)
    wait_for(lambda: again.received > 0)
    assert status(page).generation == generation
    again.leave()


def test_shadows_are_switched_off_and_on(page, monkeypatch):
    lit = []
    monkeypatch.setattr(drawn_look, "light", lambda server, shadows: lit.append(shadows))
    settings = page.look._settings
    for shadows in (False, True):
        page.page._actions.post(lambda shadows=shadows: settings.change(shadows=shadows))
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
        now, frame = status(page), page.look._drawn
        there = (now.seed, now.state) == (seed, SessionState.PAUSED) and now.generation > after and now.time >= moment
        return there and frame is not None and (frame.generation, frame.time) == (now.generation, now.time)

    def standing():
        now, frame = status(page), page.look._drawn
        drawn = None if frame is None else (frame.generation, frame.time)
        return f"{now.state}, {now.message!r}, {(now.seed, now.generation, now.time)}, {drawn}, {page.page._notice!r}"

    wait_for(still, standing=standing)
    return page.look._drawn


def test_a_link_leads_back_to_the_same_scene_and_moment_bit_for_bit(page, browser):
    post, session = page.page._actions.post, page.page._session
    source = prepared_source("bouncing_beads")
    scene = with_values(source.scene, {"pair.bead.bead.restitution": 0.77})
    post(lambda: session.start(scene, 5, source))
    post(lambda: session.run_to(0.1234))
    there, moment = stands(page, 5, 0.1234), status(page).time
    assert moment == pytest.approx(0.1234, abs=1e-3)
    move_slider(page, browser, LINK, True)
    handles = page.server.gui._gui_input_handle_from_uuid.values()
    address = next(handle for handle in handles if handle._impl.props.label == "Address")
    wait_for(lambda: "#" in address.value)
    link, text = address.value.split("#")
    assert "initialCameraPosition=" in link
    assert len(address.value) < 400

    post(lambda: session.start(source.scene, 6, source))
    post(lambda: session.run_to(0.05))
    stands(page, 6, 0.05)
    other = status(page).generation
    # A browser that comes with the link in its address sends nothing of it by itself.
    again = Browser(page.server)
    assert status(page).generation == other
    again.leave()
    command(page.server, do="pour_link", text=text)
    back = stands(page, 5, moment, other)
    assert status(page).scene == scene
    assert status(page).time == moment
    np.testing.assert_array_equal(back.position, there.position)
    np.testing.assert_array_equal(back.quaternion, there.quaternion)


@pytest.mark.parametrize("text", ["pour=/etc/passwd", "pour=mesh_funnel&set=rig.mesh%3D/etc/passwd", 7, "x" * 2001])
def test_a_link_that_is_not_allowed_is_refused_in_a_line_and_pours_nothing(page, browser, text):
    before = status(page).generation
    command(page.server, do="pour_link", text=text)
    wait_for(lambda: told(page).count("link: ") == 1 or page.page._notice.startswith("link: "))
    assert status(page).generation == before
    # So that the next refusal is seen to be one of its own.
    page.page._actions.post(lambda: None)
    wait_for(lambda: page.page._notice == "")
