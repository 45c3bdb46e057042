"""Rolling resistance: an elastic–plastic torque against rolling (EPSD2 of LIGGGHTS, "type C" of Ai et al.).

    torque spring   T ← T − k_r ω_r dt,  rotated with the normal, capped at μ_r R* F_n      [N m]
    stiffness       k_r = k_t R*²,  k_t = 8 G* a                                            [N m/rad]
    dashpot         −η_r 2 √(I k_r) ω_r while the spring is not at its cap, I = m* R*²       (0 by default)

ω_r is the part of the relative angular velocity perpendicular to the normal. Vanishes for μ_r → 0. A sphere rests on a
slope up to the angle tan⁻¹ μ_r; on a steeper slope α it rolls with an acceleration lowered by 5/7 μ_r g cos α.
Source: Ai, Chen, Rotter & Ooi 2011, Powder Technology 206:269; LIGGGHTS-PUBLIC `rolling_model_epsd2.h`. On member
spheres of clumps it represents what their shape lacks: edges, and roughness finer than a sphere.

:func:`turned_with` and :func:`capped` rotate the spring of a contact with its normal and limit its length.
"""

from dataclasses import dataclass

from solver.effects.effect import ContactEffect, Stage, Telltale
from solver.effects.kernel import kernel_function, ti
from solver.params import param


@kernel_function
def turned_with(spring, n):
    """``spring`` projected onto the plane perpendicular to the new normal ``n``, its length kept."""
    flat = spring - spring.dot(n) * n
    length2, flat2 = spring.dot(spring), flat.dot(flat)
    scale = 0.0
    if flat2 > 0.0:
        scale = ti.sqrt(length2 / flat2)
    return scale * flat


@kernel_function
def capped(vector, limit):
    """``vector``, shortened to the length ``limit`` if it is longer."""
    length2 = vector.dot(vector)
    scale = 1.0
    if length2 > limit * limit:
        scale = limit / ti.sqrt(length2)
    return scale * vector


@kernel_function
def rolling_torque(p, m, c):
    """p: μ_r, η_r; m: the torque spring (3)."""
    n, stiffness = c.normal, 8.0 * c.g_star * c.radius * c.reduced_radius**2
    omega = c.omega - c.omega.dot(n) * n
    spring = turned_with(ti.Vector([m[0], m[1], m[2]]), n) - stiffness * c.dt * omega
    cap = p[0] * c.reduced_radius * ti.max(0.0, c.force + c.pull)
    held = spring.norm_sqr() <= cap * cap
    spring = capped(spring, cap)
    torque = spring
    if held and p[1] > 0.0:
        torque -= p[1] * 2.0 * ti.sqrt(c.mass * stiffness) * c.reduced_radius * omega
    c.torque += torque
    return c, spring


@dataclass(frozen=True)
class RollingResistance(ContactEffect):
    """Elastic–plastic rolling resistance; ``rolling_friction`` is the amplitude."""

    rolling_friction: float = param(0.0, low=0.0, high=1.0, doc="Rolling friction coefficient μ_r.", live=True)
    rolling_damping: float = param(
        0.0, low=0.0, high=1.0, doc="Damping ratio η_r of the rolling spring below its cap.", live=True
    )

    name = "rolling_resistance"
    amplitudes = ("rolling_friction",)
    strongest = 0.3
    literature = "0.01–0.25 in published calibrations of seeds and crop residues; ≤ 0.3"
    lever = "roll a single body off a slope; it acts at every mass and size alike"
    telltales = (Telltale.SHAPE, Telltale.FLOW)
    stage = Stage.ROLLING
    act = staticmethod(rolling_torque)
    memory = 3
