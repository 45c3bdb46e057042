"""Twisting resistance: a torque against rotation about the contact normal (Marshall).

    spring   T ← T − k_w (ω·n) dt,  k_w = ½ k_t a² = 4 G* a³,  capped at ⅔ a μ F_n          [N m]
    torque   T − ½ η_t a² (ω·n),  within the same cap        η_t: the tangential dashpot of the contact law [kg/s]

For s = 1, the cap is the torque of Coulomb friction for a uniform pressure over the contact area (3π/16 = 0.59 in place
of ⅔ for a Hertzian one). The model has no free parameter, so its ``strength`` s scales stiffness, damping and cap
together. Vanishes for s → 0.
Source: Marshall 2009, Journal of Computational Physics 228:1541; LAMMPS `pair granular`, twisting "marshall".
"""

from dataclasses import dataclass

from solver.effects.effect import ContactEffect, Stage, Telltale
from solver.effects.kernel import kernel_function, ti
from solver.params import param


@kernel_function
def twisting_torque(p, m, c):
    """p: s; m: the torque spring about the normal."""
    stiffness = p[0] * 4.0 * c.g_star * c.radius**3
    cap = p[0] * 2.0 / 3.0 * c.radius * c.limit
    rate = c.omega.dot(c.normal)
    m[0] = ti.max(-cap, ti.min(cap, m[0] - stiffness * c.dt * rate))
    torque = m[0] - 0.5 * p[0] * c.shear_damper * c.radius**2 * rate
    c.torque += ti.max(-cap, ti.min(cap, torque)) * c.normal
    return c, m


@dataclass(frozen=True)
class Twisting(ContactEffect):
    """Resistance to rotation about the normal; ``strength`` is the amplitude."""

    strength: float = param(0.0, low=0.0, high=10.0, doc="Strength s; 1 is Coulomb friction over the area.", live=True)

    name = "twisting"
    amplitudes = ("strength",)
    strongest = 10.0
    literature = "1 for smooth spheres (Marshall 2009); up to 10 for contacts wider than Hertz's, such as flats"
    lever = "spin a single body about a vertical axis on the plate"
    telltales = (Telltale.SHAPE, Telltale.FLOW)
    stage = Stage.TWISTING
    act = staticmethod(twisting_torque)
    memory = 1
