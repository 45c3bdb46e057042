"""A finished diagnosis in headless Chromium: the real answer of `examples/trefoil_2`, and its piles side by side."""

from contextlib import contextmanager

import pytest

from explorer import load_diagnosis
from tests.browser.pages import new_page
from tests.browser.served import EXAMPLE, diagnosed, served
from tests.browser.test_page import SETTINGS, room, wait_for

pytestmark = pytest.mark.browser

NODES = "() => Object.keys(window.__viserSceneTree.getState())"


@contextmanager
def diagnose_room(browser, data):
    """The room *Diagnose* of a person who has ``data``."""
    with served("--store", data / "runs.sqlite", *SETTINGS, data=data, patience=30) as address:
        page = new_page(browser, 1280, 1400)
        page.goto(address)
        room(page, "Diagnose")
        yield page
        page.close()


@pytest.fixture(scope="module")
def page(browser, tmp_path_factory):
    """That of a person who has the finished diagnosis."""
    data = tmp_path_factory.mktemp("data")
    diagnosed(data)
    with diagnose_room(browser, data) as page:
        yield page


def test_the_board_names_the_effect_with_its_charts(page):
    board = page.frame_locator('iframe[title="Diagnosis"]')
    board.locator(".banner strong").wait_for()
    assert "ROLLING RESISTANCE" in board.locator(".banner").inner_text().upper()
    # A chart is drawn once it comes into sight.
    board.locator("figure").first.scroll_into_view_if_needed()
    board.locator("figure .js-plotly-plot").first.wait_for()
    probability = load_diagnosis(EXAMPLE).effects[0].probability
    assert f"with probability {100 * probability:.1f} %" in board.locator("body").inner_text()
    page.locator("#state-line").get_by_text("Trefoil pour 2").wait_for()


def test_the_measured_pile_and_both_models_stand_side_by_side(page):
    before = set(page.evaluate(NODES))
    assert not any(name.startswith(("/measured", "/second/")) for name in before)
    page.get_by_role("button", name="Show side by side", exact=True).filter(visible=True).first.click()
    wait_for(lambda: "/measured" in page.evaluate(NODES))
    wait_for(lambda: any(name.startswith("/second/") for name in page.evaluate(NODES)))
    # A name above each of the three, and the panel made room.
    wait_for(lambda: len([name for name in page.evaluate(NODES) if name.startswith("/names/")]) == 3)
    page.get_by_role("button", name="Show side by side", exact=True).filter(visible=True).first.wait_for(state="hidden")
