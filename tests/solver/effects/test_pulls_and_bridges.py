"""Pull by area and liquid bridges: forces at given distances, where bridges form and break, and YADE's number."""

import numpy as np
import pytest

from solver.scenes.material import effective_youngs_modulus
from solver.single_body.free_world import GRAIN, RADIUS, WALL, FreeWorld
from tests.solver.effects.cases import felt, heavy, scene_with

pytestmark = pytest.mark.usefixtures("taichi")

E_STAR = effective_youngs_modulus(GRAIN, WALL)


def test_pull_by_area_rests_where_both_forces_agree():
    """4/3 E* √R δ^{3/2} = 2π k R δ at δ = (3π k √R/(2 E*))²."""
    density = 2e5
    lab = FreeWorld(scene_with(felt("adhesion_sjkr", cohesion_energy_density=density), restitution=0.2), 1)
    rest = (3.0 * np.pi * density * np.sqrt(RADIUS) / (2.0 * E_STAR)) ** 2
    lab.put(0, (0.0, 0.0, RADIUS - 0.7 * rest))
    lab.run(round(0.3 / lab.dt))
    assert RADIUS - lab.state()[0, 2] == pytest.approx(rest, rel=1e-4)


def moved(effect, start, stop, speed, chunk, body=None, seconds_per_step=1e-5):
    """A heavy sphere moves along the normal of the plane from one gap to another: rows of (gap, force on it)."""
    lab = FreeWorld(
        scene_with(effect, bodies=(body or heavy(1e6),), friction=0.0, restitution=1.0), 1, dt=seconds_per_step
    )
    return lab, along(lab, start, stop, speed, chunk)


def along(lab, start, stop, speed, chunk):
    direction = np.sign(stop - start)
    lab.put(0, (0.0, 0.0, RADIUS + start), velocity=(0.0, 0.0, direction * speed))
    rows = []
    for _ in range(round(abs(stop - start) / (speed * lab.dt * chunk))):
        lab.run(chunk)
        z = lab.state()[0, 2] - direction * speed * lab.dt  # where it was when the force acted
        rows.append((z - RADIUS, -lab.batch.surface_state(0)[0, 15]))
    return np.array(rows)


def test_pull_by_area_over_the_overlap():
    density = 1e6
    _, rows = moved(felt("adhesion_sjkr", cohesion_energy_density=density), 1e-6, -2e-5, 1e-3, 10)
    overlap = np.maximum(-rows[:, 0], 0.0)
    expected = 4.0 / 3.0 * E_STAR * np.sqrt(RADIUS) * overlap**1.5 - 2.0 * np.pi * density * RADIUS * overlap
    assert expected.min() < -0.05  # tensile somewhere
    assert rows[:, 1] == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())  # the sphere gives in a little


TENSION, VOLUME, ANGLE = 0.072, 1e-9, 0.4
BRIDGE = {"surface_tension": TENSION, "bridge_volume": VOLUME, "contact_angle": ANGLE}


@pytest.fixture(scope="module")
def bridge(taichi):
    """A heavy sphere comes down to the plane and goes up again beyond the rupture of the bridge."""
    lab, down = moved(felt("capillary_bridge", **BRIDGE), 1.5e-3, -1e-6, 0.01, 25)
    return down, along(lab, -1e-6, 2e-3, 0.01, 25)


def willett(gap, radius):
    s = 0.5 * gap * np.sqrt(radius / VOLUME)
    return 2.0 * np.pi * radius * TENSION * np.cos(ANGLE) / (1.0 + 2.1 * s + 10.0 * s**2)


def test_a_bridge_forms_on_touching_and_breaks_at_willetts_distance(bridge):
    down, up = bridge
    radius = 2.0 * RADIUS  # Derjaguin: two spheres of that radius
    before = down[:, 0] > 0.0
    assert before.sum() > 100
    assert not down[before, 1].any()
    reduced = (VOLUME / radius**3) ** (1.0 / 3.0)
    rupture = (1.0 + ANGLE / 2.0) * (reduced + 0.1 * reduced**2) * radius
    held = up[(up[:, 1] < 0.0) & (up[:, 0] > 0.0)]
    assert held[-1, 0] == pytest.approx(rupture, abs=3e-6)  # a sample
    assert held[:, 1] == pytest.approx(-willett(held[:, 0], radius), rel=1e-6)
    assert not up[up[:, 0] > rupture + 3e-6, 1].any()
    assert felt("capillary_bridge", **BRIDGE).grip(E_STAR, RADIUS) == pytest.approx(rupture)


def test_willetts_number_of_yade():
    """6.78192e-7 N of YADE's `checkCapillaryModels` (radii 19 and 32.5 µm, γ 24 mN/m, V 12e-19 m³, θ 10°).

    Its spheres begin with an overlap of 1e-5 of the distance and part at 1 mm/s; the force is that after 249 moves of
    1 µs. Ours weigh 1 kg, so the pull shows in the velocity alone: to 3e-7 of itself in double precision.
    """
    effect = felt("capillary_bridge", surface_tension=0.024, bridge_volume=12e-19, contact_angle=np.radians(10.0))
    bodies = (heavy(1.0, 19e-6, "small"), heavy(1.0, 32.5e-6, "big"))
    lab = FreeWorld(scene_with(effect, bodies=bodies, friction=0.0, restitution=1.0), (0, 1), dt=1e-6, plate=False)
    lab.put(0, (0.0, 0.0, 0.0))
    lab.put(1, (0.0, 0.0, (19e-6 + 32.5e-6) * 0.99999), velocity=(0.0, 0.0, 1e-3))
    lab.run(249)
    before = lab.state()[1, 9] - lab.state()[0, 9]
    lab.run(1)
    force = 0.5 * (before - (lab.state()[1, 9] - lab.state()[0, 9])) / lab.dt
    assert force == pytest.approx(6.78192e-7, rel=1e-4)  # YADE's own tolerance


def test_bridges_of_small_spheres_are_looked_for_far_enough():
    """In terms of its radius a small sphere's bridge is long: the reach of the list is that of the smallest."""
    from solver.effects.columns import reach_of_pulls

    effect = felt("capillary_bridge", **BRIDGE)
    small, big = heavy(1.0, 4e-4, "small"), heavy(1.0, RADIUS, "big")
    scene = scene_with(effect, bodies=(small, big))
    pairs = [(4e-4, 4e-4), (4e-4, RADIUS), (RADIUS, RADIUS)]
    longest = max(effect.grip(E_STAR, a * b / (a + b)) for a, b in pairs)
    longest = max(longest, effect.grip(E_STAR, 4e-4), effect.grip(E_STAR, RADIUS))
    assert longest == pytest.approx(effect.grip(E_STAR, 2e-4))
    assert reach_of_pulls(scene, ("wall",)) >= longest
