"""Velocities, loads and contacts: only while somebody looks, and as they are."""

import multiprocessing

import numpy as np
import pytest

from explorer.live.details import MAX_CONTACTS, DetailWriter, detail_reader, most_wanted, shared_details
from explorer.live.messages import StepBack, Watch
from solver.pours.contacts import Contacts
from tests.explorer.beads import MASS
from tests.explorer.live.test_frames import bodies
from tests.explorer.live.test_history import live, run  # noqa: F401

G = 9.81


def contacts_of(forces, body, partner):
    """Contacts that press along z with ``forces`` [N]."""
    m = len(forces)
    force = np.column_stack([np.full(m, 0.3), np.zeros(m), forces])
    return Contacts(np.array(body), np.array(partner), np.ones((m, 3)), np.tile([0.0, 0.0, 1.0], (m, 1)), force)


def test_details_come_out_as_they_went_in():
    block = shared_details(multiprocessing.get_context("spawn"))
    reader = detail_reader(block)
    assert reader.newest() is None
    three = bodies(3)
    contacts = contacts_of([1.0, -4.0, 2.0], [0, 0, 1], [-2, 1, 2])
    DetailWriter(block).publish(7, 0.5, three, np.array([0.1, 0.2, 0.3]), contacts, None)
    found = reader.newest()
    assert (found.number, found.generation, found.time, found.touching) == (1, 7, 0.5, 3)
    assert found.mean_force == pytest.approx(7.0 / 3.0)
    assert found.load.tolist() == [5.0, 6.0, 2.0]
    assert found.neighbours.tolist() == [1, 2, 1]
    assert found.entered == pytest.approx([0.1, 0.2, 0.3])
    # In order of strength.
    assert found.normal_force.tolist() == [-4.0, 2.0, 1.0]
    assert (found.body.tolist(), found.partner.tolist()) == ([0, 1, 0], [1, 2, -2])
    assert found.tangential_force == pytest.approx([0.3, 0.3, 0.3])
    assert found.mass == pytest.approx(three.mass)


def test_the_body_that_is_looked_at_comes_first():
    m = MAX_CONTACTS + 10
    contacts = contacts_of(np.arange(1.0, m + 1), np.arange(m), np.full(m, m))
    assert len(most_wanted(contacts, None)) == MAX_CONTACTS
    assert 0 not in most_wanted(contacts, None)
    assert most_wanted(contacts, 0)[0] == 0


def test_nothing_is_read_that_nobody_looks_at(live):  # noqa: F811
    run(live, 0.1)
    assert live.details.newest() is None
    live.pour.obey(Watch(wanted=True))
    first = live.details.newest()
    assert first.time == live.pour.status().time
    later, _ = run(live, 0.1)
    assert live.details.newest().time == later.time
    live.pour.obey(Watch(wanted=False))
    run(live, 0.1)
    assert live.details.newest().time == later.time


def test_beads_at_rest_bear_their_weight_and_go_back_with_the_pour(live):  # noqa: F811
    live.pour.obey(Watch(wanted=True))
    _, status = run(live, 5.0)
    found = live.details.newest()
    assert len(found.load) == status.bodies == 6
    single = (found.neighbours == 0) & (live.reader.newest().inside)
    assert single.any()
    # A bead that lies alone: one contact, with the plate. It may sleep with 2 % of its weight out of balance.
    for load in found.load[single]:
        assert load == pytest.approx(MASS * G, rel=0.02)
    assert (np.diff(found.entered) > 0).all()
    live.pour.obey(StepBack(0.3))
    assert live.details.newest().time == live.pour.status().time
