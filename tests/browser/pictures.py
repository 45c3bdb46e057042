"""The pictures of README and docs/page.md, taken from the running program in headless Chromium: `make pictures`.

Every room at 1280 × 800 on the dark page; the first view, *Calibrate* and *Diagnose* also at the other sizes, light.

The quick study of `make calibrate-quick` is taken, or run first, so that *Calibrate* has something to show, and the
diagnosis that `make diagnose` has left where there is one; everything is written to a data folder of its own.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

from tests.browser.served import served
from tests.browser.test_page import BEGUN, FLAGS, room
from tests.conftest import find_chromium

FOLDER = Path("assets/pictures")
QUICK, DIAGNOSIS = Path("results/quick"), Path("results/diagnosis")
WIDE, USUAL, SMALL, PHONE = (1920, 1080), (1280, 800), (1024, 768), (390, 844)
"""Sizes of the window [px]."""
PATIENCE_MS = 120_000
STUDY_ROOMS, CONTROL_ROOMS = ("Pour", "Calibrate", "Diagnose", "Laboratory", "Reports"), ("Set-up", "Look", "Export")
SETTLED = ("at rest", "no heap", "jammed", "obstructed")


def opened(browser: object, address: str, size: tuple[int, int], begun: bool = True) -> Page:
    """The page at ``address``, with or without the start dialogue of a first visit."""
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})  # type: ignore[attr-defined]
    page.set_default_timeout(PATIENCE_MS)
    if begun:
        page.add_init_script(BEGUN)
    page.goto(address)
    page.locator("#timeline .chip").filter(has_text=re.compile(".")).wait_for(state="attached")
    without_notifications(page)
    return page


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
    close = page.locator(".mantine-Notification-closeButton").first
    close.wait_for(state="attached")
    close.evaluate("button => button.click()")  # also below the start dialogue


def settled(page: Page) -> None:
    """Wait until the pile lies."""
    end = time.monotonic() + PATIENCE_MS / 1000
    while time.monotonic() < end:
        if any(word in page.locator("#timeline .chip").inner_text() for word in SETTLED):
            return
        time.sleep(1.0)


def live_pictures(browser: object, home: str) -> None:
    with served("--set", "body.spheres=coarse", "--store", f"{home}/runs.sqlite", data=home, patience=30) as address:
        page = opened(browser, address, USUAL, begun=False)
        shot(page, "start_1280")
        page.close()
        page = opened(browser, address, USUAL)
        settled(page)
        page.keyboard.press("r")
        page.wait_for_function("() => parseFloat(document.querySelector('#timeline .time').innerText) > 1")
        shot(page, "pouring")
        settled(page)
        shot(page, "controls_1280")
        for name in STUDY_ROOMS:
            room(page, name)
            time.sleep(6.0)
            shot(page, f"{name.lower()}_1280")
        room(page, "Laboratory")
        answered(page, "Photograph → angle of repose", "Read the angle", "explorer measure")
        page.get_by_text("explorer measure").first.scroll_into_view_if_needed()
        shot(page, "photograph_1280")
        for name in CONTROL_ROOMS:
            room(page, name)
            shot(page, f"{name.lower().replace('-', '_')}_1280")
        page.keyboard.press("Escape")
        page.evaluate("document.activeElement?.blur()")
        room(page, "Look")
        page.evaluate("document.activeElement?.blur()")
        for key in "cck":  # speed, contact force, force chains
            page.keyboard.press(key)
        shot(page, "forces_1280")
        for key in "ccck":  # coordination number, residence time, and back to the components
            page.keyboard.press(key)
        page.locator("#state-line").get_by_label("Dark or light page").click()
        page.close()
        for size in (WIDE, SMALL, PHONE):
            page = opened(browser, address, size)
            time.sleep(6.0)
            shot(page, f"controls_{size[0]}")
            if size != PHONE:
                for name in ("Calibrate", "Diagnose"):
                    room(page, name)
                    time.sleep(6.0)
                    shot(page, f"{name.lower()}_{size[0]}")
            page.close()


def replay_picture(browser: object, home: str) -> None:
    recording = Path(home) / "pour.rrd"
    command = [sys.executable, "-m", "explorer", "simulate", "funnel", "--set", "body.spheres=coarse"]
    subprocess.run([*command, "--record", str(recording)], check=True, stdout=subprocess.DEVNULL)
    with served("--replay", recording, data=home, patience=30) as address:
        page = browser.new_page(viewport={"width": USUAL[0], "height": USUAL[1]})  # type: ignore[attr-defined]
        page.set_default_timeout(PATIENCE_MS)
        page.goto(address)
        page.get_by_text("Replay").first.wait_for()
        without_notifications(page)
        time.sleep(12.0)
        shot(page, "replay_1280")
        page.close()


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for stale in FOLDER.glob("*.png"):
        stale.unlink()
    with tempfile.TemporaryDirectory() as home, sync_playwright() as playwright:
        study = Path(home) / "repose-explorer" / "studies" / "sunflower_extract-quick-20260101-000000"
        study.parent.mkdir(parents=True)
        if not (QUICK / "result.json").is_file():
            command = [sys.executable, "-m", "explorer", "calibrate", "--headless", "--profile", "quick"]
            subprocess.run([*command, "--out", str(QUICK)], check=False, stdout=subprocess.DEVNULL)
        shutil.copytree(QUICK, study)
        if (DIAGNOSIS / "diagnosis.json").is_file():
            shutil.copytree(DIAGNOSIS, Path(home) / "repose-explorer" / "diagnoses" / "trefoil_2-20260101-000000")
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=FLAGS)
        live_pictures(browser, home)
        replay_picture(browser, home)
        browser.close()


if __name__ == "__main__":
    main()
