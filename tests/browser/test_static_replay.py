"""The folder of ``explorer replay --static`` in headless Chromium, with every other host refused: it opens and draws.

rerun's viewer is one canvas, its panels included, and WebGL 2 in software is enough for it. What it shows is read off
the picture: the colours of the bodies, which no other part of the page has.
"""

import io
import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from PIL import Image

from explorer.recordings.pour_log import PourLog
from explorer.recordings.replay import replay_server
from explorer.scene.file import load_scene
from tests.browser.pages import FLAGS, new_page
from tests.explorer.background.waiting import wait_for
from tests.explorer.recordings.test_pour_log import poses

pytestmark = pytest.mark.browser

FRAMES, INTERVAL = 500, 0.04
"""20 s, in which the bodies rise by 0.2 m: it plays once, and a slow machine must have time for two pictures."""
START_LIMIT = 240.0
"""Wall time [s]: 40 MB of WebAssembly and all shaders are compiled, without a graphics card."""
LEAST_SHOWN, LEAST_RISE = 100, 10.0
"""Pixels in the colour of a body, and how far they rise [pixels] when it plays."""


def ring(height):
    """Eight seeds around the funnel, in front of nothing."""
    made, angle = poses(*[0] * 8), np.arange(8) * np.pi / 4
    made.position[:] = np.column_stack([0.12 * np.cos(angle), 0.12 * np.sin(angle), np.full(8, height)])
    return made


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What the program writes for a recording of seeds that rise."""
    home = tmp_path_factory.mktemp("static")
    with PourLog(home / "rise.rrd", load_scene("funnel"), seed=1) as log:
        for k in range(FRAMES):
            log.frame(INTERVAL * k, ring(0.03 + 0.2 * k / FRAMES), {"angle_of_repose_deg": 20.0 + 0.02 * k})
    command = [sys.executable, "-m", "explorer", "replay", str(home / "rise.rrd"), "--static", str(home / "page")]
    subprocess.run(command, check=True, capture_output=True)
    return home / "page"


@pytest.fixture(scope="module")
def page(chromium, folder):
    """The opened page; other hosts that it asked are in ``page.strangers``, its errors in ``page.broken``."""
    from playwright.sync_api import sync_playwright

    with replay_server(folder, 0) as server, sync_playwright() as playwright:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_address[1]}/"
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = new_page(browser, 1000, 700)
        page.strangers, page.broken = [], []

        def refuse(route):
            page.strangers.append(route.request.url)
            route.abort()

        page.route(lambda url: not url.startswith((address, "blob:", "data:")), refuse)
        page.goto(address)
        yield page
        browser.close()
        server.shutdown()


def rows_of_bodies(page):
    """Rows of the pixels that have the hue of the first component, below the viewer's bar, in the 3-D view."""
    shot = page.screenshot(timeout=1000 * START_LIMIT)
    seen = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)[40:, :600]
    red, green, blue = seen[..., 0], seen[..., 1], seen[..., 2]
    rows, _ = np.nonzero((red > green + 25) & (green > blue + 25) & (blue < 0.35 * red))
    return rows


def awaited(look, wanted):
    """What ``look`` finds as soon as ``wanted`` of it holds."""
    seen = []

    def is_wanted():
        seen[:] = [look()]
        return wanted(seen[0])

    wait_for(is_wanted, START_LIMIT)
    return seen[0]


def test_it_draws_the_recording_and_plays(page):
    first = awaited(lambda: rows_of_bodies(page), lambda rows: len(rows) >= LEAST_SHOWN)
    sizes = page.evaluate("[...document.querySelectorAll('canvas')].map(canvas => [canvas.width, canvas.height])")
    assert sizes == [[1000, 700]]
    awaited(
        lambda: rows_of_bodies(page),
        lambda rows: len(rows) >= LEAST_SHOWN and rows.mean() < first.mean() - LEAST_RISE,
    )
    if shot := os.environ.get("REPOSE_SCREENSHOT"):
        page.screenshot(path=shot, timeout=1000 * START_LIMIT)


def test_it_asks_no_other_host_and_nothing_breaks(page):
    assert page.strangers == []
    assert page.broken == []
