"""Adhesion to the walls only (JKR; formulas in ``jkr_contact.py``): sticky or charged surfaces, clean bodies.

    F = F_JKR(δ; w + w')  at walls,  F_JKR(δ; w') between bodies     w': that of ``adhesion_jkr``

Vanishes for a work of adhesion w → 0. Bodies stick to the funnel's wall, and the foot of the pile is held.
Source: as ``adhesion_jkr``.
"""

from dataclasses import dataclass

from solver.effects.effect import ContactEffect, Stage, Telltale
from solver.effects.jkr_contact import adhere, grip
from solver.effects.kernel import kernel_function
from solver.params import param


@kernel_function
def stick_to_wall(p, m, c):
    """p: w."""
    return adhere(p[0], c), m


@dataclass(frozen=True)
class WallAdhesion(ContactEffect):
    """JKR adhesion between bodies and walls; ``work_of_adhesion`` is the amplitude."""

    work_of_adhesion: float = param(
        0.0, unit="J/m2", low=0.0, high=50.0, doc="Work of adhesion w between bodies and walls.", live=True
    )

    name = "wall_adhesion"
    amplitudes = ("work_of_adhesion",)
    strongest = 5.0
    literature = "0.1–5 J/m² between moist plant material and steel"
    lever = "another plate and funnel material; what is left in the funnel"
    telltales = (Telltale.SHAPE, Telltale.FLOW)
    revision = 2
    stage = Stage.ADHESION
    act = staticmethod(stick_to_wall)

    def row(self, at_wall: bool) -> tuple[float, ...]:
        """Acts at walls only."""
        return self.numbers if at_wall else (0.0,)

    def grip(self, e_star: float, reduced_radius: float) -> float:
        """Gap [m] at which surfaces separate."""
        return grip(self.work_of_adhesion, e_star, reduced_radius)
