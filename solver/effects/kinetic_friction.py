"""Kinetic friction below static friction: the Coulomb limit falls with the sliding speed.

    μ(v) = μ_s [1 − d (1 − exp(−|v_t|/v_c))]        μ_k = (1 − d) μ_s

v_c is the speed of the transition. Vanishes for a drop d → 0. On an inclined plane a body starts to slide at tan⁻¹ μ_s
and, once it slides, keeps sliding down to tan⁻¹ μ_k.
Source: exponential form of Bo & Pavelescu 1982, Wear 82:277 (in LAMMPS- and Abaqus-type codes "exponential decay").
"""

from dataclasses import dataclass

from solver.effects.effect import ContactEffect, Stage, Telltale
from solver.effects.kernel import kernel_function, ti
from solver.params import param


@kernel_function
def lowered_limit(p, m, c):
    """p: d, v_c."""
    c.limit *= 1.0 - p[0] * (1.0 - ti.exp(-c.v_t.norm() / p[1]))
    return c, m


@dataclass(frozen=True)
class KineticFriction(ContactEffect):
    """Kinetic friction μ_k = (1 − friction_drop) μ_s; ``friction_drop`` is the amplitude."""

    friction_drop: float = param(0.0, low=0.0, high=0.9, doc="Drop d = 1 − μ_k/μ_s.", live=True)
    transition_speed: float = param(
        0.01, unit="m/s", low=1e-4, high=1.0, doc="Sliding speed v_c of the transition.", live=True, scale="log"
    )

    name = "kinetic_friction"
    amplitudes = ("friction_drop",)
    strongest = 0.5
    literature = "μ_k/μ_s = 0.5–0.9 for seeds and grains on metal and on themselves"
    lever = "inclined plane: the angle at which a sliding body stops, beside the one at which it starts"
    telltales = (Telltale.FLOW,)
    stage = Stage.TANGENTIAL
    act = staticmethod(lowered_limit)
