"""Capillary bridges: liquid between surfaces that have touched pulls them together until the bridge breaks.

    touching    F = 2π R γ cos θ                                                       [N]
    at a gap s  F = 2π R γ cos θ / (1 + 2.1 S + 10 S²),   S = (s/2) √(R/V),   R = 2 R*
    breaks at   s_c = (1 + θ/2)(V*^⅓ + 0.1 V*^⅔) R,       V* = V/R³

A bridge forms at contact and lasts up to the gap s_c (hysteresis). V is the volume of one bridge, θ the contact angle.
The pull hardly depends on V; the amplitude is the surface tension γ. Vanishes for γ → 0.
Source: Willett, Adams, Johnson & Seville 2000, Langmuir 16:9396, closed form and Eq. (15), as in YADE.
Limits: no viscous force, no redistribution of liquid, a sphere on a plane by Derjaguin's R = 2 R*, V* below 0.1; every
touching member sphere of a clump has its own bridge.
"""

import math
from dataclasses import dataclass

from solver.effects.effect import ContactEffect, Stage, Telltale
from solver.effects.kernel import kernel_function, ti
from solver.params import param


@kernel_function
def bridge(p, m, c):
    """p: γ cos θ, V, 1 + θ/2."""
    radius, volume = 2.0 * c.reduced_radius, p[1]
    pull = 2.0 * math.pi * radius * p[0]
    held = 1
    if c.overlap < 0.0:
        # s < s_c, solved for V*^⅓ so that no cube root is needed: v + 0.1 v² = s/((1 + θ/2) R), and v³ < V*.
        needed = 5.0 * (ti.sqrt(1.0 - 0.4 * c.overlap / (p[2] * radius)) - 1.0) * radius
        s = -0.5 * c.overlap * ti.sqrt(radius / volume)
        pull /= 1.0 + 2.1 * s + 10.0 * s * s
        if needed * needed * needed >= volume:
            held = 0
    if held == 1:
        c.elastic -= pull
        c.pull += pull
        c.floor -= pull
        c.held = 1
    return c, m


@dataclass(frozen=True)
class CapillaryBridge(ContactEffect):
    """Liquid bridges; ``surface_tension`` is the amplitude."""

    surface_tension: float = param(
        0.0, unit="N/m", low=0.0, high=1.0, doc="Surface tension γ; water 0.072 N/m.", live=True
    )
    bridge_volume: float = param(
        1e-9, unit="m3", low=1e-15, high=1e-6, doc="Liquid in one bridge.", live=True, scale="log"
    )
    contact_angle: float = param(0.0, unit="rad", low=0.0, high=1.5, doc="Contact angle θ.", live=True)

    name = "capillary_bridge"
    amplitudes = ("surface_tension",)
    strongest = 0.072
    literature = "clean water at 20 °C, 0.072 N/m, is the largest of the liquids that wet plant material"
    lever = "a moisture series; a surfactant lowers γ; attraction outlasts contact"
    telltales = (Telltale.SHAPE, Telltale.FLOW)
    revision = 2
    stage = Stage.ADHESION
    act = staticmethod(bridge)

    def row(self, at_wall: bool) -> tuple[float, ...]:
        """What the kernel reads: γ cos θ, V, 1 + θ/2."""
        wetting = self.surface_tension * math.cos(self.contact_angle)
        return wetting, self.bridge_volume, 1.0 + 0.5 * self.contact_angle

    def grip(self, e_star: float, reduced_radius: float) -> float:
        """Gap [m] at which a bridge breaks."""
        radius = 2.0 * reduced_radius
        share = (self.bridge_volume / radius**3) ** (1.0 / 3.0)
        return (1.0 + 0.5 * self.contact_angle) * (share + 0.1 * share**2) * radius
