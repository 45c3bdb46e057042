"""Air drag on whole bodies (Haider & Levenspiel), still air at 20 °C.

    F = −s ½ ρ C_D A |v| v                                                              [N]
    C_D = 24/Re (1 + a Re^b) + c/(1 + d/Re),   Re = ρ |v| D/η
    a = exp(2.3288 − 6.4581 φ + 2.4486 φ²)                 b = 0.0964 + 0.5565 φ
    c = exp(4.905 − 13.8944 φ + 18.4222 φ² − 10.2599 φ³)   d = exp(1.4681 + 12.2584 φ − 20.7322 φ² + 15.8855 φ³)

D is the diameter of the sphere of the same volume, φ the sphericity. C_D refers to that sphere's cross-section, so A is
¼ π D² on average over all wind directions, and is proportional to the projected area of the ellipsoid with the body's
outer dimensions: φ π √((bc u₁)² + (ac u₂)² + (ab u₃)²) for wind along u. The formula of C_D holds for isometric bodies,
φ > 0.2, Re < 2.6·10⁵; there is no lift, no torque, no wake of others. The strength s scales the force, 1 is air;
vanishes for s → 0.
Source: Haider & Levenspiel 1989, Powder Technology 58:63.
"""

import math
from dataclasses import dataclass

from solver.effects.effect import BodyEffect, Telltale
from solver.effects.kernel import kernel_function, ti
from solver.params import param

AIR_DENSITY = 1.204
"""[kg/m³], 20 °C."""
AIR_VISCOSITY = 1.825e-5
"""[Pa s]"""


@kernel_function
def shape_factors(phi):
    """a, b, c, d of a body of sphericity φ; computed once, when the body is loaded."""
    a = ti.exp(2.3288 - 6.4581 * phi + 2.4486 * phi * phi)
    b = 0.0964 + 0.5565 * phi
    c = ti.exp(4.905 - 13.8944 * phi + 18.4222 * phi**2 - 10.2599 * phi**3)
    d = ti.exp(1.4681 + 12.2584 * phi - 20.7322 * phi**2 + 15.8855 * phi**3)
    return ti.Vector([a, b, c, d])


@kernel_function
def drag_coefficient(reynolds, factors):
    """C_D of Haider & Levenspiel (1989); ``factors`` from :func:`shape_factors`."""
    viscous = 24.0 / reynolds * (1.0 + factors[0] * reynolds ** factors[1])
    return viscous + factors[2] / (1.0 + factors[3] / reynolds)


@kernel_function
def shown_area(semi_axes, wind):
    """Projected area [m²] of an ellipsoid along ``wind``, a unit vector in its principal frame."""
    x = semi_axes[1] * semi_axes[2] * wind[0]
    y = semi_axes[0] * semi_axes[2] * wind[1]
    z = semi_axes[0] * semi_axes[1] * wind[2]
    return math.pi * ti.sqrt(x * x + y * y + z * z)


@kernel_function
def drag(p, b):
    """p: s; the force [N] on body b."""
    speed = b.velocity.norm()
    force = 0.0 * b.velocity
    if speed > 1e-6:
        reynolds = AIR_DENSITY * speed * b.diameter / AIR_VISCOSITY
        area = shown_area(b.semi_axes, b.rotation.transpose() @ (b.velocity / speed))
        coefficient = drag_coefficient(reynolds, b.drag_factors)
        force = -p[0] * 0.5 * AIR_DENSITY * coefficient * area * speed * b.velocity
    return force


@dataclass(frozen=True)
class AirDrag(BodyEffect):
    """Drag of still air; ``strength`` is the amplitude."""

    strength: float = param(0.0, low=0.0, high=20.0, doc="Strength s; 1 is air at 20 °C.", live=True)

    name = "air_drag"
    amplitudes = ("strength",)
    strongest = 2.0
    literature = "1 is air; the coefficient of odd shapes is known within a factor of two"
    lever = "drop height; a fan; the time a single body falls"
    telltales = (Telltale.FLOW,)
    revision = 2
    act = staticmethod(drag)
