"""Where a sphere lands that falls H onto a plate at 45° and bounces: the paper's L/(2H) in closed form, and inverted.

In units of the impact speed V = √(2gH), a sphere leaves with e V/√2 along the normal and k V/√2 along the plate:

    v_x = (e + k)/2 V,  v_z = (e − k)/2 V,  L/(2H) = x (z + √(z² + 1)),  x = v_x/V, z = v_z/V
    k = 1 − μ (1 + e)  while it slides, never less than 5/7, when it leaves without slip

(rigid sphere, Coulomb impulse; solid sphere: 2/5 m r²). Only e = k gives L/(2H) = e. The tangential springs of a
Hertz–Mindlin contact give back a little of the spin, so that simulated values differ by a few hundredths.
"""

from __future__ import annotations

import math

from scipy.optimize import brentq

GRAVITY = 9.81
GRIPPING = 5.0 / 7.0
"""Share of the tangential velocity that a solid sphere keeps when it leaves without slip."""


def tangential_share(restitution: float, friction: float) -> float:
    """k: tangential velocity after the impact at 45° over that before it."""
    return max(GRIPPING, 1.0 - friction * (1.0 + restitution))


def flight(restitution: float, share: float) -> float:
    """L/(2H) of a sphere with restitution e and tangential share k."""
    x, z = 0.5 * (restitution + share), 0.5 * (restitution - share)
    return x * (z + math.sqrt(z * z + 1.0))


def restitution_of_flight(measured: float, share: float) -> float:
    """The e whose :func:`flight` is ``measured``; NaN if no e in 0 … 1 has it. ``flight`` grows with e."""
    if not flight(0.0, share) <= measured <= flight(1.0, share):
        return math.nan
    return float(brentq(lambda e: flight(e, share) - measured, 0.0, 1.0, xtol=1e-12))
