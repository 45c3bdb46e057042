"""Simplified JKR adhesion: a pull proportional to the contact area ("SJKR" of LIGGGHTS).

    F_n ← F_n − k A,   A = 2π R* δ        [N]

k is the cohesion energy density [J/m³]. A is the area of the lens in which two spheres intersect, to first order in
δ (LIGGGHTS takes the lens exactly: a difference of δ/(8 R*)). There is no pull at a gap. Vanishes for k → 0. It makes
the contact softer and holds it with k A at its overlap at rest, so unlike JKR's pull it grows with the load.
Source: LIGGGHTS-PUBLIC documentation, "cohesion model sjkr".
"""

import math
from dataclasses import dataclass

from solver.effects.effect import ContactEffect, Stage, Telltale
from solver.effects.kernel import kernel_function
from solver.params import param


@kernel_function
def pull_by_area(p, m, c):
    """p: k."""
    if c.overlap > 0.0:
        pull = p[0] * 2.0 * math.pi * c.reduced_radius * c.overlap
        c.elastic -= pull
        c.pull += pull
        c.floor -= pull
    return c, m


@dataclass(frozen=True)
class AdhesionSJKR(ContactEffect):
    """Simplified JKR adhesion; ``cohesion_energy_density`` is the amplitude."""

    cohesion_energy_density: float = param(
        0.0, unit="J/m3", low=0.0, high=1e8, doc="Cohesion energy density k.", live=True
    )

    name = "adhesion_sjkr"
    amplitudes = ("cohesion_energy_density",)
    strongest = 1e6
    literature = "10⁴–10⁶ J/m³ in published calibrations with shear moduli near 10⁷–10⁸ Pa"
    lever = "vary the load on a contact: shear under a weight against free flow"
    telltales = (Telltale.SHAPE, Telltale.FLOW)
    stage = Stage.ADHESION
    act = staticmethod(pull_by_area)
