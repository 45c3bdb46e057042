"""A photograph made the target of a project in headless Chromium, and still that after the server was started again."""

import os
import re
from contextlib import contextmanager

import pytest

from explorer.project.project import new_project
from tests.browser.pages import PATIENCE, new_page
from tests.browser.served import served
from tests.browser.test_page import SETTINGS, no_serious_fault, room, unfold

pytestmark = pytest.mark.browser


ENABLED = "text => [...document.querySelectorAll('button')].some(b => b.innerText === text && !b.disabled)"
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


@pytest.fixture
def project(tmp_path):
    folder = tmp_path / "project" / "seeds"
    new_project(folder, "sunflower_extract")
    return folder


@contextmanager
def opened(browser, project):
    """The page; its console has nothing to complain about."""
    with served(project, *SETTINGS, data=project.parent, patience=30) as address:
        page = new_page(browser, 1280, 800)
        page.goto(address)
        yield page
        page.close()
        assert page.complaints == []


def seen(page, text):
    page.get_by_text(text).filter(visible=True).first.wait_for()


def shot(page, name):
    if folder := os.environ.get("REPOSE_SCREENSHOTS"):
        page.screenshot(path=f"{folder}/{name}.png")


def test_a_photograph_is_made_the_target_until_it_is_removed(browser, project):
    with opened(browser, project) as page:
        room(page, "Laboratory")
        unfold(page, "Photograph → angle of repose")
        # The example comes with the length of its bar.
        bar = page.get_by_label("Reference bar [mm]")
        bar.wait_for()
        assert bar.input_value() == "100"
        use = page.get_by_role("button", name="Use as target", exact=True)
        use.wait_for()
        assert use.is_disabled()
        page.get_by_role("button", name="Read the angle", exact=True).click()
        page.wait_for_function(ENABLED, arg="Use as target")
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

    # The server is started again.
    with opened(browser, project) as page:
        page.locator("#state-line").get_by_text("· photograph").wait_for()
        room(page, "Laboratory")
        unfold(page, "Photograph → angle of repose")
        remove = page.get_by_role("button", name="Remove the target", exact=True)
        page.wait_for_function(ENABLED, arg="Remove the target")
        # By key: what is loaded above it may push it away from under the pointer.
        remove.press("Enter")
        page.locator("#state-line").get_by_text("17.00° ± 2.00°").wait_for()
        room(page, "Calibrate")
        seen(page, "From the study's file")
        shot(page, "removed")
    assert not (project / "target").exists()


def test_the_base_line_and_a_length_are_clicked_in_the_photograph(browser, project):
    with opened(browser, project) as page:
        room(page, "Laboratory")
        unfold(page, "Photograph → angle of repose")
        with page.expect_popup() as popped:
            page.get_by_role("link", name="Mark base line or a known length in it").click()
        table = popped.value
        table.set_default_timeout(PATIENCE)
        picture = table.locator(".nicegui-interactive-image, .q-page img").first
        picture.wait_for()
        box = picture.bounding_box()
        for x in (0.1, 0.9):
            table.mouse.click(box["x"] + x * box["width"], box["y"] + 0.8 * box["height"])
        table.locator("svg line[stroke-width='2']").wait_for(state="attached")
        table.get_by_role("button", name="Known length").click()
        for x in (0.2, 0.4):
            table.mouse.click(box["x"] + x * box["width"], box["y"] + 0.1 * box["height"])
        table.wait_for_function("document.querySelectorAll('svg line[stroke-width=\"2\"]').length === 2")
        table.get_by_role("button", name="Use these marks").click()
        table.get_by_role("status").filter(has_text="enter it; allowed").wait_for()
        table.get_by_label("Known length [mm]").fill("80")
        table.get_by_role("button", name="Use these marks").click()
        table.get_by_role("status").filter(has_text="Taken for cone_25_30.jpg").wait_for()
        shot(table, "photograph_marks")
        no_serious_fault(table)
        table.close()
        seen(page, "a length of 80 mm, which stands in place of scale and bar")
        shot(page, "laboratory_marked")
        page.get_by_role("button", name="Remove the marks", exact=True).click()
        seen(page, "Nothing is marked")
