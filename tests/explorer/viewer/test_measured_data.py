"""The panel of measured data: what it refuses by itself, in the words of the page, and which files it is done with."""

import threading
from types import SimpleNamespace

import pytest

from explorer.files.uploads import kept_measurements
from explorer.scene.source import material_source
from explorer.viewer.actions import Actions
from explorer.viewer.laboratory import measured_data_panel
from explorer.viewer.laboratory.measured_data_panel import MeasuredDataPanel
from tests.explorer.viewer.page_session import PageSession, finished, page_context
from tests.explorer.viewer.person import Person


@pytest.fixture
def desk(server, tmp_path):
    """A person at the panel, who waits for what is read, and one who does not."""
    actions = Actions()
    page = page_context(server, PageSession(material_source("sunflower_extract")), actions.post, tmp_path)
    with server.gui.add_folder("measured data") as place:
        MeasuredDataPanel(page)

    def wait():
        return finished(actions, page.bench_work)

    return SimpleNamespace(
        patient=Person(place, wait), hasty=Person(place, actions.carry_out), wait=wait, uploads=page.uploads
    )


def test_the_name_of_a_shipped_data_set_is_refused(desk):
    desk.patient.enter("Data set", "trefoil_2")
    desk.patient.enter("Angles [°]", "24, 25")
    assert desk.patient.press("Save the data") == "Data set: trefoil_2 is shipped with the program; choose another name"
    assert kept_measurements(desk.uploads) == {}


def test_a_file_that_is_added_while_others_are_read_is_kept_for_the_next_condition(desk, monkeypatch):
    read, real = threading.Event(), measured_data_panel.measured_data_result
    monkeypatch.setattr(measured_data_panel, "measured_data_result", lambda *asked: read.wait(60.0) and real(*asked))
    person = desk.hasty
    person.enter("Angles [°]", "24, 25, 26")
    person.press("Save the data")
    assert person.upload("Add a photograph", "next.jpg", b"a picture") == ""
    read.set()
    assert desk.wait() == ""
    assert set(kept_measurements(desk.uploads)) == {"my_data"}
    assert "photographs: next-" in person.text


def test_a_refusal_names_the_fields_of_the_page(desk):
    person = desk.patient
    person.enter("Angles [°]", "24, 25")
    person.enter("Lag of the balance [s]", "0.1")
    assert person.press("Save the data") == "Flow began at, Lag of the balance: allowed only with Add a balance's curve"
