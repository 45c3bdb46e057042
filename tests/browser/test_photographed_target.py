"""A photograph made the target of a project in headless Chromium, and still that after the server was started again."""

import os
import re
from contextlib import contextmanager

import pytest

from explorer.project.project import new_project
from tests.browser.served import served
from tests.browser.test_page import BEGUN, PATIENCE, SETTINGS, room

pytestmark = pytest.mark.browser


CUT_OFF = """(table, width) => {
    const panel = table.parentElement, before = panel.style.width;
    Object.assign(panel.style, { width: `${width}px`, boxSizing: "border-box" });
    const found = panel.scrollWidth > panel.clientWidth || table.offsetWidth > panel.clientWidth ? ["table"] : [];
    for (const cell of table.querySelectorAll("th, td")) {
        const text = cell.firstChild, words = [...text.data.matchAll(/[^ ]+/g)];
        // A word or a number on two lines has two boxes.
        const broken = words.filter(word => {
            const range = document.createRange();
            range.setStart(text, word.index); range.setEnd(text, word.index + word[0].length);
            return range.getClientRects().length > 1;
        });
        found.push(...broken.map(word => word[0]));
    }
    panel.style.width = before;
    return found;
}"""
"""What of a table does not fit a panel of that width [px]: the table itself, and words broken over two lines."""


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    folder = tmp_path_factory.mktemp("project") / "seeds"
    new_project(folder, "sunflower_extract")
    return folder


@contextmanager
def opened(browser, project):
    """The page; its console has nothing to complain about."""
    with served(project, *SETTINGS, data=project.parent, patience=30) as address:
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(PATIENCE)
        complaints = []
        page.on("console", lambda said: complaints.append(said.text) if said.type == "error" else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.add_init_script(BEGUN)
        page.goto(address)
        yield page
        page.close()
        assert complaints == []


def seen(page, text):
    page.get_by_text(text).filter(visible=True).first.wait_for()


def shot(page, name):
    if folder := os.environ.get("REPOSE_SCREENSHOTS"):
        page.screenshot(path=f"{folder}/{name}.png")


def test_a_photograph_is_read_and_made_the_target(browser, project):
    with opened(browser, project) as page:
        room(page, "Laboratory")
        page.get_by_text("Photograph → angle of repose").click()
        # The example comes with the length of its bar.
        bar = page.get_by_label("Reference bar [mm]")
        bar.wait_for()
        assert bar.input_value() == "100"
        use = page.get_by_role("button", name="Use as target", exact=True)
        use.wait_for()
        assert use.is_disabled()
        page.get_by_role("button", name="Read the angle", exact=True).click()
        page.wait_for_function(
            "[...document.querySelectorAll('button')].some(b => b.innerText === 'Use as target' && !b.disabled)"
        )
        table = page.locator("table", has_text="cone_25_30.jpg")
        for width in (320, 346):
            assert table.evaluate(CUT_OFF, width) == []
        table.scroll_into_view_if_needed()
        shot(page, "answer")
        use.click()
        # A solid of 25° and 30°.
        said = page.locator("#state-line").get_by_text(
            re.compile(r"27\.\d\d° \(standard error 0\.\d\d°\) · photograph")
        )
        said.wait_for()
        use.scroll_into_view_if_needed()
        seen(page, "Target of the study: 27.")
        shot(page, "laboratory")
        room(page, "Calibrate")
        seen(page, re.compile(r"standard error 0\.\d\d°\), read off cone_25_30\.jpg"))
        shot(page, "calibrate")
    assert (project / "target" / "photograph.json").is_file()


def test_it_is_there_after_a_restart_until_it_is_removed(browser, project):
    with opened(browser, project) as page:
        page.locator("#state-line").get_by_text("· photograph").wait_for()
        room(page, "Laboratory")
        page.get_by_text("Photograph → angle of repose").click()
        page.get_by_role("button", name="Remove the target", exact=True).click()
        page.locator("#state-line").get_by_text("25.00° ± 2.00°").wait_for()
        room(page, "Calibrate")
        seen(page, "From the study's file")
        shot(page, "removed")
    assert not (project / "target").exists()
