"""The pictures of README and docs, taken from the running program in headless Chromium: `make pictures`.

Every room in its states at 1280 × 800 on the dark page; the most important ones also at other sizes, light, and one at
200 %. `docs/pictures.md` lists them all: what is taken here and what stands there have to be the same.

*Calibrate* shows the quick study of `make calibrate-quick`, which is run first where it is not there; *Diagnose* shows
`examples/trefoil_2`. Everything is written to data folders of its own. With names of ``PARTS`` only those are taken.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from tests.browser.pages import BEGUN, FLAGS
from tests.browser.served import EXAMPLE, diagnosed, served
from tests.browser.test_page import slider
from tests.conftest import find_chromium

FOLDER, GALLERY = Path("assets/pictures"), Path("docs/pictures.md")
QUICK = Path("results/quick")
USUAL, WIDE, SMALL, PHONE = (1280, 800), (1920, 1080), (1024, 768), (390, 844)
"""Sizes of the window [px]."""
TWICE = 2.0
"""A browser's zoom of 200 %: half as many pixels of twice the size."""
PATIENCE_MS = 300_000
COLOURS = 256
SETTLED = ("at rest", "no heap", "jammed", "obstructed")
POUR = ("--set", "body.spheres=coarse")


class Camera:
    """Takes pictures of one page."""

    def __init__(self, page: Page) -> None:
        self.page = page

    def take(self, name: str, wait: float = 2.0) -> None:
        """A picture after ``wait`` [s], in which what was asked for is drawn."""
        self.page.mouse.move(5, 5)
        self.page.evaluate("document.activeElement?.blur()")  # no hint of what was pressed last
        time.sleep(wait)
        file = FOLDER / f"{name}.png"
        self.page.screenshot(path=file)
        with Image.open(file) as taken:
            # Not the median cut, which gives rare colours away: those of the key are few pixels.
            few = taken.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)
        few.save(file, optimize=True)
        print(f"{time.monotonic() - BEGAN:6.0f} s  {file}", flush=True)

    def open(self, tab: str) -> None:
        # In the window of a phone a folded sheet hides five of the nine tabs, until one of them is asked for.
        self.page.wait_for_function("window.explorer && document.querySelectorAll('#root [role=tab]').length > 3")
        self.page.evaluate(f"window.explorer.openRoom('{tab}')")
        time.sleep(2.0)

    def press(self, button: str) -> None:
        self.page.get_by_role("button", name=button, exact=True).filter(visible=True).first.click()

    def told(self, text: str | re.Pattern[str]) -> None:
        """Wait until ``text`` can be read."""
        self.page.get_by_text(text).filter(visible=True).first.wait_for()

    def top(self, text: str) -> None:
        """Wait for ``text``, and bring it to the top of its room."""
        self.told(text)
        found = self.page.get_by_text(text).filter(visible=True).first
        found.evaluate("text => text.scrollIntoView({block: 'start'})")

    def unfold(self, section: str) -> None:
        """Open a section, and bring it to the top."""
        head = self.page.get_by_role("button", name=section).filter(visible=True).first
        if head.get_attribute("aria-expanded") != "true":
            head.click()
        time.sleep(1.0)
        head.evaluate("head => head.scrollIntoView({block: 'start'})")

    def keys(self, *keys: str) -> None:
        """Press ``keys`` where no control takes them."""
        self.page.keyboard.press("Escape")
        self.page.evaluate("document.activeElement?.blur()")
        for key in keys:
            self.page.keyboard.press(key)
            time.sleep(0.3)

    def settled(self) -> None:
        """Wait until the pile lies."""
        words = "|".join(SETTLED)
        self.page.wait_for_function(f"() => /{words}/.test(document.querySelector('#timeline .chip').innerText)")

    def board(self, title: str) -> None:
        """Wait for the verdict on a board."""
        self.page.frame_locator(f'iframe[title="{title}"]').locator(".banner strong").wait_for()

    def scroll_board(self, title: str, figure: int) -> None:
        """Bring a chart of a board into sight."""
        shown = self.page.frame_locator(f'iframe[title="{title}"]').locator("figure").nth(figure)
        shown.evaluate("figure => figure.scrollIntoView({block: 'start'})")


@contextmanager
def camera(
    browser: Browser, address: str, size: tuple[int, int] = USUAL, begun: bool = True, zoom: float = 1.0
) -> Iterator[Camera]:
    """The page at ``address``, with or without the start dialogue of a first visit."""
    width, height = (round(length / zoom) for length in size)
    page = browser.new_page(viewport={"width": width, "height": height}, device_scale_factor=zoom)
    page.set_default_timeout(PATIENCE_MS)
    if begun:
        page.add_init_script(BEGUN)
    page.goto(address)
    # viser's word on software rendering, which a person with a graphics card does not see; also below the dialogue
    close = page.locator(".mantine-Notification-closeButton").first
    close.wait_for(state="attached")
    close.evaluate("button => button.click()")
    try:
        yield Camera(page)
    finally:
        page.close()


def first_visit(browser: Browser, home: Path) -> None:
    """Before the solver is there, which has to be compiled first."""
    with served("--store", home / "runs.sqlite", data=home, kernels=home / "kernels", patience=30) as address:
        # At once: ten seconds later the solver is there.
        with camera(browser, address) as view:
            view.told("recording of this pour")
            view.take("controls_loading", 0.5)
        with camera(browser, address, begun=False) as view:
            view.take("start")


def without_results(browser: Browser, home: Path) -> None:
    """A project in which nothing was done yet: empty rooms, and what is refused."""
    with (
        served(*POUR, "--store", home / "runs.sqlite", data=home, patience=60) as address,
        camera(browser, address) as view,
    ):
        for name in ("Calibrate", "Diagnose", "Laboratory", "Reports"):
            view.open(name)
            view.take(f"{name.lower()}_empty")
        view.open("Laboratory")
        view.unfold("Photograph → angle of repose")
        blank = home / "no_pile.png"
        Image.new("RGB", (640, 480), "white").save(blank)
        with view.page.expect_file_chooser() as chooser:
            view.press("Upload: photograph")
        chooser.value.set_files(blank)
        time.sleep(2.0)
        view.press("Read the angle")
        view.told("no angle")
        view.take("laboratory_refused")
        view.open("Diagnose")
        view.page.get_by_label("Measured data").first.click()
        view.page.get_by_role("option", name="folder below").click()
        view.press("Start")
        view.told("choose measured data")
        view.take("diagnose_refused")


def at_work(browser: Browser, home: Path) -> None:
    """A study and a diagnosis that run, and a study that fails."""
    store = home / "runs.sqlite"
    with served(*POUR, "--store", store, data=home, patience=60) as address:
        for tab, folder, runs in (("Calibrate", "studies", "runs"), ("Diagnose", "diagnoses", "pours")):
            with camera(browser, address) as view:
                view.open(tab)
                view.press("Start")
                view.told("Running at low priority")
            poured(home / "repose-explorer" / folder)
            with camera(browser, address) as view:
                view.open(tab)
                view.told(re.compile(rf"[1-9]\d* of \d+ {runs}, time left"))
                view.take(f"{tab.lower()}_running", 6.0)
                view.press("Cancel")
                view.told("Cancelled.")
        store.write_text("no store\n")
        with camera(browser, address) as view:
            view.open("Calibrate")
            view.press("Start")
            view.told("Failed.")
            view.take("calibrate_failed")


def poured(folder: Path) -> None:
    """Wait until a command that writes below ``folder`` has some runs: without a page, which takes the cores."""
    end = time.monotonic() + PATIENCE_MS / 1000
    while not any(len(file.read_text().splitlines()) > 2 for file in folder.rglob("progress.jsonl")):
        assert time.monotonic() < end, f"{folder}: no run in time"
        time.sleep(1.0)


def with_results(home: Path) -> None:
    """Data of a person who has calibrated and diagnosed."""
    study = home / "repose-explorer" / "studies" / "sunflower_extract-quick-20260101-000000"
    study.parent.mkdir(parents=True)
    shutil.copytree(QUICK, study)
    explorer("report", EXAMPLE, "--out", home / "report")
    shutil.copytree(home / "report", diagnosed(home), dirs_exist_ok=True)


def explorer(*arguments: object) -> None:
    command = [sys.executable, "-m", "explorer", *map(str, arguments)]
    subprocess.run(command, check=False, stdout=subprocess.DEVNULL)


def results(browser: Browser, home: Path) -> None:
    """A pour, a finished study and a finished diagnosis."""
    with_results(home)
    with served(*POUR, "--store", home / "runs.sqlite", data=home, patience=60) as address:
        # A page of its own for each: rooms that one opens stay open beside the next.
        for pictures in (finished_pictures, laboratory_pictures, pour_pictures, side_by_side):
            with camera(browser, address) as view:
                pictures(view)


def sizes(browser: Browser, home: Path) -> None:
    """The most important rooms in windows of other sizes, and one at 200 %."""
    with_results(home)
    with served(*POUR, "--store", home / "runs.sqlite", data=home, patience=60) as address:
        with camera(browser, address, zoom=TWICE) as view:
            view.settled()
            view.open("Calibrate")
            view.board("Study")
            view.take("calibrate_finished_200_percent", 6.0)
            view.page.locator("#state-line").get_by_label("Dark or light page").click()
        for size in (WIDE, SMALL, PHONE):
            with camera(browser, address, size) as view:
                sized_pictures(view, f"_{size[0]}")


def pour_pictures(view: Camera) -> None:
    """The pour, and what acts on it."""
    view.settled()
    view.open("Controls")
    view.take("controls_at_rest")
    view.press("Pour 8 more")
    for tab in ("Set-up", "Look", "Export"):
        view.open(tab)
        view.take(tab.lower().replace("-", "_"))
    view.open("Set-up")
    view.unfold("More of rig and feed")
    wide = view.page.get_by_label("Outlet diameter").filter(visible=True).first
    before = wide.input_value()
    wide.fill("150")
    view.press("Restart with this set-up")
    view.told("must be larger")
    view.take("set_up_refused")
    wide.fill(before)
    view.open("Look")
    view.keys("c", "c", "k")  # speed, contact force, force chains
    view.take("look_forces", 6.0)
    view.keys("c", "c", "c", "k", "n")  # coordination number, residence time, components; a body
    view.unfold("Body")
    view.take("look_body", 4.0)
    view.keys("Escape")
    view.open("Pour")
    view.take("pour_at_rest", 6.0)
    view.unfold("Silhouette and flank fit")
    view.take("pour_outline", 4.0)
    view.open("Controls")
    view.page.get_by_text("Pouring in the background").wait_for(state="hidden")
    view.told(re.compile(r"SD \(\d seeds"))
    view.take("controls_population")
    slider(view.page, "Friction").focus()
    view.page.keyboard.press("Home")
    view.take("controls_changed", 4.0)
    # Without friction nothing comes to rest.
    view.keys("z")
    view.press("Same seed")
    view.settled()


def laboratory_pictures(view: Camera) -> None:
    """Each piece of the laboratory with an answer."""
    view.open("Laboratory")
    for name, section, button, answer in (
        ("bench", "Bench test → parameters", "Evaluate", "explorer lab"),
        ("photograph", "Photograph → angle of repose", "Read the angle", "explorer measure"),
        ("design", "Your own design → runs", "Make the sheet", "explorer design"),
        ("audit", "Audit of a published study", "Audit the shipped article", "explorer audit"),
    ):
        view.unfold(section)
        view.press(button)
        view.top(answer)
        view.take(f"laboratory_{name}")
        view.press(section)
        time.sleep(1.0)
    view.unfold("Measured data → Diagnose")
    angles = view.page.get_by_label("Angles [°]").filter(visible=True).first
    angles.fill("24.1, 25.0, 26.2, 23.9")
    angles.press("Enter")
    time.sleep(1.0)
    view.press("Save the data")
    view.top("explorer new measurement")
    view.take("laboratory_measured_data")
    view.press("Measured data → Diagnose")


def finished_pictures(view: Camera) -> None:
    """Answers of both commands, over a pour that runs."""
    view.page.wait_for_function("() => parseFloat(document.querySelector('#timeline .time').innerText) > 1")
    view.take("controls_pouring")
    view.open("Reports")
    view.take("reports_finished", 6.0)
    view.open("Calibrate")
    view.board("Study")
    view.take("calibrate_finished", 4.0)
    view.scroll_board("Study", 0)
    view.take("calibrate_charts", 4.0)
    view.unfold("Profiler")
    view.page.locator(".js-plotly-plot").first.wait_for()
    view.take("calibrate_profiler", 4.0)
    view.open("Diagnose")
    view.board("Diagnosis")
    view.take("diagnose_finished", 4.0)
    view.scroll_board("Diagnosis", 0)
    view.take("diagnose_charts", 4.0)


def side_by_side(view: Camera) -> None:
    """Both models of the diagnosis poured beside the measured pile, dark, and light at the other sizes."""
    view.open("Diagnose")
    view.press("Show side by side")
    time.sleep(5.0)
    view.settled()
    view.take("diagnose_side_by_side", 4.0)
    view.page.locator("#state-line").get_by_label("Dark or light page").click()
    for size in (WIDE, SMALL, PHONE):
        view.page.set_viewport_size({"width": size[0], "height": size[1]})
        if size == PHONE:
            view.page.get_by_text("Granular material explorer").click()  # folds the sheet, which covers the piles
        view.take(f"diagnose_side_by_side_{size[0]}", 4.0)
    view.page.set_viewport_size({"width": USUAL[0], "height": USUAL[1]})
    view.open("Diagnose")
    view.press("Back to my pour")
    time.sleep(5.0)
    view.settled()


def sized_pictures(view: Camera, ending: str) -> None:
    """The most important rooms."""
    view.open("Controls")
    view.take(f"controls_at_rest{ending}", 4.0)
    view.open("Calibrate")
    view.board("Study")
    view.take(f"calibrate_finished{ending}", 4.0)
    view.open("Laboratory")
    view.unfold("Photograph → angle of repose")
    view.press("Read the angle")
    view.top("explorer measure")
    view.take(f"laboratory_photograph{ending}")
    view.open("Reports")
    view.take(f"reports_finished{ending}", 4.0)
    view.open("Diagnose")
    view.board("Diagnosis")
    view.take(f"diagnose_finished{ending}", 4.0)


def replay(browser: Browser, home: Path) -> None:
    """A recording."""
    recording = home / "pour.rrd"
    explorer("simulate", "funnel", *POUR, "--record", recording)
    with served("--replay", recording, data=home, patience=30) as address, camera(browser, address) as view:
        view.told("Replay")
        view.take("replay", 12.0)


def tables(browser: Browser, home: Path) -> None:
    """Tables that are filled in, and a photograph that is clicked."""
    with_results(home)
    pages = {
        "sheet": "[role=gridcell]",
        "ranges": "[role=gridcell]",
        "runs": "[role=gridcell]",
        "photograph": "img",
    }
    with (
        served(*POUR, "--store", home / "runs.sqlite", data=home, patience=60) as address,
        camera(browser, address) as view,
    ):
        for name, shown in pages.items():
            view.page.goto(f"{address}/tables/{name}")
            view.page.locator(shown).first.wait_for()
            if name == "photograph":
                box = view.page.locator("img").first.bounding_box()
                assert box is not None
                for x in (0.1, 0.9):
                    view.page.mouse.click(box["x"] + x * box["width"], box["y"] + 0.815 * box["height"])
            view.take(f"tables_{name}")


PARTS = {
    "first": first_visit,
    "empty": without_results,
    "work": at_work,
    "results": results,
    "sizes": sizes,
    "tables": tables,
    "replay": replay,
}
BEGAN = time.monotonic()


def main(parts: list[str]) -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    if not (QUICK / "result.json").is_file():
        explorer("calibrate", "--headless", "--profile", "quick", "--out", QUICK)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=FLAGS)
        for part in parts or PARTS:
            with tempfile.TemporaryDirectory() as home:
                PARTS[part](browser, Path(home))
        browser.close()
    listed = set(re.findall(r"pictures/(\w+)\.png", GALLERY.read_text(encoding="utf-8")))
    taken = {file.stem for file in FOLDER.glob("*.png")}
    if wrong := sorted(listed ^ taken):
        sys.exit(f"{GALLERY} and {FOLDER} differ in {', '.join(wrong)}")


if __name__ == "__main__":
    main(sys.argv[1:])
