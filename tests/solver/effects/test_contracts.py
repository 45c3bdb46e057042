"""What holds for every effect on contacts and flight, written once.

``tumble`` (``cases.py``) drops, rolls and piles three spheres on a plane; its outcome is compared between runs.
"""

import dataclasses

import numpy as np
import pytest

from solver.effects import EFFECTS
from solver.params import declared
from solver.scenes.insertion import rotation_matrix
from solver.single_body.free_world import EARTH, GRAIN, RADIUS, WALL, FreeWorld, sphere
from tests.solver.effects.cases import (
    FELT,
    IN_KERNELS,
    ON_CONTACTS,
    ROOM,
    ROOM_WITH_EFFECTS,
    crowd,
    felt,
    onward,
    scene_with,
    tumble,
    with_effects,
)

pytestmark = pytest.mark.usefixtures("taichi")

PLAIN = scene_with(gravity=EARTH)


def test_with_effects_compiled_in_but_off_not_a_bit_changes():
    """State of the bodies, and every number of the summary."""
    plain, idle = crowd(ROOM, PLAIN), crowd(ROOM_WITH_EFFECTS, PLAIN)
    for _ in range(4):
        one, other = onward(plain, 1500), onward(idle, 1500)
        assert one == other
        assert np.array_equal(plain.bodies(0, 24), idle.bodies(0, 24))
    assert one["touching"] > 5
    assert one["dissipated"] > one["kinetic"]


@pytest.fixture(scope="module")
def base(taichi):
    """The tumble without effects: (state, time step)."""
    return tumble(PLAIN)


@pytest.fixture(scope="module")
def outcomes(base):
    """The tumble with each effect as strong as ``FELT`` says, at the time step of the base."""
    return {name: tumble(with_effects(PLAIN, felt(name)), dt=base[1])[0] for name in IN_KERNELS}


def distance(one, other):
    """Largest difference of positions over the radius, or of velocities over 1 m/s."""
    return max(np.abs(one[:, :3] - other[:, :3]).max() / RADIUS, np.abs(one[:, 7:10] - other[:, 7:10]).max())


@pytest.mark.parametrize("name", IN_KERNELS)
def test_it_acts_and_vanishes_with_its_amplitude(name, base, outcomes):
    state, dt = base
    full = distance(outcomes[name], state)
    assert full > 1e-4
    amplitude = EFFECTS[name].amplitudes[0]
    weak = felt(name, **{amplitude: 1e-6 * FELT[name][amplitude]})
    # Adhesion goes with the cube root of w at first, hence no more than a hundredth.
    assert distance(tumble(with_effects(PLAIN, weak), dt=dt)[0], state) < 1e-2 * full


@pytest.mark.parametrize("name", IN_KERNELS)
def test_every_parameter_acts(name, base, outcomes):
    for key in declared(EFFECTS[name], name):
        key = key.split(".")[1]
        other = felt(name, **{key: 1.2 * FELT[name][key]})
        changed = tumble(with_effects(PLAIN, other), dt=base[1])[0]
        assert distance(changed, outcomes[name]) > 1e-9, key


@pytest.mark.parametrize("name", IN_KERNELS)
def test_turned_with_all_that_is_there_it_gives_the_same_turned(name, base, outcomes):
    """Plane, gravity, places, velocities and bodies are turned; a wrench that knew x from y would show."""
    quaternion = np.array([0.3, -0.5, 0.7, 0.4])
    quaternion /= np.linalg.norm(quaternion)
    turn = rotation_matrix(quaternion)
    scene = scene_with(felt(name), gravity=turn @ np.array(EARTH), turn=quaternion)
    state = tumble(scene, dt=base[1], turn=turn, quaternion=quaternion)[0]
    expected = outcomes[name]
    # Rounding, 1e-16, grows with every impact and slip.
    assert state[:, :3] @ turn == pytest.approx(expected[:, :3], abs=1e-9 * RADIUS)
    assert state[:, 7:10] @ turn == pytest.approx(expected[:, 7:10], abs=1e-9)
    assert state[:, 10:13] == pytest.approx(expected[:, 10:13], abs=1e-6)


EXPONENTS = {
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "m/s": (0, 1, -1),
    "m3": (0, 3, 0),
    "N/m": (1, 0, -2),
    "J/m2": (1, 0, -2),
    "J/m3": (1, -1, -2),
}
"""Of mass, length and time."""


@pytest.mark.parametrize("name", ON_CONTACTS)
def test_other_units_of_mass_length_and_time_give_the_same(name, base, outcomes):
    """Air drag is not here: its air has a density and viscosity in SI."""
    mass, length, time = 0.7, 3.0, 1.6

    def scaled(number, unit):
        exponents = EXPONENTS[unit]
        return number * mass ** exponents[0] * length ** exponents[1] * time ** exponents[2]

    kind = EFFECTS[name]
    values = {
        path.split(".")[1]: scaled(FELT[name][path.split(".")[1]], parameter.unit)
        for path, parameter in declared(kind, name).items()
    }
    per_volume, per_area = mass / length**3, mass / length / time**2
    grain, wall = (
        dataclasses.replace(m, density=m.density * per_volume, shear_modulus=m.shear_modulus * per_area)
        for m in (GRAIN, WALL)
    )
    gravity = tuple(g * length / time**2 for g in EARTH)
    scene = scene_with(kind(**values), bodies=(sphere(RADIUS * length, grain),), gravity=gravity, grain=grain)
    scene = dataclasses.replace(scene, materials=(grain, wall))
    state = tumble(scene, dt=base[1] * time, scale=(length, time))[0]
    expected = outcomes[name]
    # Rounding, 1e-16, grows with every impact and slip.
    assert state[:, :3] / length == pytest.approx(expected[:, :3], abs=1e-8 * RADIUS)
    assert state[:, 7:10] * time / length == pytest.approx(expected[:, 7:10], abs=1e-8)


def pair_of_spheres(effect, friction, restitution):
    """Two unequal spheres that meet obliquely, spinning, in free space: states before and after, masses, inertias."""
    bodies = (sphere(RADIUS, name="big"), sphere(0.6 * RADIUS, name="small"))
    scene = scene_with(effect, bodies=bodies, friction=friction, restitution=restitution)
    lab = FreeWorld(scene, (0, 1), fraction=0.02, plate=False)
    lab.put(0, (0, 0, 0), velocity=(0.3, 0.1, 0.2), spin=(10.0, 20.0, -40.0))
    lab.put(1, (0.3 * RADIUS, 0.1 * RADIUS, 1.6 * RADIUS), velocity=(0.1, 0.0, -0.6), spin=(-30.0, 5.0, 60.0))
    before = lab.state()
    row = lab.run(round(0.02 / lab.dt))
    return before, lab.state(), row, np.array([b.mass for b in bodies]), np.array([b.clump.inertia[0] for b in bodies])


def momenta(state, mass, inertia):
    """Linear and angular momentum about the origin; spheres turn alike about every axis, their frame starts upright."""
    linear = mass @ state[:, 7:10]
    spin = np.einsum("bij,bj->bi", rotation_matrix(state[:, 3:7]), state[:, 10:13])
    return linear, np.cross(state[:, :3], mass[:, None] * state[:, 7:10]).sum(axis=0) + inertia @ spin


@pytest.mark.parametrize("name", [n for n in ON_CONTACTS if n != "wall_adhesion"])
def test_a_pair_keeps_its_momentum(name):
    before, after, _, mass, inertia = pair_of_spheres(felt(name), 0.5, 0.6)
    assert not np.allclose(before[:, 7:10], after[:, 7:10], atol=0.1)
    for old, new in zip(momenta(before, mass, inertia), momenta(after, mass, inertia), strict=True):
        assert new == pytest.approx(old, rel=1e-9, abs=1e-13)  # rounding; both are of the order of 1e-4 … 1e-6


LOSSY = {
    # name: friction and restitution that let it act where the base model alone loses as little as possible
    "rolling_resistance": (0.0, 1.0),
    "adhesion_jkr": (0.0, 1.0),
    "capillary_bridge": (0.0, 1.0),
    "air_drag": (0.0, 1.0),
    "twisting": (0.5, 1.0),
    "velocity_dependent_restitution": (0.0, 0.9),
    "plastic_contact": (0.0, 1.0),
    "kinetic_friction": (0.5, 1.0),
}


@pytest.mark.parametrize("name", [*LOSSY, "adhesion_sjkr"])
def test_from_apart_to_apart_it_does_no_positive_work(name):
    """A closed cycle of the contact; a pull by area is conservative and takes nothing."""
    friction, restitution = LOSSY.get(name, (0.0, 1.0))
    before, after, row, mass, inertia = pair_of_spheres(felt(name), friction, restitution)
    energy = [
        0.5 * mass @ (s[:, 7:10] ** 2).sum(axis=1) + 0.5 * inertia @ (s[:, 10:13] ** 2).sum(axis=1)
        for s in (before, after)
    ]
    lost = 1.0 - energy[1] / energy[0]
    if name == "adhesion_sjkr":
        assert abs(lost) < 1e-4  # time step
    else:
        assert lost > 1e-4
    total = row["kinetic"] + row["elastic"] + row["dissipated"]
    assert total == pytest.approx(energy[0], rel=2e-3)  # time step
    assert row["dissipated"] > -1e-4 * energy[0]


def test_at_walls_only():
    """Adhesion to walls leaves two bodies that meet as they are, and holds one on a wall."""
    _, plain, *_ = pair_of_spheres(felt("wall_adhesion", work_of_adhesion=0.0), 0.5, 0.6)
    _, walls, *_ = pair_of_spheres(felt("wall_adhesion", work_of_adhesion=50.0), 0.5, 0.6)
    assert np.array_equal(plain, walls)
    ceiling = scene_with(felt("wall_adhesion"), turn=(0.0, 1.0, 0.0, 0.0), gravity=EARTH, restitution=0.3)
    lab = FreeWorld(ceiling, 1)
    lab.put(0, (0.0, 0.0, -RADIUS + 1e-6))
    lab.run(round(0.3 / lab.dt))
    assert lab.state()[0, 2] == pytest.approx(-RADIUS, abs=1e-5)
