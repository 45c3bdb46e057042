"""The pictures of README and docs/page.md, taken from the running program in headless Chromium: `make pictures`.

A quick study is run first, so that its tab has something to show, and the diagnosis that `make diagnose` has left is
taken where there is one; everything is written to a data folder of its own.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

from tests.browser.test_page import FLAGS
from tests.conftest import find_chromium

FOLDER = Path("assets/pictures")
DIAGNOSIS = Path("results/diagnosis")
SIZE = {"width": 1500, "height": 1000}
PATIENCE_MS = 120_000
ALL_TABS = tuple(
    (name, name.lower().replace(" ", "_")) for name in ("Pour", "Look", "Take along", "Calibrate", "Diagnose")
)
SETTLED = ("at rest", "no heap", "ended", "jammed", "obstructed")


@contextmanager
def served(home: str, *arguments: str) -> Iterator[str]:
    """Address of `explorer serve` with these arguments and its own data folder."""
    environment = {**os.environ, "XDG_DATA_HOME": home}
    command = [sys.executable, "-m", "explorer", "serve", "--port", "0", *arguments]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert server.stdout is not None
        found = re.search(r"http://\S+", server.stdout.readline())
        assert found, "the server did not tell its address"
        yield found[0]
    finally:
        server.terminate()
        server.wait(30)


def opened(browser: object, address: str, text: str) -> Page:
    """The page at ``address`` once it shows ``text``."""
    page = browser.new_page(viewport=SIZE)  # type: ignore[attr-defined]
    page.set_default_timeout(PATIENCE_MS)
    page.goto(address)
    page.get_by_text(text).first.wait_for()
    return page


def tab(page: Page, name: str) -> None:
    page.get_by_role("tab", name=name).click()
    time.sleep(2.0)


def shot(page: Page, name: str) -> None:
    page.mouse.move(5, 5)
    time.sleep(2.0)
    page.screenshot(path=FOLDER / f"{name}.png")
    print(FOLDER / f"{name}.png", flush=True)


def answered(page: Page, folder: str, button: str, answer: str) -> None:
    """Open a folder of the laboratory's tab, press a button in it and wait for its answer."""
    time.sleep(1.0)  # a folder that is closing still takes the click
    page.get_by_text(folder).click()
    page.get_by_role("button", name=button, exact=True).click()
    page.get_by_text(answer).first.wait_for()


def without_notifications(page: Page) -> None:
    """Close viser's word on software rendering, which a person with a graphics card does not see."""
    page.locator(".mantine-Notification-closeButton").first.click()


def settled(page: Page) -> None:
    """Wait until the pile lies."""
    end = time.monotonic() + PATIENCE_MS / 1000
    while page.locator(".pour .state").inner_text() not in SETTLED and time.monotonic() < end:
        time.sleep(1.0)


def live_pictures(browser: object, home: str) -> None:
    with served(home, "--set", "body.spheres=coarse") as address:
        page = opened(browser, address, "Static friction")
        without_notifications(page)
        settled(page)
        page.keyboard.press("r")
        page.wait_for_function("() => /Simulated time\\s*1\\.[0-9]+ s/.test(document.querySelector('.pour').innerText)")
        shot(page, "pouring")
        settled(page)
        shot(page, "pour_dark")
        tab(page, "Look")
        page.keyboard.press("Escape")
        page.evaluate("document.activeElement?.blur()")
        for key in "cck":  # speed, contact force, force chains
            page.keyboard.press(key)
        shot(page, "look_dark")
        for key in "ccck":  # coordination number, residence time, and back to the components
            page.keyboard.press(key)
        for name, file in ALL_TABS[2:]:
            tab(page, name)
            time.sleep(4.0)
            shot(page, f"{file}_dark")
        tab(page, "Laboratory")
        answered(page, "Photograph → angle of repose", "Read the angle", "explorer measure")
        shot(page, "laboratory_dark")
        page.get_by_text("Photograph → angle of repose").click()
        page.get_by_text("Dark page").click()
        for name, file in ALL_TABS:
            tab(page, name)
            time.sleep(4.0)
            shot(page, f"{file}_light")
        tab(page, "Laboratory")
        answered(page, "Filled sheet → model and optimum", "Analyse", "explorer analyse")
        page.get_by_text("On the command line:").last.scroll_into_view_if_needed()
        time.sleep(4.0)
        shot(page, "laboratory_light")
        page.close()


def replay_picture(browser: object, home: str) -> None:
    recording = Path(home) / "pour.rrd"
    command = [sys.executable, "-m", "explorer", "simulate", "funnel", "--set", "body.spheres=coarse"]
    subprocess.run([*command, "--record", str(recording)], check=True, stdout=subprocess.DEVNULL)
    with served(home, "--replay", str(recording)) as address:
        page = opened(browser, address, "Replay")
        without_notifications(page)
        time.sleep(6.0)
        shot(page, "replay")
        page.get_by_text("Dark page").click()
        shot(page, "replay_light")
        page.close()


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as home, sync_playwright() as playwright:
        study = Path(home) / "repose-explorer" / "studies" / "sunflower_extract-quick-20260101-000000"
        study.parent.mkdir(parents=True)
        command = [
            sys.executable,
            "-m",
            "explorer",
            "calibrate",
            "--headless",
            "--profile",
            "quick",
            "--out",
            str(study),
        ]
        subprocess.run([*command, "--store", f"{home}/runs.sqlite"], check=False, stdout=subprocess.DEVNULL)
        if (DIAGNOSIS / "diagnosis.json").is_file():
            shutil.copytree(DIAGNOSIS, Path(home) / "repose-explorer" / "diagnoses" / "trefoil_2-20260101-000000")
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=FLAGS)
        live_pictures(browser, home)
        replay_picture(browser, home)
        browser.close()


if __name__ == "__main__":
    main()
