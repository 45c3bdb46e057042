"""Somebody at the page's socket who keeps to no rule: what a browser could send, and what none would.

It speaks viser's protocol by itself, message by message, and reads from the page what there is to attack.
"""

import asyncio
import gc
import logging
import threading
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any
from unittest import mock

import msgspec
import viser
from viser import _messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from explorer.diagnosis.process import DiagnoseProcess
from explorer.viewer import incoming, page
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.shell.channel import ShellChannel
from tests.browser.page_socket import CAMERA, messages_in
from tests.explorer.background.waiting import wait_for
from tests.explorer.viewer.page_session import page_of
from tests.explorer.viewer.test_page import SOURCE, Session

NAN, INFINITE = float("nan"), float("inf")
HOSTILE = (
    *(NAN, INFINITE, -INFINITE, 1e308, -1e308, 5e-324, -0.0, 2**63, -(2**63), 10**6, -1),
    *(None, True, "", "nan", "x" * 30_000, "a\0b", "‮", "<script>alert(1)</script>", "../../../etc/passwd"),
    *([], [NAN, 0.0], [1.0, INFINITE, 0.0], [1] * 1000, [[]], {}, {"value": 1}, b"\0"),
)
"""What a control is set to."""
ATTRIBUTES = ("update_cb", "removed", "is_button", "sync_cb", "props", "uuid", "min", "label", "__class__", "no_such")
"""What else of a control viser would set."""
BUTTONS = ("GuiButtonMessage", "GuiButtonGroupMessage", "GuiUploadButtonMessage")


@dataclass
class Control:
    """A control as the page tells a browser of it."""

    kind: str
    uuid: str
    props: dict[str, Any]


@dataclass
class Heard:
    """What went wrong in the server while somebody attacked: tracebacks that were printed or logged."""

    lines: list[str] = field(default_factory=list)


class Attacker:
    """A browser of its own making. ``told``: whether it has told its camera, as a browser does at once."""

    def __init__(self, server, told=True, **options):
        self._server, port = server, server.get_port()
        self.socket = connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[f"viser-v{viser.__version__}"],
            origin=f"http://127.0.0.1:{port}",
            max_size=None,
            compression=None,
            **options,
        )
        self._marks = 0
        if told:
            before = set(server.get_clients())
            self.send(**CAMERA)
            wait_for(lambda: set(server.get_clients()) - before)
            (self.number,) = set(server.get_clients()) - before

    def send(self, **message):
        """A message of viser's protocol, or of none."""
        self.socket.send(msgspec.msgpack.encode(message))

    def send_raw(self, content):
        """Bytes, or a text."""
        self.socket.send(content)

    def controls(self):
        """All controls of the page; what it is told after that is read and thrown away, as a closed eye does."""
        found = self._read_controls()
        threading.Thread(target=self._read_on, daemon=True).start()
        return found

    def _read_on(self):
        with suppress(ConnectionClosed):
            for _ in self.socket:
                pass

    def _read_controls(self):
        found = []
        while True:
            for message in messages_in(self.socket.recv(60.0)):
                if message["type"] == "ReplayDoneMessage":
                    return found
                if "props" in message and message["type"].startswith("Gui"):
                    found.append(Control(message["type"], message["uuid"], message["props"]))

    def settle(self):
        """Wait until the server has dealt with all that was sent, callbacks included."""
        self._marks += 1
        mark = 0.5 + 1e-4 * self._marks
        self.send(**CAMERA | {"fov": mark})
        wait_for(lambda: self._server.get_clients()[self.number].camera.fov == mark, 60.0)
        executor = self._server._thread_executor
        # Once all threads are here together, none of them is busy with what came before.
        barrier = threading.Barrier(executor._max_workers + 1)
        for _ in range(executor._max_workers):
            executor.submit(barrier.wait)
        barrier.wait(60.0)

    def close(self):
        """Go as a closed tab does."""
        self.socket.close()


def hostile_messages(controls, every=1):
    """What is sent: controls with values that they cannot have; every message of the protocol, out of form.

    ``every``: each control gets one in so many of the values, other ones than its neighbours.
    """
    for number, control in enumerate(controls):
        for value in HOSTILE[number % every :: every]:
            if not (control.kind in BUTTONS and value is True):  # a person may press them
                yield {"type": "GuiUpdateMessage", "uuid": control.uuid, "updates": {"value": value}}
    some = next(control for control in controls if control.kind == "GuiSliderMessage")
    for name in ATTRIBUTES:
        yield {"type": "GuiUpdateMessage", "uuid": some.uuid, "updates": {name: []}}
    for uuid in ("none", "", "x" * 10**6, 7, None, "../..", "root"):
        yield {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": 1.0}}
        yield {"type": "CommandTriggerMessage", "uuid": uuid}
    yield {"type": "GuiUpdateMessage", "uuid": some.uuid, "updates": [1, 2]}
    for kind in sorted(_messages.Message._subclass_from_type_string()):
        yield {"type": kind}
        yield {"type": kind, "uuid": "u", "name": "/n", "updates": {"x": 1}, "owner": ""}
    for place in (NAN, INFINITE, 1e300, "x", None, []):
        yield CAMERA | {"position": (place, 0.0, 0.0)}
        yield CAMERA | {"fov": place, "image_width": place}
        yield pointer(ray_direction=(place, 0.0, 0.0))
    yield CAMERA | {"position": (0.0, 0.0, 0.0)}
    yield CAMERA | {"image_height": -1, "image_width": 2**62}
    yield pointer(ray_direction=(0.0, 0.0, 0.0))
    yield pointer(ray_direction=None)
    yield pointer(event_type="rect-select")
    yield pointer(event_type="x" * 1000)
    yield {"type": 7}
    yield {}


def pointer(**changes):
    """A click into the scene."""
    return {
        "type": "ScenePointerMessage",
        "event_type": "click",
        "ray_origin": (0.0, 0.0, 1.0),
        "ray_direction": (0.0, 0.0, -1.0),
        "screen_pos": ((0.5, 0.5),),
        "modifier": None,
    } | changes


NO_MESSAGES = (
    b"",
    b"\xc1",
    b"\x91" * 50_000,
    b"\xdf\xff\xff\xff\xff",
    b"\x81\xa4type\xb3ViewerCameraMessage",
    b"\x81\xa4type\xa2\xff\xfe",
    msgspec.msgpack.encode([1, 2]),
    msgspec.msgpack.encode("text"),
    "text",
    '{"type": "GuiUpdateMessage"}',
    # A type that is told twice: who reads the first one lets through what the reader of the last one takes.
    b"\x82\xa4type\xb5CommandTriggerMessage\xa4type\xafShareUrlRequest",
)
"""What is no message at all."""


@contextmanager
def attacked_page(data):
    """A page whose loop runs, without a solver, and its session. What it keeps is in the folder ``data``."""
    channel, session, stop = ShellChannel(), Session(SOURCE), threading.Event()
    at_once, kept = mock.patch.object(incoming, "MESSAGES_AT_ONCE", 10**9), {"return_value": data}
    with at_once, mock.patch.object(page, "data_folder", **kept):
        server = guarded_server("127.0.0.1", 0, "test", channel=channel)
        shown = page_of(server, session, DiagnoseProcess(data / "diagnoses", None), data, channel)
        loop = threading.Thread(target=shown.run, args=(stop,), daemon=True)
        loop.start()
        yield SimpleNamespace(server=server, page=shown, session=session, loop=loop, data=data)
        stop.set()
        loop.join()
        server.stop()


def wrong_values(server):
    """Controls that have a value which no person could give them."""
    for handle in list(server.gui._gui_input_handle_from_uuid.values()):
        if isinstance(handle, viser.GuiUploadButtonHandle) or not hasattr(handle, "disabled"):
            continue
        value, told = list(handle.value) if isinstance(handle.value, tuple) else handle.value, handle._impl
        if incoming.valid_value(handle, value) is None or told.removed or not isinstance(told.update_cb, list):
            yield handle.label, handle.value


def random_messages(controls, draw, number):
    """``number`` messages, right ones with one to three changes; some are changed as bytes."""
    for _ in range(number):
        control = draw.choice(controls)
        message = draw.choice(
            (
                {"type": "GuiUpdateMessage", "uuid": control.uuid, "updates": {"value": draw.choice((0, 0.5, "x"))}},
                {"type": "GuiUpdateMessage", "uuid": control.uuid, "updates": {"value": draw.choice(HOSTILE)}},
                dict(CAMERA),
                pointer(),
                {"type": "CommandTriggerMessage", "uuid": control.uuid},
                start_of(control, f"{draw.random()}"[2:], draw.choice((0, 5, 10**6, 10**12))),
                part_of(control, "x", draw.choice((0, 1, 2**40)), b"12345"),
            )
        )
        if control.kind in BUTTONS and message["type"] == "GuiUpdateMessage":
            continue  # a person may press them, and then what they are for begins
        for _ in range(draw.randint(1, 3)):
            key = draw.choice(sorted(message))
            message[draw.choice((key, key, "more"))] = draw.choice((*HOSTILE, *message.values()))
        raw = msgspec.msgpack.encode(message)
        if draw.random() < 0.3:
            place = draw.randrange(len(raw))
            raw = draw.choice((raw[:place], raw[:place] + draw.randbytes(2) + raw[place + 1 :], raw + raw))
        yield raw


def start_of(button, transfer, size, parts=None, name="x.toml"):
    """The announcement of a file."""
    return {
        "type": "FileTransferStartUpload",
        "source_component_uuid": button.uuid,
        "transfer_uuid": transfer,
        "filename": name,
        "mime_type": "",
        "part_count": -(-size // 524_288) if parts is None else parts,
        "size_bytes": size,
    }


def part_of(button, transfer, index, content):
    """A part of a file."""
    return {
        "type": "FileTransferPart",
        "source_component_uuid": button.uuid,
        "transfer_uuid": transfer,
        "part_index": index,
        "content": content,
    }


def message_fault(attacked, draw):
    """What is wrong with how the page takes fifty messages of one browser; None for nothing."""
    attacker = Attacker(attacked.server)
    controls = attacker.controls()
    with listening(attacked.server) as heard:
        for raw in random_messages(controls, draw, 50):
            attacker.send_raw(raw)
        attacker.settle()
    attacker.close()
    wrong = [*heard.lines, *map(str, wrong_values(attacked.server))]
    if not attacked.loop.is_alive():
        wrong.append("the page's loop has ended")
    return "; ".join(wrong) or None


@contextmanager
def listening(server, capture=None):
    """What goes wrong in the server meanwhile; ``capture``: pytest's ``capfd``, where what is printed counts too."""
    heard, loop = Heard(), server._event_loop

    class Handler(logging.Handler):
        def emit(self, record):
            heard.lines.append(record.getMessage())

    def of_a_task(loop, context):
        heard.lines.append(f"{context['message']}: {context.get('exception')!r}")

    handler = Handler(level=logging.WARNING)
    logging.getLogger().addHandler(handler)
    loop.set_exception_handler(of_a_task)
    if capture is not None:
        capture.readouterr()
    try:
        yield heard
    finally:
        logging.getLogger().removeHandler(handler)

        async def collect():
            gc.collect()  # a task that failed is told when it is collected

        asyncio.run_coroutine_threadsafe(collect(), loop).result(30)
        loop.set_exception_handler(None)
        printed = capture.readouterr() if capture is not None else ()
        heard.lines += [text for text in printed if "Traceback" in text]
