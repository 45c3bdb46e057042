"""A grain of one's own in headless Chromium: from the start dialogue to its form, poured; and a file that is sent."""

import pytest

from explorer.scene.text import material_toml
from solver import load_material, with_values
from tests.browser.pages import new_page
from tests.browser.served import served
from tests.browser.test_page import SETTINGS, room, unfold
from tests.browser.test_photographed_target import seen, shot

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def page(browser, tmp_path_factory):
    """A first visit."""
    with served(*SETTINGS, data=tmp_path_factory.mktemp("data"), patience=30) as address:
        page = new_page(browser, 1280, 800, begun=False)
        page.goto(address)
        yield page
        page.close()


def test_the_first_card_leads_to_the_form_and_what_stands_in_it_is_poured(page):
    page.wait_for_function("window.explorer && document.querySelectorAll('#root [role=tab]').length > 5")
    page.get_by_role("button", name="I have a grain and a photograph").click()
    pour = page.get_by_role("button", name="Pour this grain", exact=True)
    pour.wait_for()
    # The photograph beside it.
    page.get_by_role("button", name="Read the angle", exact=True).filter(visible=True).wait_for()
    page.get_by_label("Length [mm]").filter(visible=True).fill("9")
    page.get_by_label("Length [mm]").filter(visible=True).press("Enter")
    page.get_by_label("Name of the grain").fill("lentil")
    page.get_by_label("Name of the grain").press("Enter")
    shot(page, "grain")
    pour.scroll_into_view_if_needed()
    shot(page, "grain_buttons")
    pour.click()
    # The material that is poured, told by its file.
    page.wait_for_function("[...document.querySelectorAll('input')].some(one => /lentil-\\w+\\.toml$/.test(one.value))")
    page.get_by_role("button", name="Keep as a file", exact=True).click()
    seen(page, "opens it with a study of its own")
    shot(page, "grain_kept")


def test_a_material_file_of_the_browser_is_poured(page, tmp_path):
    own = with_values(load_material("nine_sphere_seed"), {"rig.mass": "5g"})
    (tmp_path / "from home.toml").write_text(material_toml(own))
    page.keyboard.press("Escape")  # the start dialogue, where it is still open
    room(page, "Set-up")
    unfold(page, "Rig and material")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Upload a material and pour", exact=True).click()
    chooser.value.set_files(tmp_path / "from home.toml")
    page.wait_for_function(
        "[...document.querySelectorAll('input')].some(one => /from_home-\\w+\\.toml$/.test(one.value))"
    )
    shot(page, "material_sent")
