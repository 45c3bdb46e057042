"""The energy account of small pours with each effect: what was put in moves, is lifted, is stored, or is lost.

The elastic part is Hertz's and Mindlin's; the work of everything else that effects do, a pull's and a rolling spring's
among it, stands in ``dissipated``. What is missing comes from the time step, 0.3 of the Rayleigh time here.
"""

import dataclasses

import numpy as np
import pytest

from solver.scenes.body import Body, Members
from solver.single_body.free_world import EARTH, GRAIN, RADIUS, FreeWorld
from tests.solver.effects.cases import IN_KERNELS, all_felt, felt, scene_with, with_effects

pytestmark = pytest.mark.usefixtures("taichi")

LIMIT = 0.01
N = 18
MASS = 1.2e-3


def pin():
    """Two spheres side by side."""
    members = Members(
        ((-0.6 * RADIUS, 0.0, 0.0), (0.6 * RADIUS, 0.0, 0.0)), (0.8 * RADIUS,) * 2, MASS, (8e-9, 2e-8, 2e-8)
    )
    return Body("grain", "grain", 1.0, members, GRAIN.density)


PLAIN = scene_with(bodies=(pin(),), gravity=EARTH)


def poured(scene, sleep_speed=2e-3):
    """18 pins are dropped in three layers and come to rest, or nearly: samples of the account, what was put in."""
    scene = dataclasses.replace(scene, numerics=dataclasses.replace(scene.numerics, sleep_speed=sleep_speed))
    lab = FreeWorld(scene, N, fraction=0.3)
    rng, put_in = np.random.default_rng(4), 0.0
    for b in range(N):
        place = RADIUS * np.array([3.2 * (b % 3 - 1), 2.4 * (b // 3 % 2), 3.0 + 3.0 * (b // 6)])
        velocity = rng.normal(0.0, 0.2, 3)
        lab.put(b, place, velocity, rng.normal(0.0, 10.0, 3))
    put_in = sum(lab.batch.measure(0)[0, :3])
    rows = [lab.run(round(0.01 / lab.dt)) for _ in range(60)]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}, put_in


def missing(samples, put_in, without=None):
    terms = [name for name in ("kinetic", "potential", "elastic", "dissipated") if name != without]
    return (sum(samples[name] for name in terms) - put_in) / put_in


@pytest.mark.parametrize("name", IN_KERNELS)
def test_the_account_closes(name):
    samples, put_in = poured(with_effects(PLAIN, felt(name)))
    assert samples["touching"][-1] >= N
    assert np.abs(missing(samples, put_in)).max() < LIMIT


def test_the_account_closes_with_all_of_them():
    samples, put_in = poured(all_felt(PLAIN))
    assert np.abs(missing(samples, put_in)).max() < LIMIT
    assert np.abs(missing(samples, put_in, without="dissipated")).max() > 10.0 * LIMIT
