"""What a clump's contact is damped with, and how contacts of one pair share: impacts against their closed forms.

A frictionless impact of one sphere off the centre of its body is that of the mass that the contact moves, 1/m = 1/m_b +
q·I⁻¹ q: the restitution at the contact point is the declared one if the dashpot takes that mass.
"""

import dataclasses
import math

import numpy as np
import pytest

from solver.engine.world import Batch
from solver.pours.pour import Pour
from solver.pours.run import capacity_for
from solver.scenes.body import Body, Members
from solver.scenes.insertion import rotation_matrix
from solver.scenes.material_file import load_material
from solver.scenes.scene import with_values
from solver.single_body.free_world import EARTH, GRAIN, FreeWorld, grain_on_plate
from tests.solver.pour_digests import HEAP, digest

pytestmark = pytest.mark.usefixtures("taichi")

SEED = load_material("nine_sphere_seed").bodies[0].clump
PLATE_OF = 5
"""Spheres along each edge of a flat body."""
SPEED = 0.1
"""[m/s]"""
DT = 1e-7
"""[s]; a contact lasts some thousand steps."""


def seed_of_nine():
    members = Members(tuple(map(tuple, SEED.centres.tolist())), tuple(SEED.radii), SEED.mass, tuple(SEED.inertia))
    return Body("grain", "grain", 1.0, members, GRAIN.density)


def flat_body():
    """25 equal spheres side by side: a plate that lands on all of them at once."""
    places = 4e-3 * (np.arange(PLATE_OF) - (PLATE_OF - 1) / 2)
    centres = tuple((float(x), float(y), 0.0) for x in places for y in places)
    mass = 2e-3
    inertia = (mass * 16e-3**2 / 12, mass * 16e-3**2 / 12, mass * 16e-3**2 / 6)
    return Body("grain", "grain", 1.0, Members(centres, (2e-3,) * len(centres), mass, inertia), GRAIN.density)


def ruled(scene, **choices):
    return dataclasses.replace(scene, contact=dataclasses.replace(scene.contact, **choices))


def tip_restitution(rule, tilt_deg, restitution=0.5):
    """Speed of the contact point away from the plate over that towards it, of a seed tilted about its middle axis."""
    lab = FreeWorld(
        ruled(grain_on_plate(seed_of_nine(), friction=0.0, restitution=restitution), clump_rule=rule), 1, dt=DT
    )
    half = math.radians(tilt_deg) / 2
    turn = np.array([math.cos(half), 0.0, math.sin(half), 0.0])
    centres = SEED.centres @ rotation_matrix(turn).T
    lowest = int(np.argmin(centres[:, 2] - SEED.radii))
    down = np.array([0.0, 0.0, SEED.radii[lowest]])
    lab.put(0, down - centres[lowest] + [0.0, 0.0, 1e-6], velocity=(0.0, 0.0, -SPEED), quaternion=turn)
    lab.run_apart(80_000, 20)
    state = lab.state()[0]
    turned = rotation_matrix(state[3:7])
    arm = turned @ SEED.centres[lowest] - down
    return (state[7:10] + np.cross(turned @ state[10:13], arm))[2] / SPEED


@pytest.mark.parametrize("tilt", [0.0, 15.0, 60.0, 90.0])
@pytest.mark.parametrize("restitution", [0.3, 0.8])
def test_the_mass_at_the_contact_gives_the_declared_restitution_at_every_tilt(tilt, restitution):
    # 0.006: the overlap shortens the arm by up to 1 %, and it turns while the sphere is in contact.
    assert tip_restitution("local_mass", tilt, restitution) == pytest.approx(restitution, abs=0.006)


def test_the_mass_of_the_body_damps_a_tilted_impact_too_much():
    assert tip_restitution("body_mass", 0.0) == pytest.approx(0.5, abs=0.005)
    assert tip_restitution("body_mass", 15.0) == pytest.approx(0.31, abs=0.02)


def test_a_contact_alone_shares_with_nobody():
    assert tip_restitution("local_mass_shared", 15.0) == tip_restitution("local_mass", 15.0)


def landing(rule, restitution=0.5, tilt_deg=0.0):
    """Restitution of the flat body, tilted by ``tilt_deg``, and its deepest overlap [m]."""
    body = flat_body()
    lab = FreeWorld(ruled(grain_on_plate(body, friction=0.0, restitution=restitution), clump_rule=rule), 1, dt=DT)
    half = math.radians(tilt_deg) / 2
    turn = (math.cos(half), math.sin(half), 0.0, 0.0)
    edge = 8e-3 * math.sin(math.radians(tilt_deg))
    lab.put(0, (0.0, 0.0, 2e-3 + 1e-6 + edge), velocity=(0.0, 0.0, -SPEED), quaternion=turn)
    lab.run_apart(80_000, 20)
    state = lab.state()[0]
    return state, float(lab.run(1)["overlap"]) * 2e-3


def test_a_flat_body_lands_as_one_contact():
    shared, depth = landing("local_mass_shared")
    assert shared[9] / SPEED == pytest.approx(0.5, abs=0.002)
    assert shared[10:13] == pytest.approx(0.0, abs=1e-6)
    # The depth is that of one sphere with the mass of the body.
    alone = FreeWorld(
        grain_on_plate(Body("grain", "grain", 1.0, one_sphere(flat_body().clump.mass), GRAIN.density), 0.0), 1, dt=DT
    )
    alone.put(0, (0.0, 0.0, 2e-3 + 1e-6), velocity=(0.0, 0.0, -SPEED))
    alone.run_apart(80_000, 20)
    assert depth == pytest.approx(float(alone.run(1)["overlap"]) * 2e-3, rel=1e-6)


def one_sphere(mass):
    return Members(((0.0, 0.0, 0.0),), (2e-3,), mass, (0.4 * mass * 2e-3**2,) * 3)


def test_contacts_that_do_not_share_damp_a_flat_landing_many_times():
    """√25 times the damping and 25 times the stiffness: hardly anything comes back."""
    state, depth = landing("body_mass")
    assert state[9] / SPEED < 0.15
    assert depth < 0.5 * landing("local_mass_shared")[1]


@pytest.mark.parametrize("tilt", [0.02, 0.05, 0.1, 0.3, 1.0, 3.0])
def test_a_landing_askew_makes_no_energy(tilt):
    """Shares that change while bodies are pressed together are no potential: of e = 1, up to a twentieth is lost."""
    body = flat_body().clump
    state, _ = landing("local_mass_shared", 1.0, tilt)
    energy = 0.5 * body.mass * state[7:10] @ state[7:10] + 0.5 * state[10:13] @ (body.inertia * state[10:13])
    assert 0.95 < energy / (0.5 * body.mass * SPEED**2) < 1.0001


@pytest.mark.parametrize("rule", ["local_mass", "local_mass_shared"])
def test_a_body_at_rest_weighs_what_it_weighs(rule):
    lab = FreeWorld(ruled(grain_on_plate(flat_body(), gravity=EARTH), clump_rule=rule), 1)
    lab.put(0, (0.0, 0.0, 2e-3))
    lab.run(20_000)
    force = lab.batch.surface_state(0)[0, 13:16]
    assert force[2] == pytest.approx(-9.81 * flat_body().clump.mass, rel=1e-3)


@pytest.mark.parametrize("rule", ["local_mass", "local_mass_shared"])
def test_pours_repeat_bit_for_bit_whatever_the_list(rule):
    found = []
    for skin in ("0.5mm", "2mm"):
        scene = with_values(HEAP, {"contact.clump_rule": rule, "numerics.skin": skin, "numerics.max_time": "1s"})
        pour = Pour(Batch(capacity_for([HEAP, scene], 1)), 0, scene, 1)
        while n := pour.steps_due():
            pour.after(n, pour.batch.advance(np.array([n], dtype=np.int32))[0])
        found.append(digest(pour.record()))
    assert found[0] == found[1]


def test_a_batch_without_the_shared_rule_refuses_it():
    scene = with_values(HEAP, {"contact.clump_rule": "local_mass_shared"})
    with pytest.raises(ValueError, match=r"contact\.clump_rule"):
        Pour(Batch(capacity_for([HEAP], 1)), 0, scene, 1)
