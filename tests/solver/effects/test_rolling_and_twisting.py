"""Resistance against rolling and twisting beside rigid-body mechanics."""

import numpy as np
import pytest

from solver.backend import ti
from solver.effects.rolling_resistance import rolling_torque
from solver.effects.touch import Touch
from solver.effects.twisting import twisting_torque
from solver.engine.state import Vec3
from solver.laws.hertz_mindlin import tangential_damping
from solver.scenes.material import effective_shear_modulus, effective_youngs_modulus
from solver.single_body.free_world import EARTH, GRAIN, RADIUS, WALL, FreeWorld, sphere
from tests.solver.effects.cases import felt, hertz_rest, scene_with

pytestmark = pytest.mark.usefixtures("taichi")

MASS = sphere().mass
REST = hertz_rest(MASS * 9.81, effective_youngs_modulus(GRAIN, WALL))
"""Overlap of a sphere that lies on the plane."""


def rolling(resistance, gravity=EARTH, **more):
    return scene_with(
        felt("rolling_resistance", rolling_friction=resistance, rolling_damping=0.0), gravity=gravity, **more
    )


@pytest.mark.parametrize("friction", [0.01, 0.1])
def test_a_rolling_sphere_slows_by_five_sevenths_of_the_coefficient(friction):
    """m v' = −T, I ω' = T R − μ_r R m g, v = ω R, I = 2/5 m R²:  v' = −5/7 μ_r g, at two speeds side by side."""
    lab = FreeWorld(rolling(friction), 2)
    for b, speed in enumerate((0.3, 0.5)):
        lab.put(b, (0.0, 0.1 * b, RADIUS - REST), velocity=(speed, 0, 0), spin=(0, speed / RADIUS, 0))
    lab.run(round(0.05 / lab.dt))
    first = lab.state()[:, 7].copy()
    steps = round(0.2 / lab.dt)
    lab.run(steps)
    slowed = (first - lab.state()[:, 7]) / (steps * lab.dt)
    assert slowed == pytest.approx([5.0 / 7.0 * friction * 9.81] * 2, rel=1e-3)  # the contact rolls on R − δ/2


def test_a_sphere_stops_and_stays():
    lab = FreeWorld(rolling(0.2), 1)
    lab.put(0, (0.0, 0.0, RADIUS - REST), velocity=(0.1, 0, 0), spin=(0, 0.1 / RADIUS, 0))
    lab.run(round(0.5 / lab.dt))
    there = lab.state()[0, 0]
    assert there == pytest.approx(0.1**2 / (2.0 * 5.0 / 7.0 * 0.2 * 9.81), rel=0.01)
    row = lab.run(round(0.5 / lab.dt))
    # It rocks on its spring within the width of the contact; nothing damps that here but the tangential dashpot.
    assert lab.state()[0, 0] == pytest.approx(there, abs=2e-5)
    assert row["kinetic"] < 1e-4 * 0.7 * MASS * 0.1**2


@pytest.mark.parametrize("share", [0.95, 1.3])
def test_on_a_slope_it_holds_below_the_angle_of_rolling_friction(share):
    """v' = 5/7 g (sin α − μ_r cos α) above tan⁻¹ μ_r."""
    friction = 0.2
    angle = np.arctan(share * friction)
    lab = FreeWorld(rolling(friction, gravity=(9.81 * np.sin(angle), 0.0, -9.81 * np.cos(angle))), 1)
    lab.put(0, (0.0, 0.0, RADIUS - REST))
    lab.run(round(0.1 / lab.dt))
    first = lab.state()[0].copy()
    steps = round(0.2 / lab.dt)
    lab.run(steps)
    if share < 1.0:
        assert abs(lab.state()[0, 0]) < 1e-4
        assert abs(lab.state()[0, 7]) < 1e-3
    else:
        expected = 5.0 / 7.0 * 9.81 * (np.sin(angle) - friction * np.cos(angle))
        gained = (lab.state()[0, 7] - first[7]) / (steps * lab.dt)
        assert gained == pytest.approx(expected, rel=0.01)  # sin α and μ_r cos α nearly cancel


def test_between_two_spheres_the_torque_is_on_the_reduced_radius():
    """Two spheres pressed together spin against each other: I ω' = −μ_r R* F_n each, with F_n held by gravity.

    One lies on the plane without friction and without effect on it, for the moment before it tips.
    """
    friction = 0.1
    # The lower one rests on the plane, so F_n between the two is the weight of the upper one.
    lab = FreeWorld(rolling(friction, friction=0.0), 2, fraction=0.05)
    e_star = effective_youngs_modulus(GRAIN, GRAIN)
    between = hertz_rest(MASS * 9.81, e_star, RADIUS / 2.0)
    lower = RADIUS - hertz_rest(2.0 * MASS * 9.81, effective_youngs_modulus(GRAIN, WALL))
    lab.put(0, (0.0, 0.0, lower))
    lab.put(1, (0.0, 0.0, lower + 2.0 * RADIUS - between), spin=(0.0, 30.0, 0.0))
    steps = round(2e-3 / lab.dt)
    lab.run(steps)
    first = lab.state()[1, 11]
    lab.run(steps)
    inertia = 0.4 * MASS * RADIUS**2
    torque = (lab.state()[1, 11] - first) * inertia / (steps * lab.dt)
    assert torque == pytest.approx(-friction * 0.5 * RADIUS * MASS * 9.81, rel=0.01)


@pytest.mark.parametrize("strength", [1.0, 10.0])
def test_a_spinning_sphere_slows_by_two_thirds_of_the_contact_radius(strength):
    """Torque ⅔ a μ F_n s about the normal."""
    lab = FreeWorld(scene_with(felt("twisting", strength=strength), gravity=EARTH, friction=0.4), 1)
    lab.put(0, (0.0, 0.0, RADIUS - REST), spin=(0.0, 0.0, 50.0))
    lab.run(round(0.05 / lab.dt))
    first = lab.state()[0, 12]
    steps = round(0.1 / lab.dt)
    lab.run(steps)
    torque = (first - lab.state()[0, 12]) * 0.4 * MASS * RADIUS**2 / (steps * lab.dt)
    a = np.sqrt(RADIUS * REST)
    assert torque == pytest.approx(strength * 2.0 / 3.0 * a * 0.4 * MASS * 9.81, rel=1e-3)
    assert lab.state()[0, 7:9] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_small_twist_swings_and_dies_down():
    """A damped oscillator: ω² = 4 G* a³ s/I, decay ½ · ½ η_t a² s/I with the tangential dashpot η_t."""
    strength, first = 5.0, 0.05
    scene = scene_with(felt("twisting", strength=strength), gravity=EARTH, restitution=0.3)
    lab = FreeWorld(scene, 1)
    lab.put(0, (0.0, 0.0, RADIUS - REST), spin=(0.0, 0.0, first))
    a, inertia = np.sqrt(RADIUS * REST), 0.4 * MASS * RADIUS**2
    g_star = effective_shear_modulus(GRAIN, WALL)
    dashpot = tangential_damping(0.3) * np.sqrt(8.0 * g_star * a * MASS)
    decay = strength * 0.5 * dashpot * a**2 / (2.0 * inertia)
    frequency = np.sqrt(strength * 4.0 * g_star * a**3 / inertia)
    chunk, found = 5, []
    for _ in range(round(3.0 / decay / lab.dt / chunk)):
        lab.run(chunk)
        found.append(lab.state()[0, 12])
    times = chunk * lab.dt * np.arange(1, len(found) + 1)
    swing = np.sqrt(frequency**2 - decay**2) * times
    expected = first * np.exp(-decay * times) * (np.cos(swing) - decay / frequency * np.sin(swing))
    assert np.array(found) == pytest.approx(expected, abs=0.02 * first)


@ti.kernel
def rocked(sizes: ti.types.ndarray(dtype=ti.f64, ndim=1), work: ti.types.ndarray(dtype=ti.f64, ndim=2)):
    """Work [J] on a contact under 1 N that is turned to and fro by ``sizes`` [rad] ten times.

    Columns: rolling, twisting.
    """
    for k in range(sizes.shape[0]):
        spring = Vec3(0.0, 0.0, 0.0)
        twist = ti.Vector([0.0])
        dt = 1e-3
        last_roll, last_twist = 0.0, 0.0
        for step in range(10000):
            rate = sizes[k] * 2.0 * np.pi * ti.cos(2.0 * np.pi * dt * step)
            touch = Touch(force=1.0)
            touch.normal = Vec3(0.0, 0.0, 1.0)
            touch.radius, touch.reduced_radius, touch.mass = 1e-4, 5e-3, 1e-3
            touch.g_star, touch.dt, touch.limit = 1e7, dt, 0.5
            touch.omega = rate * Vec3(1.0, 0.0, 0.0)
            touch, spring = rolling_torque(ti.Vector([0.1, 0.0]), spring, touch)
            roll = touch.torque[0]
            touch.torque = Vec3(0.0, 0.0, 0.0)
            touch.omega = rate * Vec3(0.0, 0.0, 1.0)
            touch, twist = twisting_torque(ti.Vector([1.0]), twist, touch)
            turn = touch.torque[2]
            # The mean of the torques before and after the turn.
            work[k, 0] += 0.5 * dt * (roll + last_roll) * rate
            work[k, 1] += 0.5 * dt * (turn + last_twist) * rate
            last_roll, last_twist = roll, turn


def test_turning_to_and_fro_never_yields_work():
    """Whole cycles of any size: elastic ones return what they took, wider ones lose 4 times cap × (size − cap/k)."""
    sizes = np.array([1e-6, 1e-4, 1e-3, 1e-2, 0.1, 1.0])
    work = np.zeros((len(sizes), 2))
    rocked(sizes, work)
    for column, (cap, stiffness) in enumerate(
        ((0.1 * 5e-3, 8.0 * 1e7 * 1e-4 * 5e-3**2), (2.0 / 3.0 * 1e-4 * 0.5, 4.0 * 1e7 * 1e-12))
    ):
        slack = np.maximum(0.0, sizes - cap / stiffness)
        expected = -10.0 * 4.0 * cap * slack
        # A cycle is cut into 1000 steps, and the first quarter of the first comes from no load: half of its loss less.
        assert work[:, column] == pytest.approx(expected, rel=0.03, abs=1e-9 * cap)
