"""Linear springs and dashpots: one impact and one oscillation against their closed forms."""

import dataclasses
import math

import numpy as np
import pytest

from solver.laws import LinearSpringDashpot
from solver.laws.restitution import damping_ratio
from solver.scenes.body import Body, Members
from solver.scenes.contact_model import ContactModel
from solver.scenes.material import effective_youngs_modulus
from solver.single_body.free_world import GRAIN, RADIUS, FreeWorld, grain_on_plate
from solver.verification.impacts import hertz_depth

pytestmark = pytest.mark.usefixtures("taichi")

SPEED = 0.7
"""Characteristic velocity [m/s]."""
LINEAR = ContactModel(law=LinearSpringDashpot.name, characteristic_velocity=SPEED)
MASS = 4.0 / 3.0 * math.pi * RADIUS**3 * GRAIN.density
FINE = 2000
"""Steps in the time of the elastic contact."""


def scene_of_one(restitution=1.0, friction=0.0, body=None):
    return dataclasses.replace(grain_on_plate(body, friction=friction, restitution=restitution), contact=LINEAR)


def stiffness(scene):
    """k_n [N/m] of the grain on the plate: an elastic impact at ``SPEED`` is as deep as Hertz's, m V²/δ²."""
    e_star = effective_youngs_modulus(*scene.materials)
    return MASS * SPEED**2 / hertz_depth(MASS, SPEED, e_star, RADIUS) ** 2


def test_the_stiffness_is_that_of_a_hertzian_impact_at_the_characteristic_velocity():
    scene = scene_of_one()
    e_star = effective_youngs_modulus(*scene.materials)
    assert LinearSpringDashpot.stiffness(e_star, RADIUS, MASS, 3.0, LINEAR) == pytest.approx(
        stiffness(scene), rel=1e-12
    )


def impact(speed, restitution):
    """Times [s], overlaps [m] and force on the plate [N] of one impact, speed after it [m/s], and k_n [N/m]."""
    scene = scene_of_one(restitution)
    k = stiffness(scene)
    dt = math.pi * math.sqrt(MASS / k) / FINE
    lab = FreeWorld(scene, 1, dt=dt)
    lab.put(0, (0.0, 0.0, RADIUS), velocity=(0.0, 0.0, -speed))
    rows = []
    for step in range(1, 2 * FINE):
        lab.run(1)
        state = lab.state()[0]
        rows.append((step * dt, RADIUS - state[2], -lab.batch.surface_state(0)[0, 15]))
        if rows[-1][1] < 0.0:
            break
    return *np.array(rows).T, state[9], k


@pytest.mark.parametrize("speed", [0.07, 3.0])
def test_an_elastic_impact_lasts_equally_long_at_every_speed_and_its_depth_goes_with_it(speed):
    times, overlaps, _, out, k = impact(speed, 1.0)
    assert times[-1] == pytest.approx(math.pi * math.sqrt(MASS / k), rel=2.0 / FINE)  # two steps
    assert overlaps.max() == pytest.approx(speed * math.sqrt(MASS / k), rel=2e-3)  # of the step
    assert out == pytest.approx(speed, rel=2e-3)


@pytest.mark.parametrize("restitution", [0.3, 0.8])
def test_a_damped_impact_is_over_when_the_force_is(restitution):
    """Schwager & Pöschel 2007: ω_d t = π − 2 φ with ζ = sin φ, before the overlap is gone; e is the declared one."""
    times, _, force, out, k = impact(1.0, restitution)
    zeta = damping_ratio(restitution)
    phi = math.asin(zeta)
    ends = (math.pi - 2.0 * phi) / (math.sqrt(k / MASS) * math.cos(phi))
    pushing = times[np.abs(force) > 0.0]
    assert pushing[-1] == pytest.approx(ends, abs=3.0 * times[0])
    assert times[-1] > 1.04 * ends
    assert out == pytest.approx(restitution, rel=2e-3)


def test_a_grain_held_by_friction_swings_with_the_tangential_stiffness():
    """Pressed on the plate by its weight, it cannot turn: x = v₀/ω sin ω t with ω = √(k_t/m), k_t = k_n."""
    upright = Members(((0.0, 0.0, 0.0),), (RADIUS,), MASS, (1e3,) * 3)
    scene = scene_of_one(friction=100.0, body=Body("grain", "grain", 1.0, upright, GRAIN.density))
    scene = dataclasses.replace(scene, gravity=(0.0, 0.0, -500.0))
    k = stiffness(scene)
    omega = math.sqrt(k / MASS)
    lab = FreeWorld(scene, 1, dt=2.0 * math.pi / omega / FINE)
    v0 = 1e-3
    # The velocity is that of the half step before the first.
    lab.put(0, (0.0, 0.0, RADIUS - MASS * 500.0 / k), velocity=(v0 * math.cos(0.5 * omega * lab.dt), 0.0, 0.0))
    found = []
    for _ in range(3 * 20):
        lab.run(FINE // 20)
        found.append(lab.state()[0, 0])
    times = lab.dt * (FINE // 20) * np.arange(1, 61)
    # Slip is booked a step late: the swing is damped or driven by ω dt/2 a radian.
    assert np.array(found) == pytest.approx(v0 / omega * np.sin(omega * times), abs=0.02 * v0 / omega)
    lowest = min(range(len(found)), key=lambda i: found[i])
    assert (lowest + 1) % 20 == 15  # three quarters of a period
