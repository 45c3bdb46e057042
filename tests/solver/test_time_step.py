"""The time step that is taken, and the one that would be too long."""

import numpy as np
import pytest

from solver.laboratory import ROOM, bench
from solver.layout import layout
from solver.material_file import load_material
from solver.scene import with_values
from solver.time_step import rayleigh_time, stability_limit, time_step
from solver.world import Batch

SCENE = with_values(load_material("sunflower_extract"), {"body.spheres": "coarse"})


def test_the_limit_is_the_step_without_its_safety():
    assert time_step(SCENE) < stability_limit(SCENE)
    for body in SCENE.bodies:
        smallest = float(body.clump.radii.min())
        assert stability_limit(SCENE) <= rayleigh_time(smallest, SCENE.material(body.material))


@pytest.mark.parametrize(("share", "stable"), [(0.5, True), (4.0, False)])
def test_an_impact_gains_energy_only_beyond_the_limit(taichi, share, stable):
    """At 2 m/s, the speed that the limit of a body is taken at."""
    scene = bench(gravity=(0.0, 0.0, -9.81), friction=0.0)
    batch = Batch(ROOM)
    dt = share * stability_limit(scene)
    batch.load(0, scene, layout(scene, np.zeros(1, dtype=np.int32)), dt, (True,))
    radius = float(scene.bodies[0].clump.radii[0])
    start = np.array([0.0, 0.0, radius + 1e-6])
    batch.enter(0, 0, start, np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, -2.0]), np.zeros(3))
    batch.advance(np.array([round(0.02 / dt)], dtype=np.int32))
    speed = float(np.linalg.norm(batch.bodies(0, 1)[0, 7:10]))
    # It cannot come back faster than it went; 1 % for the error of the step.
    assert (speed <= 2.0 * 1.01) == stable
