"""The contact law piece by piece; whole impacts against closed forms stand in tests/solver/verification."""

import numpy as np
import pytest

from solver.backend import ti
from solver.engine.state import Vec3
from solver.laws import HertzMindlin
from solver.laws.hertz_mindlin import tangential_damping
from solver.laws.law import tangential_force
from solver.laws.restitution import normal_damping
from solver.scenes.material import effective_shear_modulus, effective_youngs_modulus
from solver.single_body.free_world import GRAIN, RADIUS, FreeWorld, grain_on_plate

pytestmark = pytest.mark.usefixtures("taichi")

TOUCH = RADIUS + 1e-6


@pytest.mark.parametrize("e", [0.2, 0.5, 0.9])
def test_restitution_between_two_moving_bodies(e):
    lab = FreeWorld(grain_on_plate(restitution=e, friction=0.0), 2, plate=False)
    lab.put(0, (0, 0, TOUCH), velocity=(0.3, 0, -1.0))
    lab.put(1, (0, 0, -TOUCH), velocity=(0.3, 0, 0.5))
    lab.run(int(5e-3 / lab.dt))
    v = lab.state()[:, 7:10]
    assert v[0, 2] - v[1, 2] == pytest.approx(1.5 * e, rel=0.01)
    assert v.sum(axis=0) == pytest.approx([0.6, 0.0, -0.5], abs=1e-12)  # momentum: rounding


def test_damping_constants():
    # γ at e = 0.5 from Thornton et al. 2013: 0.2330; β = 0.2155 (both independent computations).
    assert normal_damping(0.5) / 2 == pytest.approx(0.2330, abs=2e-4)
    assert tangential_damping(0.5) == pytest.approx(2 * np.sqrt(5 / 6) * 0.2155, abs=2e-4)
    assert normal_damping(1.0) == tangential_damping(1.0) == 0.0


ROW = ti.types.struct(**dict.fromkeys(HertzMindlin.columns, ti.f64))


@ti.kernel
def shear(law: ROW, inputs: ti.types.ndarray(dtype=ti.f64, ndim=1), out: ti.types.ndarray(dtype=ti.f64, ndim=1)):
    """The tangential force of Hertz–Mindlin on: a, a_before, spring (3), n (3), v_t (3), mass, limit, dt."""
    for _ in range(1):
        a, a_before, mass = inputs[0], inputs[1], inputs[11]
        old = Vec3(inputs[2], inputs[3], inputs[4])
        n = Vec3(inputs[5], inputs[6], inputs[7])
        v_t = Vec3(inputs[8], inputs[9], inputs[10])
        stiffness, damper = HertzMindlin.shear_stiffness(law, 0.0, a), HertzMindlin.shear_damper(law, 0.0, a, mass)
        growth = HertzMindlin.growth(a, a_before, 0)
        spring, force = tangential_force(stiffness, damper, growth, old, n, v_t, inputs[12], inputs[13], 0)
        for d in ti.static(range(3)):
            out[d] = spring[d]
            out[3 + d] = force[d]


def sheared(spring, n, v_t=(0, 0, 0), a=2e-4, a_before=2e-4, friction=1e3, damping=0.0):
    """New spring and force with G* = 1 MPa, √(a m*) = 1, F_n = 1 N, dt = 1 µs."""
    law = ROW(e_star=0.0, g_star=1e6, friction=friction, normal_damping=0.0, shear_damping=damping)
    out = np.zeros(6)
    shear(law, np.array([a, a_before, *spring, *n, *v_t, 1.0 / a, friction, 1e-6], dtype=float), out)
    return out[:3], out[3:]


def test_mindlin_stiffness_by_hand():
    # k_t = 8 G* a = 8 · 1e6 · 2e-4 = 1600 N/m; ξ = v dt = 1e-6 m in a step.
    spring, force = sheared((0, 0, 0), (0, 0, 1), v_t=(1.0, 0, 0))
    assert spring == pytest.approx([-1.6e-3, 0, 0])
    assert force == pytest.approx(spring)


def test_the_spring_turns_with_the_contact_and_keeps_its_length():
    turned = np.array([np.sin(0.3), 0.0, np.cos(0.3)])
    spring, _ = sheared((5e-3, 2e-3, 0), turned)
    assert spring @ turned == pytest.approx(0.0, abs=1e-18)
    assert np.linalg.norm(spring) == pytest.approx(np.hypot(5e-3, 2e-3))
    assert spring[1] > 0


def test_unloading_scales_the_spring_with_the_contact_radius_and_loading_does_not():
    assert sheared((4e-3, 0, 0), (0, 0, 1), a=1e-4, a_before=2e-4)[0] == pytest.approx([2e-3, 0, 0])
    assert sheared((4e-3, 0, 0), (0, 0, 1), a=2e-4, a_before=1e-4)[0] == pytest.approx([4e-3, 0, 0])


def test_coulomb_caps_the_spring_and_slip_is_not_damped():
    spring, force = sheared((3.0, 4.0, 0), (0, 0, 1), v_t=(1.0, 0, 0), friction=0.5, damping=1.0)
    assert np.linalg.norm(spring) == pytest.approx(0.5)  # μ F_n
    assert force == pytest.approx(spring)
    _, sticking = sheared((0, 0, 0), (0, 0, 1), v_t=(0.1, 0, 0), friction=10.0, damping=1.0)
    assert sticking == pytest.approx([-1.6e-4 - 0.1, 0, 0])  # spring and dashpot


def test_effective_moduli_of_equal_solids():
    e, nu, g = GRAIN.youngs_modulus, GRAIN.poisson_ratio, GRAIN.shear_modulus
    assert effective_youngs_modulus(GRAIN, GRAIN) == pytest.approx(e / (2 * (1 - nu**2)))
    assert effective_shear_modulus(GRAIN, GRAIN) == pytest.approx(g / (2 * (2 - nu)))
