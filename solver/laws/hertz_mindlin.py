"""Hertz–Mindlin (no slip) with viscous damping, tangential history and a Coulomb cap.

Notation: grain i is pushed by j; normal n from j to i; overlap δ > 0 when touching; a = √(R* δ) contact radius.

    normal        F_n = max(0, 4/3 E* a δ − c_n √(2 E* a m*) v_n)            [N]
    tangential    k_t = 8 G* a; elastic force T (stored in the world frame):
                  turned with the normal, its length restored; scaled by a/a_prev on unloading;
                  T ← T − k_t v_t dt, capped at μ F_n
                  F_t = T − c_t √(k_t m*) v_t while sticking, T while slipping; capped at μ F_n as well

Two choices of ``material.py`` are conventions of other programs: ``mindlin`` scales T by a/a_prev on loading too,
which keeps the displacement T/k_t (LIGGGHTS ``tangential history``), and ``uncapped`` leaves the dashpot beside μ F_n.

R* comes from the member spheres, m* from the bodies. c_n(e) inverts this contact exactly (`restitution.py`), so that
the restitution that comes out is the one that was asked for; c_t = 2 √(5/6) |β|, β = ln e / √(ln² e + π²) (Tsuji 1992
as used in LIGGGHTS).
Sources: Hertz 1882; Mindlin & Deresiewicz 1953; rescaling on unloading: Thornton, Cummins & Cleary 2013, Powder
Technology 233:30.
"""

import math

from solver.backend import ti
from solver.laws.restitution import normal_damping
from solver.material import Material, Pair, effective_shear_modulus, effective_youngs_modulus
from solver.state import Vec3


def tangential_damping(restitution: float) -> float:
    """c_t = 2 √(5/6) |ln e| / √(ln² e + π²), dimensionless."""
    log = math.log(restitution)
    return 2.0 * math.sqrt(5.0 / 6.0) * abs(log) / math.sqrt(log * log + math.pi**2)


def constants(one: Material, two: Material, pair: Pair) -> tuple[float, float, float, float, float]:
    """(E* [Pa], G* [Pa], μ, c_n √(2 E*), c_t √(8 G*)) of a pair, in the order the kernel reads them.

    Both dampings are ∝ √(a m*), so the kernel takes one square root for the two.
    """
    e_star, g_star = effective_youngs_modulus(one, two), effective_shear_modulus(one, two)
    return (
        e_star,
        g_star,
        pair.static_friction,
        normal_damping(pair.restitution) * math.sqrt(2.0 * e_star),
        tangential_damping(pair.restitution) * math.sqrt(8.0 * g_star),
    )


@ti.func
def normal_spring_force(law, a, overlap):
    """Elastic normal force 4/3 E* a δ [N]."""
    return 4.0 / 3.0 * law[0] * a * overlap


@ti.func
def normal_damper(law, inertia, a_before, overlap, v_n, dt):
    """Damping force over approach speed [kg/s]; ``inertia`` is √(a m*), ``v_n`` [m/s] is positive while separating.

    ∝ δ^(1/4), steep where the contact begins: in its first step the mean over the way from the touch to half a step
    ahead, 4/5 δ₊^(5/4)/(|v_n| dt), stands for the value at δ.
    """
    damper = law[3] * inertia
    if a_before == 0.0 and v_n < 0.0:
        way = -v_n * dt
        ahead = overlap + 0.5 * way
        damper *= 0.8 * ahead / way * ti.sqrt(ti.sqrt(ahead / overlap))
    return damper


@ti.func
def normal_force(elastic, damper, v_n, v_expected, mass, dt, floor):
    """Normal force F [N], never below ``floor`` (0: never tensile).

    The damper takes the speed in the middle of the step, v_n + dt (F/m* + A)/2.
    A is the acceleration by everything else, known from the last step: dt A = v_n − ``v_expected``, the speed that the
    contact's own force would have led to. A contact at rest, held by others, is thus not damped at all.
    """
    middle = v_n + 0.5 * (v_n - v_expected)
    return ti.max(floor, (elastic - damper * middle) / (1.0 + 0.5 * dt * damper / mass))


@ti.func
def tangential_force(law, a, a_before, spring, n, v_t, inertia, limit, dt, part, displaced, uncapped):
    """New tangential spring [N] and force on i [N], within Coulomb's ``limit`` [N]; ``inertia`` is √(a m*).

    ``part`` is the contact's share in the stiffness and damping of its pair of bodies. If ``displaced``, the spring
    keeps its displacement when the contact area changes, instead of its force while loading; if ``uncapped``, the limit
    holds for the spring alone.
    """
    stiffness = 8.0 * law[1] * a * part
    length2 = spring.dot(spring)
    if length2 > 0.0:
        out_of_plane = spring.dot(n)
        # Shorter by a share s of its square: (1 − s)^-1/2, whose series is exact in double precision for small s.
        share = out_of_plane * out_of_plane / length2
        scale = 1.0 + share * (0.5 + 0.375 * share)
        if share > 1e-6:
            scale = 0.0
            if share < 1.0:
                scale = 1.0 / ti.sqrt(1.0 - share)
        growth = a / a_before
        if displaced == 0:
            growth = ti.min(1.0, growth)
        spring = (spring - out_of_plane * n) * (scale * growth)
    spring -= stiffness * dt * v_t
    size2 = spring.dot(spring)
    force = Vec3(0.0, 0.0, 0.0)
    if size2 > limit * limit:
        spring *= limit / ti.sqrt(size2)
        force = spring
    else:
        force = spring - law[4] * inertia * part * v_t
        total2 = force.dot(force)
        if uncapped == 0 and total2 > limit * limit:
            force *= limit / ti.sqrt(total2)
    return spring, force


@ti.func
def hertz_energy(law, a, overlap):
    """Energy in the normal spring [J]: 8/15 E* a δ²."""
    return 8.0 / 15.0 * law[0] * a * overlap * overlap


@ti.func
def spring_energy(law, spring2, a):
    """Energy in the tangential spring T of a contact of radius ``a`` [J]: T²/(2 k_t), ``spring2`` = T²; 0 apart."""
    energy = 0.0
    if a > 0.0:
        energy = spring2 / (16.0 * law[1] * a)
    return energy


@ti.func
def spring_energy_gain(law, old2, a_before, new2, a):
    """:func:`spring_energy` of the new state less that of the old one [J], with one division."""
    numerator, denominator = new2, 16.0 * law[1] * a
    if a_before > 0.0:
        numerator = new2 * a_before - old2 * a
        denominator *= a_before
    return numerator / denominator
