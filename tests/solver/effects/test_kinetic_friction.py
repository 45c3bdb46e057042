"""A sled on a plane: it starts at the angle of static friction and slides with the kinetic one."""

import numpy as np
import pytest

from solver.scenes.material import effective_youngs_modulus
from solver.single_body.free_world import GRAIN, RADIUS, WALL, FreeWorld
from tests.solver.effects.cases import felt, hertz_rest, scene_with, sled

pytestmark = pytest.mark.usefixtures("taichi")

STATIC, DROP = 0.5, 0.4
KINETIC = (1.0 - DROP) * STATIC


def down(angle):
    return (9.81 * np.sin(angle), 0.0, -9.81 * np.cos(angle))


def on_slope(angle, speed=0.0, transition=0.01):
    effect = felt("kinetic_friction", friction_drop=DROP, transition_speed=transition)
    scene = scene_with(effect, bodies=(sled(),), friction=STATIC, restitution=0.3, gravity=down(angle))
    lab = FreeWorld(scene, 1)
    foot = lab.scene.bodies[0].mass * 9.81 * np.cos(angle) / 4.0
    lab.put(0, (0.0, 0.0, RADIUS - hertz_rest(foot, effective_youngs_modulus(GRAIN, WALL))), velocity=(speed, 0, 0))
    return lab


def gained(lab, wait, time):
    """Mean acceleration along the plane over ``time`` [s], after ``wait``."""
    lab.run(round(wait / lab.dt))
    first, steps = lab.state()[0, 7], round(time / lab.dt)
    lab.run(steps)
    return (lab.state()[0, 7] - first) / (steps * lab.dt)


@pytest.mark.parametrize("angle", [0.0, 0.2, np.arctan(KINETIC)])
def test_a_sliding_sled_is_slowed_by_kinetic_friction(angle):
    lab = on_slope(angle, speed=1.0)
    expected = 9.81 * (np.sin(angle) - KINETIC * np.cos(angle))
    assert gained(lab, 0.02, 0.1) == pytest.approx(expected, rel=1e-3, abs=2e-3)  # feet share the load unevenly


def test_at_rest_it_holds_up_to_static_friction_and_beyond_slides_with_kinetic():
    """The plane is tilted slowly: a sudden load would swing beyond the limit, and then the friction falls."""
    lab = on_slope(0.0)
    for angle in np.linspace(0.0, np.arctan(0.98 * STATIC), 100):
        lab.batch.set_gravity(0, down(angle))
        lab.run(100)
    assert abs(lab.state()[0, 0]) < 2e-5  # the give of the springs
    angle = np.arctan(1.02 * STATIC)
    lab.batch.set_gravity(0, down(angle))
    expected = 9.81 * (np.sin(angle) - KINETIC * np.cos(angle))
    assert gained(lab, 0.2, 0.1) == pytest.approx(expected, rel=5e-3)


def test_the_limit_falls_exponentially_with_speed():
    """At the speed v₀ = v_c: μ = μ_s (1 − d (1 − 1/e)), read from a fall of the speed by a few per cent."""
    lab = on_slope(0.0, speed=1.0, transition=1.0)
    slowed = gained(lab, 0.0, 0.005)
    middle = 1.0 + slowed * 0.0025
    assert -slowed / 9.81 == pytest.approx(STATIC * (1.0 - DROP * (1.0 - np.exp(-middle))), rel=0.01)
