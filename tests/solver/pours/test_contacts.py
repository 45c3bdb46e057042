"""Forces of contacts, against weights and against the motion that they cause."""

import numpy as np
import pytest

from solver.engine.world import Batch
from solver.pours.contacts import Contacts, coordination_numbers, loads
from solver.pours.pour import Pour
from solver.pours.run import capacity_for
from tests.solver.pours.test_checkpoint import HEAP
from tests.solver.pours.test_rewind import drive

G = 9.81


@pytest.fixture(scope="module")
def heap(taichi):
    """Contacts and bodies of a pour of coarse seeds that has come to rest."""
    pour = drive(Pour(Batch(capacity_for([HEAP], 1)), 0, HEAP, 5))
    return pour.contacts(), pour.bodies()


def net_force(contacts, bodies):
    """Sum of the forces on each body [N]."""
    total = np.zeros((bodies, 3))
    np.add.at(total, contacts.body, contacts.force)
    among = contacts.partner >= 0
    np.add.at(total, contacts.partner[among], -contacts.force[among])
    return total


def test_a_pile_at_rest_is_borne_by_the_plate(heap):
    contacts, bodies = heap
    assert len(contacts.body) > 20
    borne = contacts.force[contacts.partner < 0].sum(axis=0)
    weight = bodies.mass[bodies.inside].sum() * G
    # A body may fall asleep with 2 % of its weight out of balance (kernels/sleep.py).
    assert borne[2] == pytest.approx(weight, rel=0.02)
    assert np.abs(borne[:2]).max() < 0.02 * weight


def test_forces_on_a_moving_heap_are_those_that_move_it(taichi):
    pour = drive(Pour(Batch(capacity_for([HEAP], 1)), 0, HEAP, 5), until=0.45)
    pour.batch.set_sleep(0, 0.0, 0.1)
    step = np.array([1], dtype=np.int32)
    pour.batch.advance(step)
    before = pour.bodies()
    pour.batch.advance(step)
    after, contacts = pour.bodies(), pour.contacts()
    assert len(contacts.body) > 5
    expected = before.mass[:, None] * ((after.velocity - before.velocity) / pour.dt + np.array([0.0, 0.0, G]))
    # Forces are mN and more; what is lost is the rounding of a speed of 1 m/s divided by a step of some 10 µs.
    found = net_force(contacts, len(before.mass))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max() + 1e-10)


def test_within_coulomb_s_limit(heap):
    contacts, _ = heap
    most = max(pair.static_friction for pair in HEAP.pairs)
    assert (contacts.tangential_force <= most * np.abs(contacts.normal_force) * (1 + 1e-9)).all()
    assert np.linalg.norm(contacts.normal, axis=1) == pytest.approx(1.0)


def made_up():
    """Body 0 on surface 0, touched twice by 1, which is touched by 2."""
    return Contacts(
        body=np.array([0, 0, 0, 1]),
        partner=np.array([-1, 1, 1, 2]),
        point=np.zeros((4, 3)),
        normal=np.tile([0.0, 0.0, 1.0], (4, 1)),
        force=np.array([[3.0, 4.0, 5.0], [0.0, 0.0, -1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 7.0]]),
    )


def test_loads_count_every_contact_and_coordination_every_neighbour_once():
    contacts = made_up()
    assert loads(contacts, 4).tolist() == [8.0, 10.0, 7.0, 0.0]
    assert coordination_numbers(contacts, 4).tolist() == [1, 2, 1, 0]
    assert contacts.normal_force.tolist() == [5.0, -1.0, 2.0, 7.0]
    assert contacts.tangential_force.tolist() == [5.0, 0.0, 0.0, 0.0]


def test_reading_changes_nothing(taichi):
    pour = drive(Pour(Batch(capacity_for([HEAP], 1)), 0, HEAP, 5), until=0.3)
    first = drive(pour, until=0.4).bodies()
    pour = drive(Pour(pour.batch, 0, HEAP, 5), until=0.3)
    pour.contacts()
    np.testing.assert_array_equal(drive(pour, until=0.4).bodies().position, first.position)


def test_no_bodies_no_contacts(taichi):
    contacts = Pour(Batch(capacity_for([HEAP], 1)), 0, HEAP, 5).contacts()
    assert loads(contacts, 1).tolist() == [0.0]
    assert coordination_numbers(contacts, 1).tolist() == [0]
