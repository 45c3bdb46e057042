"""Changing, undoing and taking along in headless Chromium: what only a browser can show."""

import re
import zipfile

import numpy as np
import pytest
import trimesh

from explorer.recordings.recording_reader import read_recording
from tests.browser import test_page as shared
from tests.browser.served import served
from tests.browser.test_page import (
    SETTINGS,
    positions,
    room,
    simulated_time,
    slider,
    state,
    still,
    to_its_end,
    unfold,
    wait_for,
)

pytestmark = pytest.mark.browser

page = shared.page
DECLARED = re.compile(r"In the solver: Static friction 0\.54 … 0\.83")
NONE = re.compile(r"In the solver: Static friction 0\s")


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """Address of a page that keeps presets and uploads in a folder of the test."""
    with served(*SETTINGS, data=tmp_path_factory.mktemp("data")) as found:
        yield found


def choose(page, label, option):
    """Choose an option of a list by its label."""
    field = page.locator("label", has_text=re.compile(f"^{label}$")).first.get_attribute("for")
    page.locator(f'[id="{field}"]').click()
    page.get_by_role("option", name=option, exact=True).click()


def press(page, key):
    """Press a key with nothing in focus, as a person who looks at the pile."""
    page.evaluate("document.activeElement?.blur()")
    page.keyboard.press(key)


def test_a_slider_moved_by_key_is_undone_and_made_again(page):
    wait_for(lambda: state(page) == "ended")
    page.get_by_text(DECLARED).wait_for()
    resting = still(page)
    slider(page, "Static friction").scroll_into_view_if_needed()
    to_its_end(page, "Static friction", "Home", NONE)
    # Nothing holds the pile any more: the bodies slide by more than half a seed's thickness.
    wait_for(lambda: np.median(np.linalg.norm(positions(page) - resting, axis=1)) > 3e-3)
    press(page, "z")
    page.get_by_text(DECLARED).wait_for()
    press(page, "y")
    page.get_by_text(NONE).wait_for()
    press(page, "z")
    page.get_by_text(DECLARED).wait_for()


def test_a_preset_acts_and_is_undone(page):
    choose(page, "Preset", "frictionless")
    page.get_by_text(NONE).wait_for()
    page.get_by_text("No contact holds by friction").wait_for()
    press(page, "z")
    page.get_by_text(DECLARED).wait_for()


def test_a_mesh_with_a_hole_is_refused_in_words_and_the_pour_goes_on(page, tmp_path):
    box = trimesh.creation.box((12.0, 10.0, 8.0))
    box.update_faces([k > 1 for k in range(len(box.faces))])
    box.export(tmp_path / "open.stl")
    press(page, "r")
    wait_for(lambda: state(page) == "running")
    unfold(page, "Rig and material")
    unfold(page, "Shape or funnel from a mesh")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Upload a body and pour").click()
    chooser.value.set_files(tmp_path / "open.stl")
    page.locator("#timeline .notice", has_text="open.stl: ").wait_for()
    assert "not watertight" in page.locator("#timeline .notice").inner_text()
    before = simulated_time(page)
    wait_for(lambda: simulated_time(page) > before or state(page) == "ended")


def test_the_scene_file_is_downloaded(page):
    room(page, "Export")
    page.get_by_text("explorer simulate sunflower_extract").wait_for()
    with page.expect_download() as download:
        page.get_by_role("button", name="Scene (TOML)").click()
    assert download.value.suggested_filename == "scene.toml"


def test_record_restart_stop_and_download_gives_the_whole_pour(page, tmp_path):
    def record(button):
        page.get_by_role("button", name=button, exact=True).click()

    wait_for(lambda: state(page) == "ended")
    room(page, "Export")
    record("Start")
    page.locator("#timeline .recording", has_text="REC").wait_for()
    press(page, "r")
    page.locator("#timeline .recording", has_text="pour 2").wait_for()
    wait_for(lambda: state(page) == "ended")
    end = simulated_time(page)
    record("Stop")
    page.get_by_text("2 pours recorded:").wait_for()
    with page.expect_download() as download:
        record("Download")
    # The pile that lay there before the restart is no more than a moment, in a file of its own.
    assert download.value.suggested_filename.endswith(".zip")
    download.value.save_as(tmp_path / "pours.zip")
    with zipfile.ZipFile(tmp_path / "pours.zip") as packed:
        (name,) = (name for name in packed.namelist() if name.endswith("_2.rrd"))
        packed.extract(name, tmp_path)
    found = read_recording(tmp_path / name)
    there = [sum(len(one.at(moment).scale) for one in found.components) for moment in (found.times[0], found.times[-1])]
    assert 0 < there[0] < 0.2 * there[1]
    # The page shows milliseconds.
    assert found.times[-1] == pytest.approx(end, abs=1e-3)
    assert "at rest" in found.outcome


def test_the_console_has_nothing_to_complain_about(page):
    assert page.complaints == []
