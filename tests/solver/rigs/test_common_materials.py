"""The shipped materials as a new user pours them first: the outcome has a name, and round grains too form a heap."""

import pytest

from solver.assets import shipped_assets
from solver.pours.record import Outcome
from solver.pours.run import Job, run_pours
from solver.rigs.lipped_plate import LippedPlate
from solver.scenes.material_file import load_material
from solver.scenes.scene import with_values

pytestmark = [pytest.mark.usefixtures("taichi"), pytest.mark.slow]

SCENES = {name: load_material(name) for name in shipped_assets("materials")}
COMMON = {name: scene for name, scene in SCENES.items() if isinstance(scene.rig, LippedPlate)}


def test_twelve_grains_of_each_come_to_a_named_outcome():
    """Few grains are no heap; what has been poured is there, and no number is broken."""
    few = {
        name: with_values(scene, {"rig.mass": 12.0 * scene.bodies[0].mass, "numerics.max_time": 3.0})
        for name, scene in COMMON.items()
    }
    for index, record in run_pours([Job(scene, 1) for scene in few.values()], threads=2):
        name = list(few)[index]
        assert record.outcome in (Outcome.NO_HEAP, Outcome.TIME_LIMIT), (name, record.message)
        assert record.trace.entered_mass[-1] == pytest.approx(record.poured_mass), name


@pytest.mark.parametrize("name", COMMON)
def test_the_first_pour_of_a_common_material_forms_a_heap(name):
    """At rest, at least 2.5 grains high (``observables/heap.py``), and nothing hangs or is lost."""
    ((_, record),) = run_pours([Job(COMMON[name], 1)], threads=2)
    assert record.outcome == Outcome.AT_REST, record.message
