"""A recording on the page in headless Chromium: scrubbed by keyboard, played, stepped and looked at by keys."""

import re

import pytest

from explorer.recordings.pour_log import PourLog
from explorer.scene.file import load_scene
from tests.browser.pages import FLAGS, new_page
from tests.browser.served import served
from tests.browser.test_look import colours, press
from tests.browser.test_page import positions, slider, wait_for
from tests.explorer.recordings.test_pour_log import poses

pytestmark = pytest.mark.browser

FRAMES = 60
"""20 ms apart; body 0 rises by a millimetre per frame, body 1 stands beside it."""
BODIES = 2


def state_at(k):
    made = poses(*[0] * BODIES)
    made.position[0] = (0.0, 0.0, 1e-3 * k)
    return made


@pytest.fixture(scope="module")
def page(chromium, tmp_path_factory):
    from playwright.sync_api import sync_playwright

    path = tmp_path_factory.mktemp("replay") / "rise.rrd"
    with PourLog(path, load_scene("funnel"), seed=1) as log:
        for k in range(FRAMES):
            log.frame(0.02 * k, state_at(k), {"angle_of_repose_deg": 20.0 + 0.1 * k})
    with served("--replay", path) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = new_page(browser)
        page.goto(address)
        page.get_by_text("rise.rrd").first.wait_for()
        yield page
        browser.close()


AXES = "() => Object.values(window.__viserTestpoints.uplots).map(one => one.chart.axes.map(axis => axis._found[1]))"
"""Pixels between two numbers of each axis of each chart; 0: the axis was never laid out."""


def height(page):
    """Of body 0 [mm]: the number of the frame that is drawn."""
    return 1e3 * positions(page)[0, 2]


def at_rest(page):
    """Played to its end."""
    wait_for(lambda: page.get_by_text(re.compile(r"^paused ·")).count() > 0)


def test_the_slider_scrubs_through_the_recording(page):
    at_rest(page)
    assert height(page) == pytest.approx(FRAMES - 1, abs=1e-3)
    thumb = slider(page, "Time [s]")
    thumb.focus()
    page.keyboard.press("Home")
    wait_for(lambda: height(page) == pytest.approx(0.0, abs=1e-3))
    page.keyboard.press("End")
    wait_for(lambda: height(page) == pytest.approx(FRAMES - 1, abs=1e-3))


def test_the_chart_has_numbers_at_its_axes(page):
    at_rest(page)
    (spaces,) = page.evaluate(AXES)
    assert len(spaces) == 2
    assert min(spaces) > 0


def test_keys_step_and_play(page):
    page.evaluate("document.activeElement?.blur()")
    page.keyboard.press("r")
    wait_for(lambda: height(page) == pytest.approx(0.0, abs=1e-3))
    page.keyboard.press("ArrowRight")
    wait_for(lambda: height(page) == pytest.approx(1.0, abs=1e-3))
    page.keyboard.press("ArrowLeft")
    wait_for(lambda: height(page) == pytest.approx(0.0, abs=1e-3))
    page.keyboard.press("Space")
    wait_for(lambda: height(page) == pytest.approx(FRAMES - 1, abs=1e-3))


SEEN = """() => Object.entries(window.__viserSceneTree.getState())
    .filter(([name, node]) => /^.bodies.\\d+$/.test(name) && node?.message?.props?.batched_scales)
    .flatMap(([name, node]) => Array.from(node.message.props.batched_scales)).filter(scale => scale > 0).length"""
"""Bodies that are drawn."""


def test_keys_colour_the_bodies_and_cut_them_away(page):
    at_rest(page)
    page.get_by_role("tab", name="Look").click()
    plain = colours(page)
    press(page, "c")
    # One rises by a millimetre in 20 ms, the other stands.
    page.get_by_text("speed [m/s]: mean from the frame before to the one after").wait_for()
    wait_for(lambda: (colours(page) != plain).any())
    press(page, "c")
    page.get_by_text("residence time [s]").wait_for()
    press(page, "c")
    wait_for(lambda: (colours(page) == plain).all())
    assert page.evaluate(SEEN) == BODIES
    for _ in range(2):  # x below, x above
        press(page, "x")
    wait_for(lambda: page.evaluate(SEEN) == 1)


TEXTS = """() => {
  const linear = c => { c /= 255; return c <= 0.04045 ? c / 12.92 : Math.pow((c + 0.055) / 1.055, 2.4); };
  const numbers = s => (s.match(/[\\d.]+/g) || [0, 0, 0, 0]).map(Number);
  const parsed = s => numbers(s).length > 3 ? numbers(s) : [...numbers(s), 1];
  const over = (c, below) => [0, 1, 2].map(i => c[i] * c[3] + below[i] * (1 - c[3]));
  const light = c => 0.2126 * linear(c[0]) + 0.7152 * linear(c[1]) + 0.0722 * linear(c[2]);
  const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.textContent.trim(), holder = walker.currentNode.parentElement;
    if (!text || ["SCRIPT", "STYLE"].includes(holder.tagName) || !holder.getClientRects().length) continue;
    let opacity = 1, ground = [];
    for (let e = holder; e; e = e.parentElement) {
      opacity *= Number(getComputedStyle(e).opacity);
      if (!ground.length || ground.at(-1)[3] < 1) ground.push(parsed(getComputedStyle(e).backgroundColor));
    }
    const below = ground.reverse().reduce((under, c) => over(c, under), [255, 255, 255]);
    const style = getComputedStyle(holder);
    const colour = parsed(style.color), drawn = light(over([...colour.slice(0, 3), colour[3] * opacity], below));
    const [dark, bright] = [drawn, light(below)].sort((a, b) => a - b);
    found.push([text, (bright + 0.05) / (dark + 0.05), parseFloat(style.fontSize), style.letterSpacing]);
  }
  return found;
}"""
"""Each text with its contrast (WCAG 2.2), size [px] and spacing; texts in charts are pixels, and not among them."""


def test_texts_are_read_on_a_dark_and_on_a_light_page(page):
    for _ in range(2):
        for name in ("Replay", "Look"):
            page.get_by_role("tab", name=name).click()
            page.wait_for_timeout(500)
            found = page.evaluate(TEXTS)
            assert len(found) > 10
            assert [one for one in found if one[1] < 4.5] == []
            assert {round(size) for _, _, size, _ in found} <= {13, 15, 28}
            assert {spacing for *_, spacing in found} == {"normal"}
        page.get_by_text("Dark page").click()
