"""The impact of spheres on a rigid plane, integrated without the solver: the law as its docstring states it, in NumPy.

It tells apart two kinds of difference from a printed curve: an error of the solver (it would differ from this
integration) and another contact law (this integration differs from the curve just as much). Dimensionless: lengths in
units of the elastic depth d, times of d/v_n, forces of m v_n²/d. With z the overlap, u the tangential speed of the
centre, s = r ω and b = 1 − z d/(2 r) the lever arm over the radius,

    z'' = −f,  f = max(0, 5/4 z^(3/2) + c_n √(15/8) z^(1/4) z')          (elastic depth 1 at speed 1)
    u'  = t,  s' = 5/2 b t,  w = u + b s the speed of the contact point
    t   = spring − c_t √(k √z) w within ±μ f,  spring' = −k √z w within ±μ f,  k = 15/8 · 4 G*/E*

and the spring scaled by a/a_prev while z falls. Velocity Verlet with dampings taken at the full step, of predicted
velocities: second order, where the solver's leapfrog takes them half a step late.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from solver.laws.hertz_mindlin import tangential_damping
from solver.laws.restitution import normal_damping
from solver.scenes.material import effective_shear_modulus, effective_youngs_modulus
from solver.verification.chung_ooi import RIGID
from solver.verification.impacts import Impact, Rebound, hertz_depth

STEPS = 2000
"""Per elastic contact time."""


@dataclass(frozen=True)
class Convention:
    """What codes do differently in the tangential law."""

    stiffness: float = 1.0
    """Factor on Mindlin's k_t = 8 G* a."""
    scaled: Literal["on unloading", "never", "always"] = "on unloading"
    """When the spring follows a/a_prev; "always" is the law that keeps a displacement ξ, F = k_t(a) ξ."""
    damped: bool = True
    """Whether the tangential motion is damped."""
    capped: bool = True
    """Whether Coulomb's limit holds for spring and dashpot together, or for the spring alone."""


OURS = Convention()


def integrated(impacts: Sequence[Impact], convention: Convention = OURS) -> list[Rebound]:
    """What becomes of ``impacts``, which share material, restitution and friction."""
    first = impacts[0]
    mu, e_star = first.friction, effective_youngs_modulus(first.material, RIGID)
    stiffness = 7.5 * effective_shear_modulus(first.material, RIGID) / e_star * convention.stiffness
    normal = normal_damping(first.restitution) * math.sqrt(1.875)
    tangential = tangential_damping(first.restitution) * math.sqrt(stiffness) if convention.damped else 0.0
    v_n = np.array([i.v_n for i in impacts])
    depth = np.array([hertz_depth(i.mass, i.v_n, e_star, i.radius) / i.radius for i in impacts])
    u = np.array([i.v_t for i in impacts]) / v_n
    s = np.array([i.surface_speed for i in impacts]) / v_n
    dt = 2.943 / STEPS
    z, speed, before, f = 0.0, 1.0, 0.0, 0.0
    spring, force, arm = np.zeros(len(u)), np.zeros(len(u)), np.ones(len(u))
    while True:
        half = speed - 0.5 * dt * f
        z += dt * half
        if z <= 0.0:
            return [Rebound(-half * v, a * v, b * v) for v, a, b in zip(v_n, u, s, strict=True)]
        u_half, s_half = u + 0.5 * dt * force, s + 1.25 * dt * arm * force
        u_full, s_full = u + dt * force, s + 2.5 * dt * arm * force
        root, arm = math.sqrt(z), 1.0 - 0.5 * depth * z
        f = max(0.0, 1.25 * z * root + normal * math.sqrt(root) * (speed - dt * f))
        if convention.scaled == "always" or (convention.scaled == "on unloading" and z < before):
            spring = spring * math.sqrt(z / before) if before > 0.0 else spring
        trial = spring - stiffness * root * (u_half + arm * s_half) * dt
        spring = np.clip(trial, -mu * f, mu * f)
        damping = np.where(np.abs(trial) > mu * f, 0.0, tangential * math.sqrt(root) * (u_full + arm * s_full))
        force = spring - damping
        if convention.capped:
            force = np.clip(force, -mu * f, mu * f)
        before = z
        speed = half - 0.5 * dt * f
        u, s = u_half + 0.5 * dt * force, s_half + 1.25 * dt * arm * force
