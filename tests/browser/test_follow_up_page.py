"""An answer that is left open in headless Chromium: its follow-up is filled in, in a table, and answered with."""

import json

import pytest

from doe.measurement.load import load_measurement
from explorer.diagnosis.follow_up_tables import read_follow_up
from explorer.diagnosis.next_folder import write_next
from solver.assets import measurement_folder
from tests.browser.pages import PATIENCE
from tests.browser.test_design_page import press, write_into
from tests.browser.test_diagnosis_page import diagnose_room
from tests.browser.test_page import no_serious_fault, wait_for
from tests.browser.test_photographed_target import shot
from tests.explorer.diagnosed import result_of_case, typed

pytestmark = pytest.mark.browser

SOURCE = measurement_folder("trefoil_2")


@pytest.fixture(scope="module")
def follow_up(tmp_path_factory):
    """The follow-up of an ambiguous answer among the user's data, not filled in."""
    folder = tmp_path_factory.mktemp("data") / "repose-explorer" / "diagnoses" / "trefoil_2-20260101-000000"
    folder.mkdir(parents=True)
    content = result_of_case("ambiguous")
    content["data"]["folder"] = str(SOURCE)
    content["order"]["budget"] = None
    write_next(folder / "next", SOURCE, load_measurement(SOURCE), typed(content).next_experiment[0])
    (folder / "diagnosis.json").write_text(json.dumps(content))
    return folder / "next"


@pytest.fixture(scope="module")
def page(browser, follow_up):
    """The room *Diagnose* of a person who has that answer."""
    with diagnose_room(browser, follow_up.parents[3]) as page:
        yield page


def test_a_follow_up_is_filled_in_in_a_table_and_answered_with(page, follow_up):
    with page.expect_popup() as opened:
        page.get_by_role("link", name="Fill it in, in a table").click()
    table = opened.value
    table.set_default_timeout(PATIENCE)
    row = table.get_by_role("row").filter(has=table.get_by_role("gridcell", name="apex height", exact=True))
    number = row.get_attribute("row-index")
    cells = table.locator(f"[role=row][row-index='{number}'] [role=gridcell][col-id^='pour_']")
    for k, height in enumerate(("24,7mm", "0.025")):
        write_into(table, cells.nth(k), height)
    table.get_by_role("button", name="Save").click()
    table.get_by_role("status").filter(has_text="Saved: 2 of").wait_for()
    shot(table, "follow_up_table")
    no_serious_fault(table)
    table.close()
    apex = next(one for one in read_follow_up(follow_up).numbers if one.observable == "apex_height_m")
    assert apex.values[:3] == ("0.0247", "0.025", "")
    page.get_by_text("Filled in: 2 of").wait_for()
    shot(page, "follow_up")
    press(page, "Answer with the follow-up")
    page.get_by_text("Running at low priority").filter(visible=True).first.wait_for()
    wait_for(lambda: any(follow_up.parents[1].glob("trefoil_2-followed-*")))
    press(page, "Cancel")
    page.get_by_text("Cancelled.").filter(visible=True).first.wait_for()
