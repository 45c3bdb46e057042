"""Restitution that falls with impact speed, as for viscoelastic spheres.

    1 − e(v) = (1 − e) [1 + q ((v/v₀)^{1/5} − 1)]           v: speed at which the contact began

e is the declared restitution, taken to hold at v₀ = 1 m/s; q = 1 is the law of viscoelastic spheres to leading order.
Vanishes for q → 0. The damper of a contact is that for e(v), limited to 0.05 … 1, from a series of the exact inverse
in ``laws/restitution.py``. A contact that existed when the effect was switched on keeps its damper; one that began
slowly keeps a weak damper, however hard it is hit later.
Source: Brilliantov, Spahn, Hertzsch & Pöschel 1996, Physical Review E 53:5382; Schwager & Pöschel 1998, PRE 57:650.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.chebyshev import chebfit

from solver.effects.effect import ContactEffect, Stage, Telltale
from solver.effects.kernel import kernel_function, ti
from solver.laws.restitution import normal_damping
from solver.params import param

DEGREE = 20
LEAST = 0.05
"""Lower limit of the restitution at any speed."""


def _series() -> tuple[float, ...]:
    """Coefficients of c_n as a Chebyshev series in x = 2 √(−ln e/3) − 1, −1 … 1 for e = 1 … exp(−3) = 0.05."""
    x = np.cos(np.pi * (np.arange(200) + 0.5) / 200)
    values = [normal_damping(math.exp(-3.0 * (0.5 * (1.0 + one)) ** 2)) for one in x]
    return tuple(float(number) for number in chebfit(x, values, DEGREE))


SERIES = _series()


@kernel_function
def damping_of(restitution):
    """c_n for a restitution 0.05 … 1, within 1e-6 of :func:`solver.laws.restitution.normal_damping`."""
    x = 2.0 * ti.sqrt(-ti.log(restitution) / 3.0) - 1.0
    last, before = 0.0, 0.0
    for k in ti.static(range(DEGREE, 0, -1)):
        last, before = ti.static(SERIES[k]) + 2.0 * x * last - before, last
    return ti.static(SERIES[0]) + x * last - before


@kernel_function
def damp_by_speed(p, m, c):
    """p: q, v₀; m: relative difference of the damper from that for e, set when the contact begins."""
    if c.before == 0.0:
        speed = ti.max(1e-4, -c.v_n) / p[1]
        loss = (1.0 - c.restitution) * (1.0 + p[0] * (speed**0.2 - 1.0))
        now = ti.max(LEAST, ti.min(1.0, 1.0 - loss))
        if c.restitution < 1.0:
            m[0] = damping_of(now) / damping_of(c.restitution) - 1.0
    c.damper *= 1.0 + m[0]
    return c, m


@dataclass(frozen=True)
class VelocityDependentRestitution(ContactEffect):
    """Restitution that falls with impact speed; ``speed_sensitivity`` is the amplitude."""

    speed_sensitivity: float = param(
        0.0, low=0.0, high=3.0, doc="Sensitivity q; 1 is the law of viscoelastic spheres.", live=True
    )
    reference_speed: float = param(
        1.0, unit="m/s", low=0.01, high=10.0, doc="Speed v₀ at which the declared restitution holds.", live=True
    )

    name = "velocity_dependent_restitution"
    amplitudes = ("speed_sensitivity",)
    strongest = 2.0
    literature = "1 for viscoelastic spheres; restitution of seeds falls by 0.05–0.2 from 1 to 3 m/s"
    lever = "drop test from several heights"
    telltales = (Telltale.FLOW,)
    stage = Stage.NORMAL
    act = staticmethod(damp_by_speed)
    memory = 1

    def restitution(self, declared: float, speed: float) -> float:
        """e(v)."""
        loss = 1.0 + self.speed_sensitivity * ((speed / self.reference_speed) ** 0.2 - 1.0)
        return max(LEAST, min(1.0, 1.0 - (1.0 - declared) * loss))
