"""The page over its socket, as much as a browser says and hears, for measurements without one."""

import asyncio
import os
import re
import subprocess
import sys
import time

import msgspec
import viser
import websockets
import zstandard

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 0.0, 0.0),
    "fov": 0.6,
    "near": 0.01,
    "far": 100.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


def messages_in(raw):
    """The messages of a window, as viser sends it: two lengths, then what is compressed."""
    size, packed = int.from_bytes(raw[:8], "little"), int.from_bytes(raw[8:16], "little")
    text = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed], size)
    return msgspec.msgpack.decode(text)["messages"]


class Socket:
    """A client of the page. Keeps the labels of the inputs, what sliders reach, and the texts that it was sent last."""

    def __init__(self, socket):
        self._socket, self.labels, self.reaches, self.texts = socket, {}, {}, {}

    async def send(self, message):
        await self._socket.send(msgspec.msgpack.encode(message))

    async def window(self):
        """The messages of the next window."""
        messages = messages_in(await self._socket.recv())
        for message in messages:
            props = message.get("props") or {}
            if isinstance(props, dict) and "label" in props:
                self.labels.setdefault(props["label"], message["uuid"])
                self.reaches[message["uuid"]] = (props.get("min"), props.get("max"))
            if isinstance(props, dict) and "content" in props:
                self.texts[message["uuid"]] = props["content"]
            if message["type"] == "GuiUpdateMessage" and "content" in message["updates"]:
                self.texts[message["uuid"]] = message["updates"]["content"]
        return messages


async def until(page, told, patience=120.0):
    """Take in windows until ``told`` holds for some text of the page."""
    end = time.perf_counter() + patience
    while not any(told(text) for text in page.texts.values()):
        assert time.perf_counter() < end, "waited in vain"
        await asyncio.wait_for(page.window(), patience)


def connected(port, through=None):
    """A socket to the page at ``port``, over the line at ``through`` where there is one."""
    return websockets.connect(
        f"ws://127.0.0.1:{port}",
        subprotocols=[f"viser-v{viser.__version__}"],
        origin=f"http://127.0.0.1:{port}",
        max_size=None,
        compression=None,
        host="127.0.0.1",
        port=through or port,
    )


def serve(*arguments, data=None):
    """A page with settings; ``data`` stands in for the folder of the user's data."""
    server = subprocess.Popen(
        [sys.executable, "-m", "explorer", "serve", "--port", "0", *arguments],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | ({} if data is None else {"XDG_DATA_HOME": str(data)}),
    )
    return server, int(re.search(r":(\d+) ", server.stdout.readline())[1])
