"""The adhesive contact against its closed form: radius, the curve of approach and retraction, pull-off, equilibrium."""

import numpy as np
import pytest
from scipy.optimize import brentq

from solver.backend import ti
from solver.effects.jkr_contact import grip, pulls, root
from solver.scenes.material import effective_youngs_modulus
from solver.single_body.free_world import GRAIN, RADIUS, WALL, FreeWorld, sphere
from tests.solver.effects.cases import felt, heavy, scene_with

pytestmark = pytest.mark.usefixtures("taichi")

WORK = 2.0
E_STAR = effective_youngs_modulus(GRAIN, WALL)
PULL_OFF = 1.5 * np.pi * WORK * RADIUS
LEAST = (2.0 * np.pi * WORK * RADIUS**2 / (16.0 * E_STAR)) ** (1.0 / 3.0)
PART = 3.0 * LEAST**2 / RADIUS
"""Distance at which the surfaces part."""


def overlap_of(a, w=WORK, e_star=E_STAR, radius=RADIUS):
    return a**2 / radius - np.sqrt(2.0 * np.pi * w * a / e_star)


def force_of(a):
    return 4.0 * E_STAR * a**3 / (3.0 * RADIUS) - np.sqrt(8.0 * np.pi * WORK * E_STAR * a**3)


def force_at(overlap):
    """The closed form, with the contact radius by bisection on the stable branch."""
    a = brentq(lambda a: overlap_of(a) - overlap, LEAST, 100.0 * LEAST, xtol=1e-18, rtol=1e-14)
    return force_of(a)


@ti.kernel
def radii(inputs: ti.types.ndarray(dtype=ti.f64, ndim=2), out: ti.types.ndarray(dtype=ti.f64, ndim=1)):
    """Contact radius for rows of w, E*, R*, overlap, last contact radius; 0 where the surfaces have parted."""
    for j in range(out.shape[0]):
        k = ti.sqrt(2.0 * np.pi * inputs[j, 0] / inputs[j, 1])
        out[j] = 0.0
        if pulls(k, inputs[j, 2], inputs[j, 3]):
            out[j] = root(k, inputs[j, 2], inputs[j, 3], inputs[j, 4]) ** 2


@pytest.mark.parametrize("before", [0.0, 0.1, 0.99, 1.0, 1.01, 10.0])
def test_contact_radius_against_root_finding(before):
    """Works 1e-6 … 50 J/m², moduli 1e5 … 1e11 Pa, radii 10 µm … 50 mm; overlaps from parting to 1e5 of that.

    ``before`` is the last contact radius as a share of the present one: whence the root is found may not matter.
    """
    rng = np.random.default_rng(1)
    n = 400
    w, e, r = (10.0 ** rng.uniform(*ends, n) for ends in ((-6, 1.7), (5, 11), (-5, -1.3)))
    units = (2.0 * np.pi * w * r**2 / (16.0 * e)) ** (2.0 / 3.0) / r
    share = np.concatenate([rng.uniform(-2.9999, 3.0, n // 2), 10.0 ** rng.uniform(0, 5, n // 2)])

    def expected(d):  # dimensionless: a/a_c
        return brentq(lambda x: x**2 - 4.0 * np.sqrt(x) - d, 1.0, 2.0 * np.sqrt(abs(d)) + 4.0, xtol=1e-15, rtol=1e-15)

    a = np.sqrt(units * r) * [expected(d) for d in share]
    out = np.zeros(n)
    radii(np.column_stack([w, e, r, share * units, before * a]), out)
    # Towards parting the root is a double one: rounding 1e-16 moves it by up to 1e-8/√(3 + d).
    assert out == pytest.approx(a, rel=1e-9)


def test_surfaces_part_at_three_units():
    """The units a_c²/R* are exact to rounding, so a hair on either side of −3 decides."""
    w, e, r = WORK, E_STAR, RADIUS
    rows = [(w, e, r, -share * LEAST**2 / r, LEAST) for share in (2.999999, 3.000001, 30.0)]
    out = np.zeros(3)
    radii(np.array(rows), out)
    assert out[0] > LEAST
    assert not out[1:].any()


@pytest.fixture(scope="module")
def curve(taichi):
    """A heavy sphere goes down on the plane and up again at 1 mm/s: (overlap, force on it) of the two ways."""
    lab = FreeWorld(
        scene_with(felt("adhesion_jkr", work_of_adhesion=WORK), bodies=(heavy(1e6),), friction=0.0, restitution=1.0),
        1,
        dt=1e-5,
    )
    speed, deepest = 1e-3, 4.0 * PART

    def along(start, stop):
        rows = []
        direction = np.sign(stop - start)
        lab.put(0, (0.0, 0.0, RADIUS - start), velocity=(0.0, 0.0, -speed * direction))
        for _ in range(round(abs(stop - start) / (speed * lab.dt) / 4)):
            lab.run(4)
            z = lab.state()[0, 2] + direction * speed * lab.dt  # where it was when the force acted
            rows.append((RADIUS - z, -lab.batch.surface_state(0)[0, 15]))
        return np.array(rows)

    return along(-2.0 * PART, deepest), along(deepest, -2.0 * PART)


def test_no_force_before_the_surfaces_meet(curve):
    down, _ = curve
    apart = down[:, 0] < 0.0
    assert apart.sum() > 50
    assert not down[apart, 1].any()


def test_the_curve_of_approach_and_retraction(curve):
    for way, low in zip(curve, (0.0, -PART), strict=True):
        inside = way[:, 0] > low * (1.0 - 1e-3) + 1e-9
        assert inside.sum() > 100
        expected = np.array([force_at(overlap) for overlap in way[inside, 0]])
        # The heavy sphere still gives in by 1e-6 of its speed; towards parting a tiny distance is a large force.
        assert way[inside, 1] == pytest.approx(expected, abs=1e-4 * PULL_OFF)


def test_pull_off_force_and_where_it_parts(curve):
    _, up = curve
    assert -up[:, 1].min() == pytest.approx(PULL_OFF, rel=1e-4)  # the grid of overlaps is fine there: a flat minimum
    held = up[up[:, 1] != 0.0]
    assert -held[-1, 0] == pytest.approx(PART, abs=5e-8)  # a sample
    assert force_of(LEAST) == pytest.approx(-5.0 / 9.0 * PULL_OFF)
    assert held[-1, 1] == pytest.approx(force_at(held[-1, 0]), rel=2e-3)  # the root is steep there
    assert grip(WORK, E_STAR, RADIUS) == pytest.approx(PART)


def test_equilibrium_without_load():
    """a³ = 9 π w R²/(2 E*) where the force is zero."""
    lab = FreeWorld(scene_with(felt("adhesion_jkr", work_of_adhesion=WORK), restitution=0.2), 1)
    a = (9.0 * np.pi * WORK * RADIUS**2 / (2.0 * E_STAR)) ** (1.0 / 3.0)
    lab.put(0, (0.0, 0.0, RADIUS - 0.5 * overlap_of(a)))
    lab.run(round(0.2 / lab.dt))
    assert RADIUS - lab.state()[0, 2] == pytest.approx(overlap_of(a), rel=1e-6)


def test_two_works_of_adhesion_on_a_wall_add_up():
    """Half by ``adhesion_jkr`` and half by ``wall_adhesion`` holds a sphere as the whole by one of them."""
    a = (9.0 * np.pi * WORK * RADIUS**2 / (2.0 * E_STAR)) ** (1.0 / 3.0)
    halves = (felt("adhesion_jkr", work_of_adhesion=0.5 * WORK), felt("wall_adhesion", work_of_adhesion=0.5 * WORK))
    lab = FreeWorld(scene_with(*halves, restitution=0.2), 1)
    lab.put(0, (0.0, 0.0, RADIUS - 0.5 * overlap_of(a)))
    lab.run(round(0.2 / lab.dt))
    assert RADIUS - lab.state()[0, 2] == pytest.approx(overlap_of(a), rel=1e-6)


@pytest.mark.parametrize(("weight", "holds"), [(0.95, True), (1.05, False)])
def test_it_holds_a_weight_up_to_the_pull_off_force(weight, holds):
    """A sphere under a ceiling, whose weight grows slowly to a part of 3/2 π w R."""
    scene = scene_with(felt("adhesion_jkr", work_of_adhesion=WORK), turn=(0.0, 1.0, 0.0, 0.0), restitution=0.2)
    lab = FreeWorld(scene, 1)
    lab.put(0, (0.0, 0.0, -RADIUS + 1e-6))
    for share in np.linspace(0.0, weight, 100):
        lab.batch.set_gravity(0, (0.0, 0.0, -share * PULL_OFF / sphere().mass))
        lab.run(200)
    lab.run(4000)
    fallen = -RADIUS - lab.state()[0, 2]
    assert fallen < PART if holds else fallen > RADIUS


def test_friction_under_tension():
    """Thornton's limit μ (F + 2 F_c): a weightless sphere that sticks to the plane is dragged with μ 2 F_c.

    It spins about a horizontal axis; the torque is that limit times R until it rolls.
    """
    friction = 0.3
    lab = FreeWorld(
        scene_with(felt("adhesion_jkr", work_of_adhesion=WORK), friction=friction, restitution=0.2), 1, fraction=0.02
    )
    a = (9.0 * np.pi * WORK * RADIUS**2 / (2.0 * E_STAR)) ** (1.0 / 3.0)
    lab.put(0, (0.0, 0.0, RADIUS - overlap_of(a)), spin=(0.0, 400.0, 0.0))
    lab.run(round(1e-3 / lab.dt))
    one = lab.state()[0, 7]
    lab.run(round(2e-3 / lab.dt))
    slope = (lab.state()[0, 7] - one) / (round(2e-3 / lab.dt) * lab.dt)
    assert slope * sphere().mass == pytest.approx(friction * 2.0 * PULL_OFF, rel=0.01)
