"""What tests of the whole loop share."""

import pytest

from doe.declared.model import declare
from doe.diagnose import diagnosis
from doe.measurement import load_measurement
from solver.assets import measurement_folder
from tests.doe.diagnose.test_loop import NAMES, FormulaPours


@pytest.fixture
def measurement(monkeypatch):
    """The shipped data set ``trefoil_1``, diagnosed by pours that a formula stands for."""
    monkeypatch.setattr(diagnosis, "ModelPours", FormulaPours)
    found = load_measurement(measurement_folder("trefoil_1"))
    monkeypatch.setattr(FormulaPours, "declared", declare(found, NAMES))
    return found
