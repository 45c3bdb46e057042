"""The page in headless Chromium: real mouse and keys; what moved is read from the page's own scene.

`window.__viserSceneTree` is a hook of viser's client for its own tests. viser is pinned; should the hook vanish, this
test fails at its first use.
"""

import os
import re
import time

import numpy as np
import pytest

from explorer.viewer.panel import TABS
from explorer.viewer.pour.readout import PHASE_WORDS
from tests.browser.pages import FLAGS, PATIENCE, new_page
from tests.browser.served import served
from tests.explorer.background.waiting import wait_for

pytestmark = pytest.mark.browser

# A wide outlet close to the plate: a pour that does not jam, and a pile two bodies high.
SMALL_POUR = (
    "body.spheres=coarse",
    "rig.mass=20g",
    "insertion.rate=40g/s",
    "rig.outlet_diameter=50mm",
    "rig.outlet_height=40mm",
)
SETTINGS = tuple(part for one in SMALL_POUR for part in ("--set", one))
POSITIONS = """() => Object.entries(window.__viserSceneTree.getState())
    .filter(([name, node]) => /^.bodies.\\d+$/.test(name) && node?.message?.props?.batched_positions)
    .sort().flatMap(([name, node]) => Array.from(node.message.props.batched_positions))"""
MIDDLE = {"x": 400, "y": 400, "width": 240, "height": 240}
"""Of the scene [px]."""
SERIOUS = ("serious", "critical")
"""Impacts of what axe-core finds."""


@pytest.fixture(scope="module")
def address():
    """Address of the page of ``explorer serve``, started as a user does."""
    with served(*SETTINGS) as found:
        yield found


@pytest.fixture(scope="module")
def page(address, chromium):
    """The opened page; what its console complains about is collected in ``page.complaints``."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        page = new_page(browser)
        page.goto(address)
        room(page, "Set-up")
        page.get_by_text("Static friction").filter(visible=True).first.wait_for()
        yield page
        if shot := os.environ.get("REPOSE_SCREENSHOT"):
            page.screenshot(path=shot)
        browser.close()


def room(page, name):
    """Open a tab as the state line does."""
    page.wait_for_function("window.explorer && document.querySelectorAll('#root [role=tab]').length > 5")
    page.evaluate(f"window.explorer.openRoom('{name}')")


def unfold(page, title):
    """Unfold a section of a room.

    By key: a click of the mouse is lost where what stands above the head moves between press and release.
    """
    page.get_by_role("button", name=title, exact=True, expanded=False).filter(visible=True).first.press("Enter")
    page.get_by_role("button", name=title, exact=True, expanded=True).filter(visible=True).first.wait_for()


def positions(page):
    """Positions of all bodies as the page has them [m], shape (n, 3)."""
    return np.array(page.evaluate(POSITIONS)).reshape(-1, 3)


def still(page):
    """Positions once they stand still: frames that were on their way have come."""
    reads = [positions(page)]

    def same():
        time.sleep(1.0)
        reads.append(positions(page))
        return np.array_equal(*reads[-2:])

    wait_for(same)
    return reads[-1]


def simulated_time(page):
    """The solver's time as the timeline shows it [s]."""
    return float(page.locator("#timeline .time").inner_text().split()[0])


def state(page):
    """What the pour is doing; "running" whatever its phase."""
    said = page.locator("#timeline .chip").inner_text().split(" · ")[0]
    return "running" if said in PHASE_WORDS.values() else said


def slider(page, label):
    """The thumb of a slider: its own label is empty, so the way leads over the ``for`` of the label beside it."""
    field = page.locator("label", has_text=label).first.get_attribute("for")
    return page.locator(f'[id="{field}"]').get_by_role("slider")


def to_its_end(page, label, key, said):
    """Press Home or End on a slider until ``said`` stands; a key that meets controls being made anew is lost."""
    from playwright.sync_api import TimeoutError as NotSeen

    def seen():
        slider(page, label).focus()
        page.keyboard.press(key)
        try:
            page.get_by_text(said).wait_for(timeout=PATIENCE / 8)
        except NotSeen:
            return False
        return True

    wait_for(seen)


def test_friction_taken_away_by_mouse_lets_a_resting_pile_flow(page):
    wait_for(lambda: state(page) == "ended")
    assert "at rest" in page.locator("#timeline .chip").inner_text()
    resting = still(page)
    assert resting[:, 2].max() > 0.01

    thumb = slider(page, "Static friction")
    thumb.scroll_into_view_if_needed()
    box = thumb.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 400, y, steps=5)
    page.mouse.up()

    # The line below comes from the solver's scene, not from the slider.
    page.get_by_text(re.compile(r"In the solver: Static friction 0\s")).wait_for()
    # Without friction every body slides: most of them further than a seed is thick (6 mm), and the pile gets flatter.
    wait_for(lambda: np.median(np.linalg.norm(positions(page) - resting, axis=1)) > 6e-3)
    assert positions(page)[:, 2].mean() < resting[:, 2].mean()


def test_space_pauses_and_plays_and_the_arrow_steps(page):
    page.keyboard.press("Escape")
    page.evaluate("document.activeElement?.blur()")
    wait_for(lambda: state(page) == "running")
    page.keyboard.press("Space")
    wait_for(lambda: state(page) == "paused")
    standing, paused_at = still(page), simulated_time(page)
    time.sleep(1.0)
    np.testing.assert_array_equal(positions(page), standing)
    assert simulated_time(page) == paused_at

    # 10 ms, which a busy machine simulates in parts and shows part by part; the page shows milliseconds.
    page.keyboard.press("ArrowRight")
    wait_for(lambda: simulated_time(page) - paused_at >= 0.009)
    time.sleep(1.0)
    assert 0.009 <= simulated_time(page) - paused_at <= 0.011
    assert state(page) == "paused"

    page.keyboard.press("Space")
    wait_for(lambda: state(page) == "running")
    wait_for(lambda: simulated_time(page) > paused_at + 0.05)
    wait_for(lambda: (positions(page) != standing).any())


def settled(page):
    """The middle of the picture once it no longer changes: what was on its way before a pause has been drawn."""
    seen = []

    def twice():
        seen.append(page.screenshot(clip=MIDDLE))
        return len(seen) > 2 and seen[-1] == seen[-2] == seen[-3]

    wait_for(twice)
    return seen[-1]


def test_an_arrow_on_a_slider_moves_the_slider_only(page):
    page.keyboard.press("Space")
    wait_for(lambda: state(page) == "paused")
    to_its_end(page, "Static friction", "Home", re.compile(r"In the solver: Static friction 0\s"))
    seen, paused_at = settled(page), simulated_time(page)
    slider(page, "Static friction").focus()
    page.keyboard.press("ArrowRight")
    page.get_by_text(re.compile(r"In the solver: Static friction 0\.0\d")).wait_for()
    page.keyboard.press("ArrowRight", delay=500)  # held down it would turn the camera
    page.keyboard.press("Home")
    page.get_by_text(re.compile(r"In the solver: Static friction 0\s")).wait_for()
    assert settled(page) == seen
    assert (state(page), simulated_time(page)) == ("paused", paused_at)
    page.evaluate("document.activeElement?.blur()")
    page.keyboard.press("Space")
    wait_for(lambda: state(page) == "running")


def test_the_r_key_pours_anew_with_the_parameters_in_force(page):
    before = simulated_time(page)
    page.keyboard.press("r")
    wait_for(lambda: simulated_time(page) < before)
    page.get_by_text(re.compile(r"In the solver: Static friction 0\s")).wait_for()


def test_a_slider_moved_by_keyboard_in_one_browser_is_seen_in_another(page, address):
    second = new_page(page.context.browser)
    second.goto(address)
    # The notice stays for seconds only.
    second.get_by_text(re.compile(r"You are browser \d+")).wait_for()
    room(second, "Set-up")
    second.get_by_text("Static friction").filter(visible=True).first.wait_for()
    top = re.compile(r"In the solver: Static friction [1-9]")
    to_its_end(second, "Static friction", "End", top)
    room(page, "Set-up")
    page.get_by_text(top).wait_for()
    # On the timeline's mark, not in the line of the newest event: the pile may have come to rest meanwhile.
    page.locator("#timeline .event[title*='· browser ']").first.wait_for(state="attached")
    second.close()
    # One of them leaves; the pour and the other go on.
    before = simulated_time(page)
    page.evaluate("document.activeElement?.blur()")
    if state(page) == "running":
        wait_for(lambda: simulated_time(page) > before)
    assert state(page) in ("running", "ended")


def test_a_pour_in_a_link_is_offered_in_words_and_poured_by_a_click_only(page, address):
    text = "pour=sunflower_extract&set=body.spheres%3Dcoarse&set=rig.mass%3D10g&seed=4&time=0.01"
    told = page.locator("#timeline .event[title*='seed 4']")
    second = new_page(page.context.browser)
    second.goto(f"{address}#{text}")
    offer = second.get_by_text("This link holds another pour: ")
    offer.wait_for()
    assert offer.inner_text().endswith("sunflower_extract, body.spheres=coarse, rig.mass=10g, seed 4, up to 0.010 s")
    room(second, "Set-up")
    second.get_by_text("Static friction").filter(visible=True).first.wait_for()
    assert told.count() == 0
    # A press is lost where the page, still being built, takes the focus in between: then it is pressed again. The offer
    # says whether it was taken: a button has no role, and counts as invisible, while something lies over the page.
    button = second.get_by_role("button", name="Pour it")
    wait_for(lambda: offer.is_hidden() or button.press("Enter"))
    told.wait_for(state="attached")
    wait_for(lambda: state(page) == "paused" and simulated_time(page) >= 0.01)
    assert offer.is_hidden()
    assert "#" not in second.url
    second.close()
    page.keyboard.press("Space")


@pytest.mark.slow
def test_open_rooms_are_open_again_when_the_page_is_loaded_again(page, address):
    second = new_page(page.context.browser)
    second.goto(address)
    opened = "() => [...document.querySelectorAll('#root [role=tab][aria-selected=true]')].map(one => one.textContent)"
    for name in ("Laboratory", "Look"):
        room(second, name)
        second.wait_for_function(f"name => ({opened})().includes(name)", arg=name)
    second.reload()
    second.wait_for_function(f"() => ({opened})().join() === 'Laboratory,Look'")
    second.close()


@pytest.mark.slow
def test_a_room_that_is_opened_while_the_page_loads_is_not_closed_by_those_of_the_page_before(page, address):
    second = new_page(page.context.browser)
    # Looks for what is to be opened again come twenty times as slowly, as on a busy machine, and are counted.
    second.add_init_script("""
        try { sessionStorage.setItem('explorer-rooms', '["Calibrate"]') } catch { /* an empty page has none */ }
        const soon = window.setTimeout.bind(window);
        window.looks = 0;
        window.setTimeout = (act, wait, ...rest) =>
            wait === 250 ? soon(() => { act(); window.looks += 1; }, 20 * wait) : soon(act, wait, ...rest);
    """)
    second.goto(address)
    room(second, "Diagnose")
    looks = second.evaluate("window.looks")
    second.wait_for_function("before => window.looks > before", arg=looks)
    second.get_by_role("tab", name="Diagnose", selected=True).wait_for()
    second.close()


def test_rooms_are_reached_in_the_window_of_a_phone(page, address):
    phone = new_page(page.context.browser, 390, 844, has_touch=True)
    phone.goto(address)
    phone.get_by_role("tab", name="Controls").wait_for()
    for name in ("Calibrate", "Controls", "Reports"):
        tab = phone.get_by_role("tab", name=name, selected=True)
        phone.evaluate(f"window.explorer.openRoom('{name}')")
        tab.wait_for()
        tab.scroll_into_view_if_needed()
    phone.close()


@pytest.mark.parametrize("tab", [tab.name for tab in TABS])
def test_axe_finds_no_serious_fault_in_a_room(page, tab):
    room(page, tab)
    no_serious_fault(page)


def no_serious_fault(page):
    """Ask axe-core."""
    from axe_playwright_python.sync_playwright import Axe

    def faults():
        found = Axe().run(page, options={"resultTypes": ["violations"]}).response["violations"]
        return [(one["id"], node["html"]) for one in found if one["impact"] in SERIOUS for node in one["nodes"]]

    # Controls that were made a moment ago get their names a moment later.
    found = []

    def clean():
        found[:] = faults()
        return not found

    try:
        wait_for(clean)
    except AssertionError:
        assert found == []


def test_a_section_tells_whether_it_is_open(page):
    room(page, "Set-up")
    head = page.get_by_role("button", name="Material (acts now)").filter(visible=True).first
    before = head.get_attribute("aria-expanded")
    head.focus()
    page.keyboard.press("Enter")
    wait_for(lambda: head.get_attribute("aria-expanded") not in (before, None))
    page.keyboard.press("Enter")
    wait_for(lambda: head.get_attribute("aria-expanded") == before)


def test_the_console_has_nothing_to_complain_about(page):
    assert page.complaints == []
