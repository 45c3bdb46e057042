"""Viscous drag of a slow body: F = −k v [N], with k = 3 π η D of a sphere in a fluid (Stokes 1851).

A falling body approaches the speed m g/k. Vanishes for k → 0.
"""

from dataclasses import dataclass

from solver.effects.effect import BodyEffect, Telltale
from solver.effects.kernel import kernel_function
from solver.params import param


@kernel_function
def drag(p, b):
    """p: k; the force [N] on body b."""
    return -p[0] * b.velocity


@dataclass(frozen=True)
class StokesDrag(BodyEffect):
    """Drag in proportion to the speed; ``resistance`` is the amplitude."""

    resistance: float = param(0.0, unit="kg/s", low=0.0, high=1.0, doc="Force per speed k.", live=True)

    name = "stokes_drag"
    amplitudes = ("resistance",)
    strongest = 1e-3
    literature = "3 π η D: 1e-6 kg/s for 5 mm in air, 5e-5 in water"
    lever = "drop a single body from two heights"
    telltales = (Telltale.FLOW,)
    act = staticmethod(drag)
