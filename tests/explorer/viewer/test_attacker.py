"""Somebody at the page's socket who keeps to no rule; see tests/faults/attacker.py. No solver, one page for all."""

import http.client
import io
import json
import math
import re
import zipfile
from types import SimpleNamespace

import pytest
import viser
from PIL import Image
from viser import _messages
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from explorer.errors import CommandError
from explorer.live.messages import SessionState
from explorer.viewer import guarded_server as guard
from explorer.viewer import incoming
from explorer.viewer.actions import Actions
from explorer.viewer.guarded_server import PortError, check_token, guarded_server
from explorer.viewer.output import picture
from explorer.viewer.output.send_file import send_file
from explorer.viewer.shell.channel import PATH, ShellChannel
from explorer.viewer.shell.web_pages import WebPages
from solver.scenes.scene import check, parameters, value
from tests.explorer.background.waiting import wait_for
from tests.explorer.viewer.person import Person
from tests.faults.attacker import (
    NO_MESSAGES,
    Attacker,
    attacked_page,
    hostile_messages,
    listening,
    part_of,
    start_of,
    wrong_values,
)

TOKEN = "0123456789abcdef"


@pytest.fixture(scope="module")
def attacked(tmp_path_factory):
    """A page whose loop runs, and its session; it reads as fast as it can."""
    with attacked_page(tmp_path_factory.mktemp("data")) as page:
        yield page


@pytest.fixture
def attacker(attacked):
    """Somebody whom the page takes for a browser."""
    somebody = Attacker(attacked.server)
    somebody.found = somebody.controls()
    yield somebody
    somebody.close()
    wait_for(lambda: not attacked.server.get_clients())


def carried_out(attacked):
    """Wait until the page's loop has done what was left for it: in its next turn but one at the latest."""
    before = attacked.session.turns
    wait_for(lambda: attacked.session.turns >= before + 2)


def idle(attacked):
    """Whether the page says nothing of work in the background."""
    return "Busy " not in Person(attacked.server).text


def callbacks(server):
    """How many callbacks each control has. viser keeps them, and no person sees them."""
    return {uuid: len(one._impl.update_cb) for uuid, one in server.gui._gui_input_handle_from_uuid.items()}


def kept_for_all(server):
    """Messages that viser keeps for every browser to come."""
    return list(server._websock_server._broadcast_buffer.message_from_id.values())


def on_their_way(server):
    """What viser has of files that are not whole yet."""
    return server.gui._current_file_upload_states


def test_no_message_reaches_the_solver_out_of_bounds_or_breaks_anything(attacked, attacker, capfd):
    sizes = callbacks(attacked.server)
    messages = list(hostile_messages(attacker.found, every=4))
    with listening(attacked.server, capfd) as heard:
        for message in messages:
            attacker.send(**message)
        for content in NO_MESSAGES:
            attacker.send_raw(content)
        attacker.settle()
        carried_out(attacked)
    assert len(messages) > 2000
    assert heard.lines == []
    assert list(wrong_values(attacked.server)) == []
    now = callbacks(attacked.server)
    # Panels that were given another choice may have made their controls anew.
    stayed = sizes.keys() & now.keys()
    assert len(stayed) > 200
    assert {uuid: now[uuid] for uuid in stayed} == {uuid: sizes[uuid] for uuid in stayed}
    scene = attacked.session.now.scene
    check(scene)
    numbers = [now for path in parameters(scene) if isinstance(now := value(scene, path), int | float)]
    assert len(numbers) > 30
    assert all(map(math.isfinite, numbers))
    assert attacked.loop.is_alive()
    assert all(math.isfinite(x) for x in attacked.server.get_clients()[attacker.number].camera.position)
    assert attacked.session.now.state == SessionState.RUNNING


def test_nothing_of_one_browser_is_kept_for_the_others(attacked, attacker):
    """viser sends on what a browser says of forms, and what has arrived of its files, and keeps both for ever."""
    upload = next(one for one in attacker.found if one.kind == "GuiUploadButtonMessage")
    for k in range(50):
        attacker.send(type="GuiFormDirtyMessage", uuid=f"dirty-{k}")
        attacker.send(**start_of(upload, f"file-{k}", 0))
    attacker.settle()
    kinds = (_messages.GuiFormDirtyMessage, _messages.FileTransferPartAck)
    kept = kept_for_all(attacked.server)
    assert kept
    assert [one for one in kept if isinstance(one, kinds)] == []


def test_a_file_takes_no_more_than_it_may(attacked, attacker):
    button = next(one for one in attacker.found if one.kind == "GuiUploadButtonMessage")
    states = on_their_way(attacked.server)
    text = next(one for one in attacker.found if one.kind == "GuiTextMessage")
    attacker.send(**start_of(button, "too-large", incoming.MOST_UPLOAD_BYTES + 1))
    attacker.send(**start_of(button, "crumbs", 10_000, parts=10_000))
    attacker.send(**start_of(button, "no-parts", 10_000, parts=0))
    attacker.send(**start_of(button, "negative", -1))
    attacker.send(**start_of(text, "no-button", 10))
    attacker.send(**start_of(button, "../x", 10))
    attacker.send(**start_of(button, "\0", 10, name="a\0b.toml"))
    attacker.send(**start_of(button, "long", 10, name="x" * 100_000))
    # A file that is announced as a small one.
    attacker.send(**start_of(button, "small", 10, parts=1))
    attacker.send(**part_of(button, "small", 0, b"x" * 1_000_000))
    attacker.send(**part_of(button, "small", 7, b"x"))
    attacker.send(**part_of(button, "small", 0, b""))
    attacker.send(**start_of(button, "half", 30_000_000))
    attacker.send(**part_of(button, "half", 0, b"x" * 500_000))
    attacker.send(**part_of(button, "half", 0, b"y" * 500_000))
    attacker.send(**start_of(button, "another-half", 30_000_000))
    attacker.settle()
    assert set(states) == {"small", "half"}
    assert states["small"]["parts"] == {}
    assert {k: part[:1] for k, part in states["half"]["parts"].items()} == {0: b"x"}


def test_who_never_came_leaves_nothing_behind(attacked):
    """viser frees the files of browsers alone that have told their camera."""
    present = Attacker(attacked.server)
    button = next(one for one in present.controls() if one.kind == "GuiUploadButtonMessage")
    ghost = Attacker(attacked.server, told=False)
    ghost.controls()
    ghost.send(**start_of(button, "ghost", 1000, parts=2))
    ghost.send(**part_of(button, "ghost", 0, b"x" * 10))
    ghost.socket.ping().wait(30.0)
    ghost.close()
    present.settle()
    assert on_their_way(attacked.server) == {}
    present.close()
    wait_for(lambda: not attacked.server.get_clients())


HOSTILE_NAMES = (
    "../../escaped.toml",
    "/tmp/escaped.toml",
    "..\\..\\escaped.csv",
    "x" * 200 + ".stl",
    ".toml",
    "..",
    "con.toml/../../escaped.csv",
    "<img src=x onerror=alert(1)>.csv",
    "a b‮.jpg",
)


@pytest.mark.parametrize("name", HOSTILE_NAMES)
def test_a_name_from_a_browser_is_no_path(attacked, attacker, capfd, name):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("../../escaped.toml", "x = 1")
    outside = {path for path in attacked.data.parent.rglob("*") if attacked.data not in path.parents}
    with listening(attacked.server, capfd) as heard:
        for k, button in enumerate(one for one in attacker.found if one.kind == "GuiUploadButtonMessage"):
            for content in (b'title = "<img src=x onerror=alert(1)>"\n', packed.getvalue()):
                transfer = f"{k}-{len(content)}"
                attacker.send(**start_of(button, transfer, len(content), name=name))
                attacker.send(**part_of(button, transfer, 0, content))
        attacker.settle()
        carried_out(attacked)
        wait_for(lambda: idle(attacked), 60.0)
    assert heard.lines == []
    assert attacked.loop.is_alive()
    assert {path for path in attacked.data.parent.rglob("*") if attacked.data not in path.parents} == outside
    for path in attacked.data.rglob("*"):
        assert all(len(part) < 100 and part.strip(".") for part in path.relative_to(attacked.data).parts)
    # With a stroke before it, Markdown shows a mark as it is written.
    assert not re.search(r"(?<!\\)<img src=x", Person(attacked.server).html)


def test_a_flood_is_read_slowly(monkeypatch):
    """250 messages a second, however many come; the clock and the waiting are the test's."""
    clock = [0.0]

    async def sleep(seconds):
        clock[0] += seconds

    monkeypatch.setattr(incoming, "MESSAGES_AT_ONCE", 500)
    monkeypatch.setattr(incoming, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    monkeypatch.setattr(incoming, "asyncio", SimpleNamespace(sleep=sleep))
    pace, messages = incoming.RateLimit(), 10_000
    for _ in range(messages):
        with pytest.raises(StopIteration):
            pace.wait().send(None)
    expected = (messages - incoming.MESSAGES_AT_ONCE) / incoming.MESSAGES_PER_SECOND
    assert clock[0] == pytest.approx(expected, rel=0.01)


def test_the_page_is_drawn_however_many_actions_come():
    actions, done = Actions(), []

    def one_more():
        done.append(1)
        if len(done) < 1000:
            actions.post(one_more)

    actions.post(one_more)
    assert actions.carry_out() == ""
    assert len(done) == 1


def test_browsers_are_counted(attacked, attacker, monkeypatch):
    monkeypatch.setattr(guard, "MOST_SOCKETS", 1)
    with pytest.raises(InvalidStatus) as refused:
        Attacker(attacked.server, told=False)
    assert refused.value.response.status_code == 503
    assert refused.value.response.body == b"Too many browsers are at this page.\n"


def test_connections_are_counted_before_they_say_a_word(attacked, attacker, monkeypatch):
    monkeypatch.setattr(guard, "MOST_CONNECTIONS", 1)
    with pytest.raises((ConnectionError, http.client.HTTPException)):
        get(attacked.server, "/")


def test_who_takes_nothing_is_let_go(monkeypatch):
    """A browser that reads nothing: what is sent to it stays bounded, and after a while it is gone."""
    for name in ("ASK_AFTER", "GIVE_UP_AFTER", "CUT_AFTER"):
        monkeypatch.setattr(guard, name, 2.0)
    connections, handle = [], guard.Incoming.handle

    def seen(incoming, connection, handler):
        connections.append(connection)
        return handle(incoming, connection, handler)

    monkeypatch.setattr(guard.Incoming, "handle", seen)
    server = guarded_server("127.0.0.1", 0, "test")
    try:
        text = server.gui.add_html("")
        _deaf = Attacker(server, max_queue=1)
        wait_for(lambda: connections, 60.0)
        largest = 0
        for k in range(100):
            text.content = f"{k}" + "x" * 1_000_000
            largest = max(largest, connections[0].transport.get_write_buffer_size())
        wait_for(lambda: not server.get_clients(), 60.0)
        assert largest < 10_000_000
    finally:
        server.stop()


def test_what_is_no_request_is_not_told_as_a_fault(capfd):
    import socket

    server = guarded_server("127.0.0.1", 0, "test")
    try:
        with listening(server, capfd) as heard:
            for content in (
                b"",
                b"\x16\x03\x01\x02\0\x01",
                b"GET\r\n\r\n",
                b"GET / HTTP/1.1\r\nHost: x\r\nA: " + b"x" * 10**5,
            ):
                with socket.create_connection(("127.0.0.1", server.get_port()), timeout=30) as raw:
                    raw.sendall(content)
                    raw.shutdown(socket.SHUT_WR)
                    while raw.recv(4096):
                        pass
        assert heard.lines == []
    finally:
        server.stop()


COMMANDS = (
    "[" * 2400,
    '{"do": [1]}',
    '{"do": "seek", "time": NaN}',
    '{"do": "seek", "time": 1e999}',
    '{"do": "seek", "time": "0"}',
    '{"do": "speed", "factor": -Infinity}',
    '{"do": "speed", "factor": 1e400}',
    '{"do": "speed", "factor": {"a": 1}}',
    '{"do": "pour_link", "text": {"a": 1}}',
    '{"do": "pour_link", "text": "pour=../../etc/passwd"}',
    '{"do": "__class__"}',
    "x" * 1_000_000,
    "null",
    "7",
    "{",
)


def told_dark(channel):
    """Whether the page is dark, where the next message to its frame tells it."""
    said = json.loads(channel.recv(30.0))
    return [said["theme"]["dark"]] if "theme" in said else []


def test_no_command_of_the_frame_breaks_anything(attacked, attacker, capfd):
    address = f"127.0.0.1:{attacked.server.get_port()}"
    with listening(attacked.server, capfd) as heard:
        with connect(f"ws://{address}{PATH}", origin=f"http://{address}") as channel:
            (dark,) = told_dark(channel)
            for command in COMMANDS:
                channel.send(command)
            channel.send(b"\0\1\2")
            # The answer to a last one that is right: by then all before it are taken.
            channel.send(json.dumps({"do": "theme"}))
            wait_for(lambda: told_dark(channel) == [not dark], 30.0)
        carried_out(attacked)
        wait_for(lambda: idle(attacked), 60.0)
    assert heard.lines == []
    assert attacked.loop.is_alive()


@pytest.mark.parametrize(
    "path",
    [
        "/../../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/..%5c..%5cetc/passwd",
        "/%00",
        "//etc/passwd",
        "/shell/../x",
    ],
)
def test_no_address_leads_to_a_file_outside(attacked, path):
    assert get(attacked.server, path)[0] == 404


def get(server, path, **headers):
    """Status, headers and body of the answer to a request."""
    connection = http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=30)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    connection.close()
    return found


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "", "192.168.1.5", "my-machine"])
def test_a_page_for_others_does_not_start_without_a_token(host):
    with pytest.raises(PortError, match=r"anybody on the network.*EXPLORER_TOKEN"):
        guarded_server(host, 0, "test")
    with pytest.raises(PortError, match=r"--token: 5 characters; allowed: .* at least 16"):
        guarded_server(host, 0, "test", token="short")


@pytest.mark.parametrize("host", ["127.0.0.1", "127.3.2.1", "::1", "localhost"])
def test_a_page_for_this_machine_needs_none(host):
    check_token(host, None)


@pytest.fixture(scope="module")
def locked():
    """A page with a token, for all addresses of this machine."""
    server = guarded_server("0.0.0.0", 0, "test", WebPages("test"), ShellChannel(), token=TOKEN)
    yield server
    server.stop()


@pytest.mark.parametrize("path", ["/", "/index.html", "/shell/shell.js", "/assets/x", "/?token=", "/?token=wrong"])
def test_without_the_token_there_is_a_form_for_it(locked, path):
    status, headers, body = get(locked, path)
    assert (status, headers["Content-Type"]) == (401, "text/html; charset=utf-8")
    assert b"viser" not in body
    assert b"<form>" in body


def test_the_token_is_shown_once_and_is_gone_from_the_address(locked):
    status, headers, _ = get(locked, f"/?initialCameraFov=0.6&token={TOKEN}")
    assert (status, headers["Location"]) == (303, "/?initialCameraFov=0.6")
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Lax" in cookie
    assert TOKEN not in cookie
    assert get(locked, "/", Cookie=cookie.split(";")[0])[0] == 200
    assert get(locked, "/", Cookie=cookie.split(";")[0][:-1] + "0=")[0] == 401
    assert get(locked, f"//evil.example/?token={TOKEN}")[1]["Location"] == "/evil.example/"
    assert get(locked, f"/\\evil.example/?token={TOKEN}")[1]["Location"] == "/evil.example/"


@pytest.mark.parametrize("path", ["/", PATH, f"/?token={TOKEN}"])
def test_no_socket_is_opened_without_the_cookie(locked, path):
    address = f"127.0.0.1:{locked.get_port()}"
    asked = {"origin": f"http://{address}", "subprotocols": [f"viser-v{viser.__version__}"] if path != PATH else None}
    with pytest.raises(InvalidStatus) as refused:
        connect(f"ws://{address}{path}", **asked)
    assert refused.value.response.status_code == 401
    cookie = get(locked, f"/?token={TOKEN}")[1]["Set-Cookie"].split(";")[0]
    with connect(f"ws://{address}{path}", additional_headers={"Cookie": cookie}, **asked):
        pass


def png(width, height, mode="RGBA"):
    made = io.BytesIO()
    Image.new(mode, (width, height)).save(made, "PNG")
    return made.getvalue()


def claiming(width, height):
    """A PNG that says in its head to be larger than it is."""
    small = png(8, 8)
    return small[:16] + width.to_bytes(4, "big") + height.to_bytes(4, "big") + small[24:]


@pytest.mark.parametrize(
    "content",
    [
        claiming(60_000, 60_000),
        b"",
        b"GIF89a" + b"\0" * 100,
        claiming(0, 0),
        claiming(4294967295, 1),
    ],
)
def test_a_drawn_picture_that_is_none_is_left_out(content):
    assert not incoming.Picture(content, "id").small_enough
    assert incoming.Picture(png(800, 600), "id").small_enough


class Drawing:
    """A browser that answers a request for a picture with ``content``."""

    def __init__(self, content):
        self._content = content
        self.camera = SimpleNamespace(image_height=600, image_width=800)

    def get_render(self, height, width, transport_format, timeout):
        import imageio.v3 as iio

        return iio.imread(io.BytesIO(self._content), extension=".png")


@pytest.mark.parametrize("content", [claiming(7680, 4320), png(8, 8)[:50], png(8, 8, "L"), png(8, 8, "1"), b"\x89PNG"])
def test_a_damaged_drawn_picture_is_refused_in_a_line(content):
    with pytest.raises(CommandError, match=r"^picture: the browser did not draw it"):
        picture.rendered(Drawing(content), 1)


def test_a_scale_bar_has_a_length_however_near_the_camera_is():
    assert picture.length_words(5e-5) == "50 µm"


def test_files_do_not_pile_up_for_a_browser_that_takes_none(attacked):
    deaf = Attacker(attacked.server, max_queue=1)
    client = attacked.server.get_clients()[deaf.number]
    send_file(client, "first.bin", b"x" * 50_000_000)
    # On a busy machine viser takes the whole first file out of its queue at once; then a second one waits behind it.
    refused = [not sendable(client) for _ in range(2)]
    assert refused[-1]
    with pytest.raises(CommandError, match=r"^another.bin: this browser has not yet received the previous file"):
        send_file(client, "another.bin", b"x")
    deaf.controls()
    wait_for(lambda: sendable(client), 60.0)
    deaf.close()
    wait_for(lambda: not attacked.server.get_clients())


def sendable(client):
    try:
        send_file(client, "third.bin", b"x")
    except CommandError:
        return False
    return True
