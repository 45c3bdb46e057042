"""Going back, colours, force chains and a body under inspection in headless Chromium: real mouse and keys."""

import time

import numpy as np
import pytest

from tests.browser.test_page import address, page, positions, room, simulated_time, state, still, wait_for  # noqa: F401

pytestmark = pytest.mark.browser

COLOURS = """() => Object.entries(window.__viserSceneTree.getState())
    .filter(([name, node]) => /^.bodies.\\d+$/.test(name) && node?.message?.props?.batched_colors)
    .sort().flatMap(([name, node]) => Array.from(node.message.props.batched_colors))"""
FORCES = """() => Object.entries(window.__viserSceneTree.getState())
    .filter(([name, node]) => name === "/forces/core" && node?.message?.props?.batched_scales)
    .flatMap(([name, node]) => Array.from(node.message.props.batched_scales)).filter(scale => scale > 0).length"""


def press(page, key):  # noqa: F811
    """A key outside every input."""
    page.evaluate("document.activeElement?.blur()")
    page.keyboard.press(key)


def colours(page):  # noqa: F811
    """Colours of all bodies as the page has them, shape (n, 3)."""
    return np.array(page.evaluate(COLOURS)).reshape(-1, 3)


def paused_in_a_pour(page):  # noqa: F811
    """Pause after 0.3 s of simulated time or more, before the pour has ended; poured anew where that comes too late."""
    for _ in range(5):
        wait_for(lambda: state(page) == "ended" or (state(page) == "running" and simulated_time(page) > 0.3))
        if state(page) == "running":
            press(page, "Space")
            wait_for(lambda: state(page) in ("paused", "ended"))
        if state(page) == "paused":
            return
        press(page, "r")
        wait_for(lambda: state(page) != "ended")
    raise AssertionError("every pour had ended before it could be paused")


def test_the_left_arrow_leads_back_to_the_same_positions(page):  # noqa: F811
    paused_in_a_pour(page)
    before, paused_at = still(page), simulated_time(page)
    press(page, "ArrowRight")
    # 10 ms, which a busy machine simulates in parts and shows part by part.
    wait_for(lambda: simulated_time(page) - paused_at >= 0.009)
    wait_for(lambda: (positions(page) != before).any())
    still(page)
    press(page, "ArrowLeft")
    wait_for(lambda: simulated_time(page) == paused_at)
    wait_for(lambda: np.array_equal(positions(page), before))
    press(page, "Space")
    wait_for(lambda: simulated_time(page) > paused_at + 0.05)


def test_a_pile_at_rest_says_so_in_a_word(page):  # noqa: F811
    wait_for(lambda: state(page) == "ended")
    assert "at rest" in page.locator("#timeline .chip").inner_text()


def test_keys_colour_the_bodies_and_draw_the_forces(page):  # noqa: F811
    room(page, "Look")
    plain = colours(page)
    for _ in range(2):  # speed, then contact force: a pile at rest has no speeds that differ
        press(page, "c")
    page.get_by_text("sum of the normal forces on a body").wait_for()
    wait_for(lambda: (colours(page) != plain).any())
    press(page, "k")
    page.get_by_text("Lines: normal force from").wait_for()
    wait_for(lambda: page.evaluate(FORCES) > 0)


def test_a_click_on_the_pile_tells_of_a_body_and_escape_lets_it_go(page):  # noqa: F811
    press(page, "4")  # from above, the axis in the middle of the picture
    time.sleep(2.0)
    told = page.get_by_text("Coordination number", exact=True)  # the chooser has it in small letters
    box = page.locator("canvas").first.bounding_box()
    # The panel covers a part of the canvas that viser does not tell; a pile is wider than these steps.
    for x in np.arange(box["x"] + 200.0, box["x"] + box["width"] - 400.0, 12.0):
        page.mouse.click(x, box["y"] + box["height"] / 2)
        time.sleep(0.5)
        if told.count():
            break
    told.wait_for()
    press(page, "Escape")
    page.get_by_text("Click a body, or press N").wait_for()


def test_keys_go_from_body_to_body(page):  # noqa: F811
    kind = page.locator(".body .line", has_text="Kind")
    press(page, "n")
    kind.wait_for()
    first = kind.inner_text()
    press(page, "n")
    wait_for(lambda: kind.inner_text() != first)
    press(page, "p")
    wait_for(lambda: kind.inner_text() == first)
    press(page, "Escape")
    page.get_by_text("Click a body, or press N").wait_for()
