"""Hertz–Mindlin (no slip) with viscous damping, tangential history and a Coulomb cap.

Notation: grain i is pushed by j; normal n from j to i; overlap δ > 0 when touching; a = √(R* δ) contact radius.

    normal        F_n = max(0, 4/3 E* a δ − c_n √(2 E* a m*) v_n)            [N]
    tangential    k_t = 8 G* a; elastic force T (stored in the world frame):
                  turned with the normal, its length restored; scaled by a/a_prev on unloading;
                  T ← T − k_t v_t dt, capped at μ F_n
                  F_t = T − c_t √(k_t m*) v_t while sticking, T while slipping

R* comes from the member spheres, m* from the bodies. c_n = 2 γ(e) with the polynomial of Thornton, Cummins & Cleary
(2013, Powder Technology 233:30) for a force that is never tensile, so that the restitution that comes out is the one
that was asked for; c_t = 2 √(5/6) |β|, β = ln e / √(ln² e + π²) (Tsuji 1992 as used in LIGGGHTS).
Sources: Hertz 1882; Mindlin & Deresiewicz 1953; rescaling on unloading: Thornton et al. 2013.
"""

import math

from solver.backend import ti
from solver.material import Material, Pair, effective_shear_modulus, effective_youngs_modulus
from solver.state import Vec3

THORNTON = (
    -6.918798,
    -16.41105,
    146.8049,
    -796.4559,
    2928.711,
    -7206.864,
    11494.29,
    -11342.18,
    6276.757,
    -1489.915,
)
"""h₁ … h₁₀ of α(e) = e (h₁ + e (h₂ + …)) (Thornton, Cummins & Cleary 2013)."""


def normal_damping(restitution: float) -> float:
    """c_n = 2 γ, γ = √(1/(1 − (1+e)² exp α(e)) − 1), dimensionless; 0 for e = 1."""
    if restitution >= 1.0:
        return 0.0
    alpha = 0.0
    for h in reversed(THORNTON):
        alpha = restitution * (h + alpha)
    return 2.0 * math.sqrt(max(0.0, 1.0 / (1.0 - (1.0 + restitution) ** 2 * math.exp(alpha)) - 1.0))


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
def normal_damping_force(law, inertia, v_n):
    """Damping force [N]; ``inertia`` is √(a m*), ``v_n`` [m/s] is positive while separating."""
    return -law[3] * inertia * v_n


@ti.func
def tangential_force(law, a, a_before, spring, n, v_t, inertia, f_n, dt):
    """New tangential spring [N] and the tangential force on i [N]; ``inertia`` is √(a m*)."""
    stiffness = 8.0 * law[1] * a
    length2 = spring.dot(spring)
    if length2 > 0.0:
        turned = spring - spring.dot(n) * n
        flat2 = turned.dot(turned)
        scale = 0.0
        if flat2 > 0.0:
            scale = ti.sqrt(length2 / flat2)
        if a < a_before:
            scale *= a / a_before
        spring = turned * scale
    spring -= stiffness * dt * v_t
    limit = law[2] * f_n
    size2 = spring.dot(spring)
    force = Vec3(0.0, 0.0, 0.0)
    if size2 > limit * limit:
        spring *= limit / ti.sqrt(size2)
        force = spring
    else:
        force = spring - law[4] * inertia * v_t
        total2 = force.dot(force)
        if total2 > limit * limit:
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
