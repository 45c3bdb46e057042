"""Points and pours: what is asked for is run once, and two models are never taken for each other."""

import pytest

from doe.diagnose.plan import Point
from doe.diagnose.pours import ModelPours, Pour
from doe.measurement.load import load_measurement
from solver.assets import measurement_folder

THETA = (0.57, 0.57, 0.73)


class NothingStored:
    def find(self, key):
        return None


class Counted(ModelPours):
    """Answers a pour by the number of its job; nothing is simulated."""

    def __init__(self, measurement):
        self.jobs = []
        paths = [parameter.path for parameter in measurement.parameters]
        super().__init__(measurement.conditions, paths, NothingStored(), self.answer)

    def answer(self, queue, room):
        for job in queue:
            self.jobs.append(job)
            yield job, None

    def _keep(self, what, point, condition, job, record):
        return Pour((float(len(self.jobs)),), "measured")


@pytest.fixture
def model():
    return Counted(load_measurement(measurement_folder("trefoil_1")))


def test_two_models_in_one_sequence_are_two_pours(model):
    """The confirmation pours the base model and the winner with the same numbers, so that they begin alike."""
    base = Point("confirm 12", 0, THETA)
    rolling = Point("confirm 12", 0, THETA, (("rolling_resistance", (0.1,)),))
    (one,), (other,) = model.run("confirmation", [base]), model.run("confirmation", [rolling])
    assert one != other
    assert len(model.jobs) == 4
    assert [job.seed for job in model.jobs[:2]] == [job.seed for job in model.jobs[2:]]
    assert model.jobs[2].scene.effect("rolling_resistance").rolling_friction == 0.1


def test_a_point_is_run_once(model):
    point = Point("base", 0, THETA)
    first, again = model.run("base", [point]), model.run("base", [point])
    assert first == again
    assert len(model.jobs) == model.run_now == 2


def test_conditions_and_numbers_have_seeds_of_their_own(model):
    model.run("base", [Point("base", k, THETA) for k in range(3)])
    assert len({job.seed for job in model.jobs}) == 6
