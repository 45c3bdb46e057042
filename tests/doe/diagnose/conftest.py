"""What tests of the whole loop share."""

import pytest

from doe.declared.model import declare
from doe.diagnose import diagnosis
from doe.measurement import load_measurement
from solver.assets import measurement_folder
from tests.doe.diagnose.test_loop import NAMES, FormulaPours


@pytest.fixture(scope="session")
def trefoil_1():
    """The shipped data set, whose piles take a second to read."""
    return load_measurement(measurement_folder("trefoil_1"))


@pytest.fixture
def measurement(monkeypatch, trefoil_1):
    """``trefoil_1``, diagnosed by pours that a formula stands for."""
    monkeypatch.setattr(diagnosis, "ModelPours", FormulaPours)
    monkeypatch.setattr(FormulaPours, "declared", declare(trefoil_1, NAMES))
    return trefoil_1
