"""What a browser may send to viser: well-formed messages, values that a control can have, files of bounded size.

viser 1.1.1 accepts any message of its protocol from anybody: it sets any attribute of a control that a message names,
casts any value, keeps a file of any size while it arrives, and forwards some messages to all other browsers and keeps
those for ever. So each message is read here before viser reads it, and written again; what a user of the page could not
have sent is dropped. A browser that sends faster than hands can move is read more slowly.
"""

from __future__ import annotations

import asyncio
import math
import re
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

import msgspec
import viser
from msgspec import Meta, Struct
from viser import _messages

MOST_SOCKETS = 32
"""Simultaneous sockets of pages; a page has two."""
MESSAGES_PER_SECOND, MESSAGES_AT_ONCE = 250, 500
"""Limits per browser: a dragged camera and a dragged slider send 60 messages a second each."""
MOST_MESSAGE_BYTES = 16_000_000
"""A rendered picture is the largest message; a file arrives in parts of half a megabyte."""
MOST_QUEUED = 2
"""Messages of a browser that are received but not yet read."""
MOST_UPLOAD_BYTES = 50_000_000
"""Limit for one file, and for all files that one browser is sending; the largest that a control takes is an archive."""
MOST_UPLOADING_BYTES = 200_000_000
"""Limit for all files that all browsers are sending."""
SMALLEST_PART = 1024
"""Smallest mean size of the parts of a file [bytes]: a file has no more parts than parts of this size would make."""
LONGEST_TEXT = 20_000
"""Characters in a text box."""
MOST_PIXELS = 4320 * 7680
"""Limit for a picture that a browser renders."""
PNG_HEAD = re.compile(rb"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR(.{4})(.{4})", re.DOTALL)
ROUNDING = 1e-9
"""Share of a slider's range by which rounding in a browser may exceed it."""

MOST_WHOLE = 2**53
"""Largest whole number that a browser can tell from its neighbours."""
COLOURS = (viser.GuiRgbHandle, viser.GuiRgbaHandle)
BOUNDED = (viser.GuiNumberHandle, viser.GuiSliderHandle, viser.GuiVector2Handle, viser.GuiVector3Handle)

Length: TypeAlias = Annotated[float, Meta(ge=-1e6, le=1e6)]
Pixels: TypeAlias = Annotated[int, Meta(ge=0, le=16384)]
Id: TypeAlias = Annotated[str, Meta(max_length=64, pattern="^[A-Za-z0-9_-]+$")]
Point: TypeAlias = tuple[Length, Length, Length]
Value: TypeAlias = (
    bool
    | Annotated[int, Meta(ge=-MOST_WHOLE, le=MOST_WHOLE)]
    | float
    | Annotated[str, Meta(max_length=LONGEST_TEXT)]
    | Annotated[list[float], Meta(max_length=4)]
)


class Camera(Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag="ViewerCameraMessage"):
    """The viewpoint of a browser; viser counts a browser as present from its first such message."""

    wxyz: tuple[Length, Length, Length, Length]
    position: Point
    fov: Annotated[float, Meta(gt=1e-3, lt=3.14)]
    near: Annotated[float, Meta(gt=0.0, le=1e6)]
    far: Annotated[float, Meta(gt=0.0, le=1e9)]
    image_height: Pixels
    image_width: Pixels
    look_at: Point
    up_direction: Point

    @property
    def looks_somewhere(self) -> bool:
        """Whether it has a direction of view and an upward direction."""
        away = sum((a - b) ** 2 for a, b in zip(self.position, self.look_at, strict=True))
        return away > 1e-12 and sum(x * x for x in self.up_direction) > 1e-12 and sum(x * x for x in self.wxyz) > 1e-12


class Click(Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag="ScenePointerMessage"):
    """A click into the scene: a ray."""

    event_type: Annotated[str, Meta(pattern="^click$")]
    ray_origin: Point
    ray_direction: Point
    screen_pos: tuple[tuple[Length, Length]]
    modifier: Annotated[str, Meta(max_length=32)] | None


class Updates(Struct, frozen=True, forbid_unknown_fields=True):
    """What a control is set to. Its other attributes are the program's own."""

    value: Value


class Update(Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag="GuiUpdateMessage"):
    """A control was moved, or a button pressed."""

    uuid: Id
    updates: Updates


class Key(Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag="CommandTriggerMessage"):
    """A command's key was pressed."""

    uuid: Id


class UploadStart(Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag="FileTransferStartUpload"):
    """A file is about to arrive. Its name is a label, not a path: :mod:`explorer.files.uploads`."""

    source_component_uuid: Id
    transfer_uuid: Id
    filename: Annotated[str, Meta(max_length=255, pattern=r"^[^\x00-\x1f\x7f]*$")]
    mime_type: Annotated[str, Meta(max_length=255)]
    part_count: Annotated[int, Meta(ge=0)]
    size_bytes: Annotated[int, Meta(ge=0)]


class UploadPart(Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag="FileTransferPart"):
    """A part of a file."""

    source_component_uuid: Id
    transfer_uuid: Id
    part_index: Annotated[int, Meta(ge=0)]
    content: Annotated[bytes, Meta(min_length=1)]


class Picture(Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag="GetRenderResponseMessage"):
    """The scene as a browser has rendered it, PNG."""

    payload: bytes
    render_uuid: Id

    @property
    def small_enough(self) -> bool:
        """Whether it says to be a PNG of a size that was asked for."""
        head = PNG_HEAD.match(self.payload)
        return head is not None and 0 < int.from_bytes(head[1], "big") * int.from_bytes(head[2], "big") <= MOST_PIXELS


ClientMessage: TypeAlias = Camera | Click | Update | Key | UploadStart | UploadPart | Picture
READER: msgspec.msgpack.Decoder[ClientMessage] = msgspec.msgpack.Decoder(ClientMessage)


class Refusal(Exception):
    """A refused message that the user may have intended; one line for that browser."""


@dataclass
class Upload:
    """A file that is arriving."""

    source: str
    size: int
    """[bytes]"""
    bytes_left: int
    parts_left: set[int]


class RateLimit:
    """Makes senders faster than ``MESSAGES_PER_SECOND`` wait: TCP holds back what is not read."""

    def __init__(self) -> None:
        self._allowed, self._since = float(MESSAGES_AT_ONCE), time.monotonic()

    async def wait(self) -> None:
        """Wait before a message is taken."""
        now = time.monotonic()
        more = (now - self._since) * MESSAGES_PER_SECOND
        self._allowed, self._since = min(self._allowed + more, float(MESSAGES_AT_ONCE)) - 1.0, now
        if self._allowed < 0.0:
            await asyncio.sleep(-self._allowed / MESSAGES_PER_SECOND)


class Incoming:
    """All browsers of a page, and what is read from each. ``server`` is set once it exists."""

    def __init__(self) -> None:
        self.server: viser.ViserServer | None = None
        self._connections: list[FilteredConnection] = []

    @property
    def uploading(self) -> int:
        """Bytes of incomplete files of all browsers."""
        return sum(one.uploading for one in self._connections)

    async def handle(self, connection: Any, handler: Callable[[Any], Awaitable[None]]) -> None:
        """Let viser's ``handler`` talk to the browser behind ``connection`` until it disconnects."""
        one = FilteredConnection(connection, self)
        self._connections.append(one)
        try:
            await handler(one)
        finally:
            self._connections.remove(one)

    def control(self, uuid: str) -> Any:
        """The control with this id that the user could operate now; None if there is none."""
        found = None if self.server is None else self.server.gui._gui_input_handle_from_uuid.get(uuid)
        # What cannot be disabled, such as a progress bar, is not a control for the user.
        return None if found is None or found._impl.removed or getattr(found, "disabled", True) else found

    def serve(self, server: viser.ViserServer) -> None:
        """Begin with ``server``: progress of an upload is sent only to its own browser, and not kept for others."""
        self.server, to_all = server, server._websock_server.queue_message

        def queue(message: Any) -> None:
            if not isinstance(message, _messages.FileTransferPartAck):
                to_all(message)
                return
            sender = next((one for one in self._connections if message.transfer_uuid in one.sent), None)
            client = None if sender is None else sender.client
            if client is not None:
                client._websock_connection.queue_message(message)

        server._websock_server.queue_message = queue  # type: ignore[method-assign]


class FilteredConnection:
    """A connection from which viser reads only what a user of the page could have sent."""

    def __init__(self, connection: Any, incoming: Incoming) -> None:
        self._connection, self._incoming, self._pace = connection, incoming, RateLimit()
        self._present = False
        self._uploads: dict[str, Upload] = {}
        self.sent: list[str] = []
        """Ids of the last files that this browser sent."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)

    @property
    def uploading(self) -> int:
        """Bytes of its incomplete files."""
        return sum(upload.size for upload in self._uploads.values())

    @property
    def client(self) -> viser.ClientHandle | None:
        """viser's handle of this browser, once it has sent its camera."""
        server = self._incoming.server
        if server is None:
            return None
        connections = server._websock_server._live_connections
        number = next((number for number, one in connections.items() if one is self), None)  # type: ignore[comparison-overlap]
        return None if number is None else server.get_clients().get(number)

    async def recv(self) -> bytes:
        """The next message for viser, in the form that viser reads."""
        while True:
            raw = await self._connection.recv()
            await self._pace.wait()
            try:
                said = self._accepted(READER.decode(raw)) if isinstance(raw, bytes) else None
            except Refusal as refusal:
                if (client := self.client) is not None:
                    client.add_notification("Not taken", str(refusal), auto_close_seconds=10.0)
            except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
                pass  # not something that viser's page sends
            else:
                if said is not None:
                    return msgspec.msgpack.encode(said)

    def _accepted(self, said: ClientMessage) -> ClientMessage | None:
        """``said`` as viser may read it; None if it is dropped. Raises Refusal."""
        if isinstance(said, Camera):
            self._present |= said.looks_somewhere
            return said if said.looks_somewhere else None
        if not self._present:  # viser would keep what such a browser leaves behind
            return None
        match said:
            case Update(uuid=uuid, updates=updates):
                control = self._incoming.control(uuid)
                fitting = None if control is None else valid_value(control, updates.value)
                return None if fitting is None else Update(uuid, Updates(fitting))
            case UploadStart():
                return self._announced(said)
            case UploadPart():
                return self._taken_in(said)
            case Click():
                return said if any(said.ray_direction) else None
            case Picture():
                return said if said.small_enough else None
        return said

    def _announced(self, start: UploadStart) -> UploadStart | None:
        """Make room for a file. Raises Refusal if there is none."""
        control = self._incoming.control(start.source_component_uuid)
        if not isinstance(control, viser.GuiUploadButtonHandle) or start.transfer_uuid in (*self._uploads, *self.sent):
            return None
        name, size, parts = start.filename[:80], start.size_bytes, start.part_count
        if size > MOST_UPLOAD_BYTES:
            raise Refusal(f"{name}: {size} bytes; allowed: up to {MOST_UPLOAD_BYTES}")
        if self.uploading + size > MOST_UPLOAD_BYTES or self._incoming.uploading + size > MOST_UPLOADING_BYTES:
            raise Refusal(f"{name}: other files are being received; send it again afterwards")
        if not min(1, size) <= parts <= -(-size // SMALLEST_PART):
            return None
        self.sent = [*self.sent[-7:], start.transfer_uuid]
        if parts:
            self._uploads[start.transfer_uuid] = Upload(start.source_component_uuid, size, size, set(range(parts)))
        return start

    def _taken_in(self, part: UploadPart) -> UploadPart | None:
        """``part`` if it is still wanted and no larger than the rest of its file; else None."""
        upload = self._uploads.get(part.transfer_uuid)
        if upload is None or part.source_component_uuid != upload.source or part.part_index not in upload.parts_left:
            return None
        if len(part.content) > upload.bytes_left:
            return None
        upload.bytes_left -= len(part.content)
        upload.parts_left.remove(part.part_index)
        if not upload.parts_left:
            del self._uploads[part.transfer_uuid]
        return part


def valid_value(control: Any, value: Any) -> Any:
    """``value`` if ``control`` may have it (its type, within its bounds, one of its options); else None."""
    match control:
        case viser.GuiUploadButtonHandle():
            return None
        case viser.GuiButtonHandle() | viser.GuiCheckboxHandle():
            return value if isinstance(value, bool) else None
        case viser.GuiDropdownHandle() | viser.GuiButtonGroupHandle():
            return value if isinstance(value, str) and value in control.options else None
        case viser.GuiTextHandle():
            return value if isinstance(value, str) and "\0" not in value else None
    if not isinstance(control, (*COLOURS, *BOUNDED)):
        return None
    bounds: tuple[Any, Any] = (0, 255) if isinstance(control, COLOURS) else (control.min, control.max)
    low, high = bounds
    present = control.value
    if not isinstance(present, tuple):
        return _number(value, type(present), low, high)
    if not isinstance(value, list) or len(value) != len(present):
        return None
    lows, highs = (bound if isinstance(bound, tuple) else (bound,) * len(present) for bound in (low, high))
    found = [_number(*one) for one in zip(value, map(type, present), lows, highs, strict=True)]
    return None if None in found else found


def _number(value: Any, kind: type, low: float | None, high: float | None) -> float | int | None:
    """``value`` as a finite number of ``kind`` from ``low`` to ``high``; None if it is not one."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    if kind is int and (value != round(value) or abs(value) > MOST_WHOLE):
        return None
    slack = ROUNDING * (high - low) if low is not None and high is not None else 0.0
    if (low is not None and value < low - slack) or (high is not None and value > high + slack):
        return None
    within = value if low is None else max(low, value)
    return kind(within if high is None else min(high, within))
