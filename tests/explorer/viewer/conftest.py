"""What the tests of the panel of studies share."""

import pytest

from tests.explorer import reported_studies
from tests.explorer.viewer.study_panel_at_hand import PanelAtHand


@pytest.fixture(scope="module")
def result():
    """A finished study with a planted truth."""
    return reported_studies.result_of_case("planted")


@pytest.fixture
def table(server, tmp_path):
    """The panel with a person at its controls."""
    return PanelAtHand(server, data=tmp_path / "data")
