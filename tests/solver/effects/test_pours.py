"""Whole pours with effects: interrupted and gone on with, switched on while they run, closed in energy."""

import numpy as np
import pytest

from solver.effects.plastic_contact import PlasticContact
from solver.engine.world import Batch
from solver.params import ParameterError
from solver.pours.checkpoint import checkpoint_bytes, checkpoint_of, read_checkpoint, resumed
from solver.pours.pour import Pour
from solver.pours.run import capacity_for
from solver.scenes.material_file import load_material
from solver.scenes.scene import with_values
from solver.scenes.time_step import time_step
from solver.single_body.free_world import ROOM
from tests.solver.effects.cases import ROOM_WITH_EFFECTS, felt, with_effects

pytestmark = pytest.mark.usefixtures("taichi")

HEAP = with_values(
    load_material("sunflower_extract"),
    {"body.spheres": "coarse", "rig.mass": "4g", "insertion.rate": "60g/s", "rig.outlet_diameter": "60mm"},
)
MOIST = with_effects(
    HEAP,
    felt("rolling_resistance"),
    felt("capillary_bridge", surface_tension=0.072),
    felt("adhesion_jkr", work_of_adhesion=0.5),
    felt("air_drag", strength=1.0),
    felt("plastic_contact", plasticity=0.3),
    felt("plate_tilt"),
)


def drive(pour, until):
    while pour.time < until and (steps := pour.steps_due()):
        pour.after(steps, pour.batch.advance(np.array([steps], dtype=np.int32))[0])
    return pour


@pytest.fixture(scope="module")
def moist(taichi):
    """Record of the pour with effects, 0.3 s of it."""
    return drive(Pour(Batch(ROOM_WITH_EFFECTS), 0, MOIST, 5), 0.3).record()


def test_the_capacity_of_a_pour_follows_its_effects():
    assert capacity_for([HEAP, MOIST], 1).effects
    assert not capacity_for([HEAP, with_effects(HEAP, felt("plate_tilt"))], 1).effects


def test_the_account_of_the_pour_closes(moist):
    assert moist.scene.gravity[0] > 0.4  # tilted
    assert moist.trace.dissipated_energy[-1] > 0.2 * moist.trace.supplied_energy[-1]
    assert np.abs(moist.trace.energy_error).max() < 0.01


@pytest.mark.slow
def test_a_checkpoint_in_between_changes_no_bit(moist, tmp_path):
    batch = Batch(ROOM_WITH_EFFECTS)
    path = tmp_path / "pour.npz"
    path.write_bytes(checkpoint_bytes(checkpoint_of(drive(Pour(batch, 0, MOIST, 5), 0.15))))
    again = drive(resumed(batch, 0, MOIST, read_checkpoint(path)), 0.3).record()
    assert again.steps == moist.steps
    for one, other in ((again.bodies, moist.bodies), (again.trace, moist.trace)):
        for name, array in vars(one).items():
            assert np.array_equal(array, getattr(other, name)), name
    with pytest.raises(ParameterError, match="another scene"):
        resumed(batch, 0, HEAP, read_checkpoint(path))


def test_switched_on_while_it_runs():
    """Up to the switch, and in the batch with effects until the change, the pour is the one without; then another."""
    plain = drive(Pour(Batch(ROOM), 0, HEAP, 5), 0.3)
    state, energies, steps = plain.bodies(), plain.samples[-1], plain.steps
    later = drive(plain, 0.4).bodies()
    pour = drive(Pour(Batch(ROOM), 0, HEAP, 5), 0.2)
    drive(Pour(Batch(ROOM_WITH_EFFECTS), 0, MOIST, 1), 0.1)  # leaves its memory behind
    pour.move_to(Batch(ROOM_WITH_EFFECTS))
    drive(pour, 0.3)
    assert np.array_equal(pour.bodies().position, state.position)
    assert np.array_equal(pour.bodies().velocity, state.velocity)
    assert pour.samples[-1] == energies
    assert pour.steps == steps
    sticky = with_effects(HEAP, felt("rolling_resistance"), felt("capillary_bridge"))
    pour.ramp_to(sticky)
    drive(pour, 0.4)
    assert pour.time == pytest.approx(plain.time, abs=1e-3)
    assert np.abs(pour.bodies().position - later.position).max() > 1e-4
    pour.ramp_to(HEAP)
    assert pour.scene == HEAP
    drive(pour, 0.42)


def test_it_cannot_be_switched_on_where_it_is_not_compiled():
    pour = drive(Pour(Batch(ROOM), 0, HEAP, 5), 0.05)
    with pytest.raises(RuntimeError, match="effects=True"):
        pour.ramp_to(MOIST)


class Stiffer(PlasticContact):
    stiffening = 4.0


def test_an_effect_that_stiffens_contacts_takes_a_shorter_step_and_a_plastic_contact_does_not():
    assert time_step(with_effects(HEAP, Stiffer(plasticity=0.75))) == pytest.approx(0.5 * time_step(HEAP))
    assert time_step(with_effects(HEAP, felt("plastic_contact", plasticity=0.75))) == time_step(HEAP)
