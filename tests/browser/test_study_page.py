"""The panels of studies and diagnoses in headless Chromium: charts, and work that is started, watched and stopped."""

import json
import os
import re
import time

import pytest

from tests.browser.pages import FLAGS, PATIENCE, new_page
from tests.browser.served import served
from tests.browser.test_design_page import write_into
from tests.browser.test_page import SETTINGS, positions, room, slider, unfold, wait_for
from tests.browser.test_photographed_target import shot
from tests.explorer import reported_studies

pytestmark = pytest.mark.browser

COMPILED = 300.0
"""Seconds: the first run of a study comes after its workers have compiled the solver, at low priority."""
HERE = (
    """() => document.querySelector('.js-plotly-plot').data.filter(trace => trace.name === 'here').map(t => t.x[0])"""
)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Folder of the user's data."""
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def address(data):
    """Address of a page that finds one finished study in the user's data."""
    study = data / "repose-explorer" / "studies" / "sunflower_extract-quick-20260101-101010"
    study.mkdir(parents=True)
    (study / "result.json").write_text(json.dumps(reported_studies.result_of_case("planted")))
    with served("--store", data / "runs.sqlite", *SETTINGS, data=data, patience=30) as found:
        yield found


@pytest.fixture(scope="module")
def page(address, chromium):
    """The opened tab; what its console complains about is collected in ``page.complaints``."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = new_page(browser, 1280, 1400)
        opened(page, address)
        yield page
        if shot := os.environ.get("REPOSE_SCREENSHOT"):
            page.screenshot(path=shot)
        browser.close()


def opened(page, address, tab="Calibrate"):
    page.goto(address)
    room(page, tab)
    page.get_by_text("Profile" if tab == "Calibrate" else "Measured data").first.wait_for()


def board(page, title):
    """The board in the open tab."""
    return page.frame_locator(f'iframe[title="{title}"]')


def press(page, button):
    """Click the button of that name in the open tab."""
    page.get_by_role("button", name=button, exact=True).filter(visible=True).first.click()


def shown(page, text):
    """Wait for ``text`` in the open tab."""
    page.get_by_text(text).filter(visible=True).first.wait_for()


def cancel_resume_cancel(page):
    """What runs in the open tab is cancelled, goes on, and is cancelled for good."""
    press(page, "Cancel")
    shown(page, "Cancelled.")
    press(page, "Resume last")
    shown(page, "Running at low priority")
    press(page, "Cancel")
    shown(page, "Cancelled.")


def test_a_number_box_that_is_emptied_shows_the_number_that_holds_when_it_is_left(page):
    unfold(page, "Ranges and target of the next study")
    box = page.get_by_label("Target: mean [°]")
    for typed in ("", "-"):
        box.fill("26.5")
        shown(page, "26.5°")
        box.press("Control+a")
        box.press("Delete")
        box.press_sequentially(typed)
        assert box.input_value() == typed
        box.press("Tab")
        wait_for(lambda: box.input_value() == "26.5")
    shown(page, "26.5°")
    press(page, "Reset to file")
    wait_for(lambda: box.input_value() == "24.68")
    shown(page, "Ranges and target are those of the file.")


def test_the_newest_finished_study_is_a_board_with_its_verdict_and_charts(page):
    shown = board(page, "Study")
    shown.locator(".banner strong").wait_for()
    assert "CALIBRATED WITHIN" in shown.locator(".banner strong").inner_text()
    # A chart is drawn once it is in sight.
    shown.locator("figure").first.scroll_into_view_if_needed()
    shown.locator("figure .js-plotly-plot").first.wait_for()
    page.locator("#state-line").get_by_text("calibrated within").wait_for()
    # A column is sorted by its head, and a row opens its run in the scene.
    shown.locator("summary", has_text="Runs").click()
    runs = shown.locator("details[open] tbody tr")
    before = runs.first.inner_text()
    shown.locator("details[open] th button", has_text="Seed").click()
    shown.locator("details[open] th[aria-sort=ascending]").wait_for()
    seeds = [int(text) for text in shown.locator("details[open] tbody td:nth-child(3)").all_inner_texts()]
    assert seeds == sorted(seeds)
    assert before
    shown.locator("details[open] input").fill("point 4")
    wait_for(lambda: all("point 4" in text for text in runs.all_inner_texts()))
    runs.first.click()
    page.get_by_text("this pour may differ").first.wait_for()


def test_a_section_opens_by_keyboard(page):
    head = page.get_by_role("button", name="Other results").filter(visible=True).first
    head.focus()
    page.keyboard.press("Enter")
    page.get_by_text("From a folder").filter(visible=True).first.wait_for()
    page.keyboard.press("Enter")


def test_a_slider_of_the_profiler_moves_its_chart_by_keyboard(page):
    unfold(page, "Profiler")
    page.locator(".js-plotly-plot").first.wait_for()
    thumb = slider(page, "X7:")
    thumb.scroll_into_view_if_needed()
    thumb.focus()
    page.keyboard.press("Home")
    wait_for(lambda: len(page.evaluate(HERE)) == 3)
    first = page.evaluate(HERE)
    page.keyboard.press("End")
    wait_for(lambda: page.evaluate(HERE)[0] > first[0])
    assert page.evaluate(HERE)[1:] == first[1:]


def test_a_run_is_left_out_in_a_table_and_the_board_says_both_answers(page):
    with page.expect_popup() as popped:
        page.get_by_role("link", name="Leave runs of the surface out").click()
    table = popped.value
    table.set_default_timeout(PATIENCE)
    cell = table.locator("[role=row][row-index='0'] [role=gridcell]").last
    write_into(table, cell, "wedged in the outlet")
    table.get_by_role("button", name="Save").click()
    table.get_by_role("status").filter(has_text="Saved").wait_for()
    shot(table, "runs_table")
    table.close()
    frame = board(page, "Study")
    frame.get_by_text("Parameters without these runs").wait_for()
    frame.get_by_role("cell", name="wedged in the outlet").wait_for()


def test_a_study_is_started_paused_cancelled_and_resumed(page, address, data):
    press(page, "Start")
    shown(page, "Running at low priority")
    # It runs on without a page, and faster than beside a browser that draws without a graphics card.
    page.goto("about:blank")
    wait_for(lambda: any(len(file.read_text().splitlines()) > 2 for file in data.rglob("progress.jsonl")), COMPILED)
    opened(page, address)
    wait_for(lambda: re.search(r"[1-9]\d* of \d+ runs, time left", page.inner_text("body")))
    # The pile pours on beside it: anew by key, and the bodies fall.
    page.evaluate("document.activeElement?.blur()")
    page.keyboard.press("r")
    time.sleep(1.0)
    before = positions(page)
    wait_for(lambda: len(positions(page)) > len(before) or (positions(page) != before).any())
    press(page, "Pause")
    shown(page, "Paused: it stands still")
    standing = re.search(r"(\d+) of \d+ runs", page.inner_text("body"))[1]
    time.sleep(5.0)
    assert re.search(r"(\d+) of \d+ runs", page.inner_text("body"))[1] == standing
    cancel_resume_cancel(page)


@pytest.mark.slow
def test_a_diagnosis_is_started_watched_cancelled_and_resumed(page, address, data):
    """On the measured data that are chosen at first, up to the first pours of the base model."""
    opened(page, address, "Diagnose")
    press(page, "Start")
    shown(page, "Running at low priority")
    page.goto("about:blank")
    folder = data / "repose-explorer" / "diagnoses"
    wait_for(lambda: any(len(file.read_text().splitlines()) > 2 for file in folder.rglob("progress.jsonl")), COMPILED)
    opened(page, address, "Diagnose")
    wait_for(lambda: re.search(r"[1-9]\d* of \d+ pours, time left", page.inner_text("body")))
    shown(page, "base model")
    cancel_resume_cancel(page)


def test_the_console_has_nothing_to_complain_about(page):
    assert page.complaints == []
