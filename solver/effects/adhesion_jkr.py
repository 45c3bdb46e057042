"""Adhesion by surface forces (JKR; formulas in ``jkr_contact.py``), between bodies and with walls.

Vanishes for a work of adhesion w → 0. One contact can hold a weight of 3/2 π w R*, so small and light bodies are
affected most: Bond number Bo = 3/2 π w R*/(m g).
Source: Johnson, Kendall & Roberts 1971, Proc. R. Soc. A 324:301. Some codes take the surface energy of one surface,
γ = w/2 (LAMMPS, LIGGGHTS); EDEM and MercuryDPM take w.
"""

from dataclasses import dataclass

from solver.effects.effect import ContactEffect, Stage, Telltale
from solver.effects.jkr_contact import adhere, grip
from solver.effects.kernel import kernel_function
from solver.params import param


@kernel_function
def stick(p, m, c):
    """p: w."""
    return adhere(p[0], c), m


@dataclass(frozen=True)
class AdhesionJKR(ContactEffect):
    """JKR adhesion; ``work_of_adhesion`` is the amplitude."""

    work_of_adhesion: float = param(0.0, unit="J/m2", low=0.0, high=50.0, doc="Work of adhesion w.", live=True)

    name = "adhesion_jkr"
    amplitudes = ("work_of_adhesion",)
    strongest = 5.0
    literature = "0.1–5 J/m² in published calibrations of moist seeds and residues (effective, not a material constant)"
    lever = "pour a lighter fraction; turn the plate over; vary the mass"
    telltales = (Telltale.SHAPE, Telltale.FLOW)
    revision = 2
    stage = Stage.ADHESION
    act = staticmethod(stick)

    def grip(self, e_star: float, reduced_radius: float) -> float:
        """Gap [m] at which surfaces separate."""
        return grip(self.work_of_adhesion, e_star, reduced_radius)
