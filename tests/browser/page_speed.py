"""How fast the page is, measured over its socket, without a browser: `make page-speed`.

    frames/s         windows that move bodies, sent while the coarse pour runs
    real time        simulated seconds per second over the whole pour, from its first second on the page to its rest
    echo             from a slider's new value to the line "In the solver", median and 95th percentile [ms]

each alone, and while a study of the quick profile runs at low priority on the same machine; and the frames/s of 20 000
spheres that fall into a box.
"""

import asyncio
import math
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import msgspec
import viser
import websockets
import zstandard

from explorer.priority import BACKGROUND, session_gives_way

POUR = ("body.spheres=coarse", "rig.mass=30g")
MANY, RADIUS, DENSITY = 20_000, 1.5e-3, 1000.0
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
SPHERES = f"""
format = 1
title = "{MANY} spheres in a box"
[materials.glass]
density = {DENSITY}
shear_modulus = 1.0e7
poisson_ratio = 0.25
[materials.rigid_sieve_plate]
youngs_modulus = 2.0e11
poisson_ratio = 0.30
[[body]]
name = "bead"
material = "glass"
sphere_centres = [[0.0, 0.0, 0.0]]
sphere_radii = [{RADIUS}]
mass = {MASS}
inertia = {[0.4 * MASS * RADIUS**2] * 3}
[pair.glass.glass]
static_friction = 0.5
restitution = 0.5
[pair.glass.rigid_sieve_plate]
static_friction = 0.5
restitution = 0.5
[rig]
name = "draw_down_box"
mass = {MANY * MASS}
[insertion]
rate = 10.0
region_height = 0.18
"""
ECHOES = 40
QUIET = 3.0
"""Seconds without a window, or at rest, after which a pour is over."""
POUR_SECONDS = 8.0
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


class Socket:
    """A client of the page. Keeps the labels of the inputs and the texts that it was sent last."""

    def __init__(self, socket):
        self._socket, self.labels, self.texts = socket, {}, {}

    async def send(self, message):
        await self._socket.send(msgspec.msgpack.encode(message))

    async def window(self):
        """The messages of the next window."""
        raw = await self._socket.recv()
        size, packed = int.from_bytes(raw[:8], "little"), int.from_bytes(raw[8:16], "little")
        text = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed], size)
        messages = msgspec.msgpack.decode(text)["messages"]
        for message in messages:
            props = message.get("props") or {}
            if isinstance(props, dict) and "label" in props:
                self.labels.setdefault(props["label"], message["uuid"])
            if isinstance(props, dict) and "content" in props:
                self.texts[message["uuid"]] = props["content"]
            if message["type"] == "GuiUpdateMessage" and "content" in message["updates"]:
                self.texts[message["uuid"]] = message["updates"]["content"]
        return messages


def moves_bodies(messages):
    return any(m["type"] == "SceneNodeUpdateMessage" and "batched_positions" in m["updates"] for m in messages)


async def until(page, told, patience=120.0):
    """Take in windows until ``told`` holds for some text of the page."""
    end = time.perf_counter() + patience
    while not any(told(text) for text in page.texts.values()):
        assert time.perf_counter() < end, "waited in vain"
        await asyncio.wait_for(page.window(), patience)


async def echo_ms(page, slider, value):
    """Milliseconds until the solver's own line tells ``value``."""
    began = time.perf_counter()
    await page.send({"type": "GuiUpdateMessage", "uuid": slider, "updates": {"value": value}})
    await until(page, lambda text: f"Static friction</span> {value:g} " in text, 20.0)
    return 1e3 * (time.perf_counter() - began)


def connected(port):
    return websockets.connect(
        f"ws://127.0.0.1:{port}",
        subprotocols=[f"viser-v{viser.__version__}"],
        origin=f"http://127.0.0.1:{port}",
        max_size=None,
        compression=None,
    )


async def frames_per_second(page, seconds):
    """Windows that move bodies."""
    frames, began = 0, time.perf_counter()
    while time.perf_counter() < began + seconds:
        frames += moves_bodies(await page.window())
    return frames / (time.perf_counter() - began)


async def measure_many(port):
    """Frames/s and the real-time factor while all of the spheres move."""
    async with connected(port) as socket:
        page = Socket(socket)
        await page.send(CAMERA)
        await until(page, lambda text: f"{MANY} of {MANY}" in text, 600.0)
        frames = await frames_per_second(page, POUR_SECONDS)
        return frames, statistics.median(real_time(page))


def simulated(page):
    """Simulated time that the readout shows [s]."""
    found = [re.search(r"Simulated time</span><span>([0-9.]+)", text) for text in page.texts.values()]
    return max((float(one[1]) for one in found if one), default=0.0)


async def whole_pour(page):
    """Frames/s and simulated over wall time until nothing moves any more."""
    began, start, frames, last = time.perf_counter(), simulated(page), 0, 0.0
    while True:
        try:
            frames += moves_bodies(await asyncio.wait_for(page.window(), QUIET))
        except TimeoutError:
            break
        if not any("at rest" in text for text in page.texts.values()):
            last = time.perf_counter()
        elif time.perf_counter() > last + QUIET:
            break
    return frames / (last - began), (simulated(page) - start) / (last - began)


def real_time(page):
    """What the readout tells now."""
    return [
        float(found[1])
        for text in page.texts.values()
        if (found := re.search(r"Real-time factor</span><span>([0-9.]+)", text))
    ]


async def measure(port):
    async with connected(port) as socket:
        page = Socket(socket)
        await page.send(CAMERA)
        await until(page, lambda text: re.search(r"Real-time factor</span><span>[0-9.]", text))
        frames, factor = await whole_pour(page)
        slider = page.labels["Static friction"]
        echoes = [await echo_ms(page, slider, round(0.3 + 0.01 * k, 2)) for k in range(ECHOES)]
        return frames, factor, echoes


def tell(name, frames, factor, echoes):
    ordered = sorted(echoes)
    print(
        f"{name:18} {frames:5.1f} frames/s   real time {factor:4.2f}   echo {statistics.median(echoes):5.0f} ms, "
        f"95 % {ordered[int(0.95 * len(ordered))]:5.0f} ms ({len(echoes)} changes)"
    )


def serve(*arguments):
    server = subprocess.Popen(
        [sys.executable, "-m", "explorer", "serve", "--port", "0", *arguments], stdout=subprocess.PIPE, text=True
    )
    return server, int(re.search(r":(\d+) ", server.stdout.readline())[1])


def main():
    for name, study in (("alone", False), ("beside a study", True)):
        with tempfile.TemporaryDirectory() as folder:
            command = ["nice", "-n", str(BACKGROUND), sys.executable, "-m", "explorer", "calibrate", "--headless"]
            command += ["--profile", "quick", "--out", f"{folder}/out", "--store", f"{folder}/runs.sqlite"]
            # As the page starts one.
            running = subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True) if study else None
            if running is not None:
                session_gives_way(running.pid, BACKGROUND)
            if running:
                while not list(Path(folder).glob("out/progress.jsonl")):
                    time.sleep(0.5)
                time.sleep(15.0)  # its workers have compiled
            server, port = serve(*(part for one in POUR for part in ("--set", one)))
            try:
                tell(name, *asyncio.run(measure(port)))
            finally:
                server.terminate()
                server.wait(20)
                if running:
                    running.terminate()
                    running.wait(30)
    with tempfile.TemporaryDirectory() as folder:
        material = Path(folder, "spheres.toml")
        material.write_text(SPHERES, encoding="utf-8")
        server, port = serve("--material", str(material))
        try:
            frames, factor = asyncio.run(measure_many(port))
            print(f"{MANY:<18} {frames:5.1f} frames/s   real time {factor:4.2f}")
        finally:
            server.terminate()
            server.wait(20)


if __name__ == "__main__":
    main()
