"""Data from another engine (LIGGGHTS), with and without an effect that their files do not declare. Slow: half an hour.

When it last ran stands in ``docs/nightly.md``; whole runs with all fifteen effects stand in ``docs/missing_effect.md``.
"""

import pytest

from doe.declared.budget import Budget
from doe.diagnose.diagnosis import run_diagnosis
from doe.measurement.load import load_measurement
from doe.store import Store
from solver import WorkerPool
from solver.assets import measurement_folder

pytestmark = pytest.mark.slow

CANDIDATES = (
    "rolling_resistance",
    "adhesion_sjkr",
    "air_drag",
    "kinetic_friction",
    "density_error",
    "shape_elongation",
    "plate_tilt",
    "twisting",
)
TRUE_ROLLING_FRICTION = 0.2
"""With which trefoil_2 was made; nothing was added to trefoil_1."""


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """Both data sets, one after the other, from one store: the second finds the pours of the first there."""
    store = Store(tmp_path_factory.mktemp("trefoils") / "runs.sqlite")
    found = {}
    with WorkerPool() as pool:
        for name in ("trefoil_1", "trefoil_2"):
            data = load_measurement(measurement_folder(name))
            found[name] = run_diagnosis(data, store, pool.run_queue, CANDIDATES, Budget(), print)
    store.close()
    return found


def test_nothing_is_blamed_on_data_without_an_effect(diagnosed):
    assert diagnosed["trefoil_1"].verdict.kind == "no_missing_effect"


def test_the_undeclared_effect_is_named_and_measured(diagnosed):
    verdict = diagnosed["trefoil_2"].verdict
    assert verdict.kind == "effect:rolling_resistance"
    (amplitude,) = verdict.effects[0].amplitudes
    assert amplitude.low <= TRUE_ROLLING_FRICTION <= amplitude.high


def test_it_predicts_the_held_out_pours_better(diagnosed):
    overall = diagnosed["trefoil_2"].holdout_error[-1]
    assert overall.observable == "overall"
    assert overall.skill_low > 0.5


def test_a_second_data_set_needs_few_new_pours(diagnosed):
    assert diagnosed["trefoil_2"].pours < diagnosed["trefoil_1"].pours
