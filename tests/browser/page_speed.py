"""How fast the page is, measured over its socket, without a browser: `make page-speed`.

    frames/s         windows that move bodies, sent while the coarse pour runs
    real time        simulated seconds per second over the whole pour, from its first second on the page to its rest
    echo             from a slider's new value to the line "In the solver", median and 95th percentile [ms]
    frame            from it to the first window after that line that moves bodies: drawn with the new value

with one browser and with two (the slower of both counts), alone, while a study of the quick profile runs at low
priority on the same machine, and over a line of 20 Mbit/s and 50 ms there and back; the time from a slider of the
profiler to its new chart, while the pour runs; and the frames/s of 20 000 spheres that fall into a box.
"""

import asyncio
import json
import math
import re
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import AsyncExitStack, contextmanager
from pathlib import Path

import websockets

from explorer.priority import BACKGROUND, session_gives_way
from explorer.viewer.shell.channel import PATH
from tests.browser.page_socket import CAMERA, Socket, connected, serve, until
from tests.browser.slow_line import slow_line
from tests.explorer import reported_studies

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
ECHOES, AT_A_POUR = 40, 5
"""Changes of a slider, and how many of them while one pour runs."""
SLOW = 20e6 / 8, 0.05
"""Rate [bytes/s] and round trip [s] of the slow line."""
PROFILED = "X7:"
"""Factor whose slider is moved, from end to end of the region."""
QUIET = 3.0
"""Seconds without a window, or at rest, after which a pour is over."""
POUR_SECONDS = 8.0
LONGEST_POUR = 40.0
"""Wall time [s] after which a pour that a busy machine draws out is measured."""


def moves_bodies(messages):
    return any(m["type"] == "SceneNodeUpdateMessage" and "batched_positions" in m["updates"] for m in messages)


async def echo_ms(pages, slider, value):
    """Milliseconds until the solver's own line tells ``value``, and until a frame after it; of the last of ``pages``.

    The first of them moves the slider.
    """
    began = time.perf_counter()

    async def seen(page):
        await until(page, lambda text: f"Static friction</span> {value:g} " in text, 20.0)
        told = time.perf_counter()
        while not moves_bodies(await asyncio.wait_for(page.window(), 20.0)):
            pass
        return told, time.perf_counter()

    await pages[0].send({"type": "GuiUpdateMessage", "uuid": slider, "updates": {"value": value}})
    told, drawn = zip(*await asyncio.gather(*map(seen, pages)), strict=True)
    return 1e3 * (max(told) - began), 1e3 * (max(drawn) - began)


def redraws(messages):
    return any("_plotly_json_str" in (m.get("updates") or m.get("props") or {}) for m in messages)


async def profile_ms(page, slider, value):
    """Milliseconds until the chart comes that follows a slider of the profiler."""
    began = time.perf_counter()
    await page.send({"type": "GuiUpdateMessage", "uuid": slider, "updates": {"value": value}})
    while not redraws(await asyncio.wait_for(page.window(), QUIET)):
        assert time.perf_counter() < began + 20.0, "waited in vain"
    return 1e3 * (time.perf_counter() - began)


async def measure_profiler(port):
    """Of the finished study's friction, over its region; the first one chooses the chart."""
    async with connected(port) as socket:
        page = Socket(socket)
        await page.send(CAMERA)
        await until(page, lambda text: re.search(r"Real-time factor</span><span>[0-9.]", text))
        slider = next(uuid for label, uuid in page.labels.items() if label and label.startswith(PROFILED))
        low, high = page.reaches[slider]
        values = [low + (high - low) * (k + 1) / (ECHOES + 2) for k in range(ECHOES + 1)]
        return [await profile_ms(page, slider, value) for value in values][1:]


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
    """Frames/s and simulated over wall time until nothing moves any more, or ``LONGEST_POUR`` is over."""
    began, start, frames, last = time.perf_counter(), simulated(page), 0, 0.0
    while (now := time.perf_counter()) < began + LONGEST_POUR:
        try:
            frames += moves_bodies(await asyncio.wait_for(page.window(), QUIET))
        except TimeoutError:
            break
        if not any("at rest" in text for text in page.texts.values()):
            last = time.perf_counter()
        elif now > last + QUIET:
            break
    return frames / (last - began), (simulated(page) - start) / (last - began)


def real_time(page):
    """What the readout tells now."""
    return [
        float(found[1])
        for text in page.texts.values()
        if (found := re.search(r"Real-time factor</span><span>([0-9.]+)", text))
    ]


async def pour_again(port, pages):
    """As the button of the timeline does; until each of ``pages`` tells of the new pour."""
    address = f"127.0.0.1:{port}"
    async with websockets.connect(f"ws://{address}{PATH}", origin=f"http://{address}") as channel:
        await channel.send(json.dumps({"do": "restart"}))
    running = (until(one, lambda text: re.search(r"Simulated time</span><span>0\.[0-2]", text)) for one in pages)
    await asyncio.gather(*running)


async def friction_of_one_pair(page):
    """The slider of a pair that has been chosen; that of all pairs scales their values."""
    await page.send({"type": "GuiUpdateMessage", "uuid": page.labels["Pair"], "updates": {"value": "seed – seed"}})
    while "Static friction" not in page.labels:
        await asyncio.wait_for(page.window(), 20.0)
    return page.labels["Static friction"]


async def measure(port, browsers, slow):
    """Least frames/s and real-time factor of ``browsers`` over a new pour, echoes, first frames; ``slow`` lines."""
    async with AsyncExitStack() as stack:
        through = await stack.enter_async_context(slow_line(port, *SLOW)) if slow else None
        pages = [Socket(await stack.enter_async_context(connected(port, through))) for _ in range(browsers)]
        for page in pages:
            await page.send(CAMERA)
        await pour_again(port, pages)
        frames, factors = zip(*await asyncio.gather(*map(whole_pour, pages)), strict=True)
        slider = await friction_of_one_pair(pages[0])
        waits = []
        for k in range(ECHOES):
            # In a pile that stands, a change may move nothing: there would be no frame to wait for.
            if k % AT_A_POUR == 0:
                await pour_again(port, pages)
            waits.append(await echo_ms(pages, slider, round(0.3 + 0.01 * k, 2)))
        return min(frames), min(factors), *zip(*waits, strict=True)


def tell(name, frames, factor, echoes, first_frames):
    print(f"{name:24} {frames:5.1f} frames/s   real time {factor:4.2f}", flush=True)
    print(f"{'':24} echo  {spread(echoes)}\n{'':24} frame {spread(first_frames)}", flush=True)


def spread(waits):
    last = sorted(waits)[int(0.95 * len(waits))]
    return f"{statistics.median(waits):5.0f} ms, 95 % {last:5.0f} ms ({len(waits)} changes)"


def beside_the_profiler():
    with tempfile.TemporaryDirectory() as data:
        study = Path(data, "repose-explorer", "studies", "sunflower_extract-quick-20260101-101010")
        study.mkdir(parents=True)
        (study / "result.json").write_text(json.dumps(reported_studies.result_of_case("planted")), encoding="utf-8")
        server, port = serve(*(part for one in POUR for part in ("--set", one)), data=data)
        try:
            print(f"{'profiler':18} {spread(asyncio.run(measure_profiler(port)))}")
        finally:
            server.terminate()
            server.wait(20)


@contextmanager
def study_at_work(wanted):
    """A study in the background, as the page starts one; or none."""
    if not wanted:
        yield
        return
    with tempfile.TemporaryDirectory() as folder:
        command = ["nice", "-n", str(BACKGROUND), sys.executable, "-m", "explorer", "calibrate", "--headless"]
        command += ["--profile", "quick", "--out", f"{folder}/out", "--store", f"{folder}/runs.sqlite"]
        running = subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True)
        session_gives_way(running.pid, BACKGROUND)
        try:
            while not list(Path(folder).glob("out/progress.jsonl")):
                time.sleep(0.5)
            time.sleep(15.0)  # its workers have compiled
            yield
        finally:
            running.terminate()
            running.wait(30)


def main():
    beside_the_profiler()
    for study, measured in (
        (False, {"alone": (1, False), "two browsers": (2, False), "slow line": (1, True), "two slow lines": (2, True)}),
        (True, {"beside a study": (1, False), "two, beside a study": (2, False)}),
    ):
        with study_at_work(study):
            server, port = serve(*(part for one in POUR for part in ("--set", one)))
            try:
                for name, (browsers, slow) in measured.items():
                    tell(name, *asyncio.run(measure(port, browsers, slow)))
            finally:
                server.terminate()
                server.wait(20)
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
