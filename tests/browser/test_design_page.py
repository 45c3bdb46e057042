"""A design of one's own in headless Chromium: its form, the sheet that is taken along, filled and analysed."""

import pytest

from tests.browser.pages import PATIENCE, new_page
from tests.browser.served import served
from tests.browser.test_page import SETTINGS, no_serious_fault, room, unfold
from tests.browser.test_photographed_target import seen, shot

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def page(browser, tmp_path_factory):
    """The laboratory with the form of a design."""
    with served(*SETTINGS, data=tmp_path_factory.mktemp("data"), patience=30) as address:
        page = new_page(browser, 1280, 1200)
        page.goto(address)
        room(page, "Laboratory")
        unfold(page, "Your own design → runs")
        yield page
        page.close()


def choose(page, label, option):
    page.get_by_label(label, exact=True).filter(visible=True).click()
    page.get_by_role("option", name=option, exact=True).filter(visible=True).click()


def enter(page, label, text):
    box = page.get_by_label(label, exact=True).filter(visible=True)
    box.fill(text)
    box.press("Enter")


def press(page, button):
    page.get_by_role("button", name=button, exact=True).filter(visible=True).first.click()


def test_the_form_asks_for_what_the_design_takes(page):
    upload = page.get_by_role("button", name="Upload: finished runs", exact=True)
    choose(page, "Design", "factorial")
    page.get_by_label("Fraction P", exact=True).filter(visible=True).wait_for()
    upload.wait_for(state="hidden")
    choose(page, "Design", "d-optimal")
    upload.wait_for()
    page.get_by_label("Fraction P", exact=True).wait_for(state="hidden")
    shot(page, "design_form")


def test_a_sheet_is_taken_along_filled_and_analysed(page, tmp_path):
    choose(page, "Design", "central-composite")
    enter(page, "Centre runs", "3")
    choose(page, "Axial points", "face-centred")
    choose(page, "Sheet as", "CSV with 0,5 and semicolons")
    press(page, "Make the sheet")
    seen(page, "explorer design central-composite")
    seen(page, "--centre 3 --alpha face-centred --decimal-comma")
    shot(page, "design_sheet")
    with page.expect_download() as taken:
        press(page, "Download the files")
    lines = taken.value.path().read_text(encoding="utf-8-sig").splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("row;"))
    runs = lines[head + 1 :]
    assert len(runs) == 17
    filled = tmp_path / "filled.csv"
    filled.write_text("\n".join([*lines[: head + 1], *(f"{line}{24 + k % 5},5" for k, line in enumerate(runs))]))
    unfold(page, "Filled sheet → model and optimum")
    with page.expect_file_chooser() as chooser:
        press(page, "Upload: sheet")
    chooser.value.set_files(filled)
    page.wait_for_function("[...document.querySelectorAll('input')].some(one => /^filled-\\w+\\.csv$/.test(one.value))")
    press(page, "Analyse")
    seen(page, "explorer analyse")
    shot(page, "design_analysis")


def test_the_sheet_is_filled_in_on_the_page_and_a_run_is_left_out(page):
    """Follows the test above: the sheet that was analysed is the one in the table."""
    with page.expect_popup() as opened:
        page.get_by_role("link", name="Fill in this sheet in a table").click()
    table = opened.value
    table.set_default_timeout(PATIENCE)
    first = table.locator("[role=row][row-index='0'] [role=gridcell]")
    first.last.wait_for()
    assert table.url.startswith("http://127.0.0.1:")
    write_into(table, first.nth(-2), "31,5")
    write_into(table, first.last, "the cup slipped")
    table.get_by_role("button", name="Save").click()
    table.get_by_role("status").filter(has_text="Saved, and chosen").wait_for()
    shot(table, "design_table")
    no_serious_fault(table)
    table.close()
    page.wait_for_function("[...document.querySelectorAll('input')].some(one => /_filled-\\w+\\.csv$/.test(one.value))")
    press(page, "Analyse")
    seen(page, "is left out, as the sheet says: 'the cup slipped'.")


def test_all_ranges_are_changed_in_one_table(page):
    room(page, "Calibrate")
    unfold(page, "Ranges and target of the next study")
    with page.expect_popup() as opened:
        page.get_by_role("link", name="All ranges in a table").click()
    table = opened.value
    table.set_default_timeout(PATIENCE)
    low = table.get_by_role("row").filter(has_text="X4").get_by_role("gridcell").nth(3)
    low.filter(has_text="40.1").wait_for()
    write_into(table, low, "30,5")
    table.get_by_role("button", name="Save").click()
    table.get_by_role("status").filter(has_text="Saved").wait_for()
    shot(table, "ranges_table")
    no_serious_fault(table)
    table.close()
    page.get_by_role("row").filter(has_text="X4 low").filter(has_text="30.5 MPa").wait_for()


def write_into(table, cell, text):
    cell.dblclick()
    table.keyboard.type(text)
    table.keyboard.press("Enter")
    cell.filter(has_text=text).wait_for()
