"""One contact at a time, against closed forms."""

import numpy as np
import pytest

from solver.backend import ti
from solver.body import Body, Members
from solver.laboratory import EARTH, GRAIN, RADIUS, WALL, Laboratory, bench
from solver.laws.hertz_mindlin import normal_damping, tangential_damping, tangential_force
from solver.material import effective_shear_modulus, effective_youngs_modulus
from solver.state import Vec3, Vec5

pytestmark = pytest.mark.usefixtures("taichi")

TOUCH = RADIUS + 1e-6


@pytest.mark.parametrize("e", [0.2, 0.3, 0.5, 0.7, 0.9, 0.98])
def test_restitution_against_the_plate_comes_out_as_it_went_in(e):
    lab = Laboratory(bench(restitution=e, friction=0.0), 1)
    lab.put(0, (0, 0, TOUCH), velocity=(0, 0, -1.0))
    lab.run(int(5e-3 / lab.dt))
    # 0.75 % is the printed polynomial's own error at 0.2 and 0.98; the rest is the time step's.
    assert lab.state()[0, 9] == pytest.approx(e, rel=0.01)


@pytest.mark.parametrize("e", [0.2, 0.5, 0.9])
def test_restitution_between_two_moving_bodies(e):
    lab = Laboratory(bench(restitution=e, friction=0.0), 2, plate=False)
    lab.put(0, (0, 0, TOUCH), velocity=(0.3, 0, -1.0))
    lab.put(1, (0, 0, -TOUCH), velocity=(0.3, 0, 0.5))
    lab.run(int(5e-3 / lab.dt))
    v = lab.state()[:, 7:10]
    assert v[0, 2] - v[1, 2] == pytest.approx(1.5 * e, rel=0.01)
    assert v.sum(axis=0) == pytest.approx([0.6, 0.0, -0.5], abs=1e-12)  # momentum: rounding


def test_hertz_impact_depth_force_and_duration():
    lab = Laboratory(bench(restitution=1.0, friction=0.0), 1, fraction=0.02)
    speed, mass = 1.0, lab.scene.bodies[0].mass
    lab.put(0, (0, 0, RADIUS), velocity=(0, 0, -speed))
    height, velocity = [], []
    while not velocity or velocity[-1] < 0.999 * speed:
        lab.run(1)
        row = lab.state()[0]
        height.append(row[2])
        velocity.append(row[9])
    e_star = effective_youngs_modulus(GRAIN, WALL)
    depth = (15 * mass * speed**2 / (16 * e_star * np.sqrt(RADIUS))) ** 0.4
    force = 4 / 3 * e_star * np.sqrt(RADIUS) * depth**1.5
    # Leapfrog is second order: about (dt/t_contact)², 38 steps per contact.
    assert RADIUS - min(height) == pytest.approx(depth, rel=2e-3)
    assert np.diff(velocity).max() / lab.dt * mass == pytest.approx(force, rel=5e-3)
    assert len(height) * lab.dt == pytest.approx(2.943 * depth / speed, rel=0.02)  # end seen to one step in 40


def test_damping_constants():
    # γ at e = 0.5 from Thornton et al. 2013: 0.2330; β = 0.2155 (both independent computations).
    assert normal_damping(0.5) / 2 == pytest.approx(0.2330, abs=2e-4)
    assert tangential_damping(0.5) == pytest.approx(2 * np.sqrt(5 / 6) * 0.2155, abs=2e-4)
    assert normal_damping(1.0) == tangential_damping(1.0) == 0.0


@ti.kernel
def shear(inputs: ti.types.ndarray(dtype=ti.f64, ndim=1), out: ti.types.ndarray(dtype=ti.f64, ndim=1)):
    """tangential_force on: law (5), a, a_before, spring (3), n (3), v_t (3), inertia, f_n, dt."""
    for _ in range(1):
        law = Vec5(inputs[0], inputs[1], inputs[2], inputs[3], inputs[4])
        old = Vec3(inputs[7], inputs[8], inputs[9])
        n = Vec3(inputs[10], inputs[11], inputs[12])
        v_t = Vec3(inputs[13], inputs[14], inputs[15])
        spring, force = tangential_force(law, inputs[5], inputs[6], old, n, v_t, inputs[16], inputs[17], inputs[18])
        for d in ti.static(range(3)):
            out[d] = spring[d]
            out[3 + d] = force[d]


def sheared(spring, n, v_t=(0, 0, 0), a=2e-4, a_before=2e-4, friction=1e3, damping=0.0):
    """New spring and force with G* = 1 MPa, √(a m*) = 1, F_n = 1 N, dt = 1 µs."""
    inputs = [0.0, 1e6, friction, 0.0, damping, a, a_before, *spring, *n, *v_t, 1.0, 1.0, 1e-6]
    out = np.zeros(6)
    shear(np.array(inputs, dtype=float), out)
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


def test_sliding_sphere_ends_up_rolling_at_five_sevenths():
    lab = Laboratory(bench(friction=0.3, restitution=0.5, gravity=EARTH), 1)
    lab.put(0, (0, 0, RADIUS), velocity=(0.5, 0, 0))
    lab.run(int(0.15 / lab.dt))
    row = lab.state()[0]
    # 5/7 v₀ for a solid sphere whatever the friction law; 0.2 %: it bounces a little while it settles on the plate.
    assert row[7] == pytest.approx(0.5 * 5 / 7, rel=2e-3)
    assert row[11] == pytest.approx(row[7] / RADIUS, rel=1e-2)


def test_sliding_decelerates_by_coulomb_friction():
    lab = Laboratory(bench(friction=0.3, gravity=EARTH), 1)
    depth = (3 * lab.scene.bodies[0].mass * 9.81 / (4 * effective_youngs_modulus(GRAIN, WALL) * RADIUS**0.5)) ** (2 / 3)
    lab.put(0, (0, 0, RADIUS - depth), velocity=(1.0, 0, 0))
    lab.run(int(0.05 / lab.dt))
    elapsed = int(0.05 / lab.dt) * lab.dt
    # Slides throughout (rolling starts after 2 v₀/(7 μ g) = 97 ms). The spring's first stretch costs < 0.1 %.
    assert 1.0 - lab.state()[0, 7] == pytest.approx(0.3 * 9.81 * elapsed, rel=5e-3)


def test_oblique_impact_that_slides_throughout():
    mu, e, v_n = 0.1, 0.5, 0.5
    lab = Laboratory(bench(friction=mu, restitution=e), 1)
    v_t = 2.0 * 3.5 * mu * (1 + e) * v_n
    lab.put(0, (0, 0, TOUCH), velocity=(v_t, 0, -v_n))
    lab.run(int(5e-3 / lab.dt))
    row = lab.state()[0]
    # Impulses: Δv_t = μ (1+e) v_n, ω = 5/2 μ (1+e) v_n / r (Chung & Ooi 2011, test 4); 1 %: restitution's own error.
    assert v_t - row[7] == pytest.approx(mu * (1 + e) * v_n, rel=0.01)
    assert row[11] == pytest.approx(2.5 * mu * (1 + e) * v_n / RADIUS, rel=0.01)


@pytest.mark.parametrize(("slope", "holds"), [(0.9, True), (1.1, False)])
def test_body_on_a_slope_holds_below_the_friction_angle(slope, holds):
    """A tripod of three spheres on a tilted plate (gravity turned): the static branch of the tangential spring."""
    mu = 0.5
    angle = slope * np.arctan(mu)
    centres = tuple((0.01 * np.cos(a), 0.01 * np.sin(a), 0.0) for a in (0.0, 2.0944, 4.1888))
    tripod = Body("grain", "grain", 1.0, Members(centres, (RADIUS,) * 3, 4e-3, (2e-7, 2e-7, 4e-7)), GRAIN.density)
    gravity = (9.81 * np.sin(angle), 0.0, -9.81 * np.cos(angle))
    lab = Laboratory(bench(tripod, friction=mu, restitution=0.3, gravity=gravity), 1)
    lab.put(0, (0, 0, RADIUS))
    lab.run(int(0.4 / lab.dt))
    start = lab.state()[0, 0]
    lab.run(int(0.4 / lab.dt))
    slid = lab.state()[0, 0] - start
    if holds:
        assert abs(slid) < 1e-7  # no creep: the spring carries the weight
    else:
        expected = 9.81 * (np.sin(angle) - mu * np.cos(angle))
        assert slid == pytest.approx(expected * (0.8**2 - 0.4**2) / 2, rel=0.05)  # 5 %: it starts after a short drop
