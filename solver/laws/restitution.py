"""Damping that reproduces the declared restitution: the exact inverse of the damped impact, for both laws.

An impact with the normal force of `hertz_mindlin.py` is, with k = 4/3 E* √R*, overlap δ and mass m*,

    m* δ'' = −max(0, k δ^(3/2) + c_n √(3/2 k m*) δ^(1/4) δ'),   δ(0) = 0,  δ'(0) = v

(2 E* a = 3/2 k √δ). With s ∝ δ^(5/4) as the coordinate and dθ ∝ δ^(1/4) dt as the time it becomes the linear damped
oscillator d²s/dθ² + 2 ζ ds/dθ + s = 0, with ζ = √0.3 c_n (Antypov & Elliott 2011, EPL 94:50004); the contact of
`linear_spring_dashpot.py` is already this oscillator, with s = δ and ζ = γ/(2 √(m* k_n)). The force is never tensile,
so the impact ends when s + 2 ζ ds/dθ = 0, before the overlap has vanished (as in Schwager & Pöschel 2007, Granular
Matter 9:465, for the linear dashpot). The solution at that time gives

    e = exp(−(π − 2 φ) tan φ)      ζ = sin φ ≤ 1     (e ≥ exp(−2) = 0.135)
    e = exp(−2 ψ coth ψ)           ζ = cosh ψ ≥ 1

for any speed, size and stiffness. ζ decreases with e, so bisection inverts the relation to rounding error.
"""

import math
from functools import lru_cache

CRITICAL = 2.0
"""−ln e at ζ = 1, where both branches meet."""


def exponent(zeta: float) -> float:
    """−ln e of an impact with damping ratio ζ, dimensionless; increases from 0 without limit."""
    if zeta < 1.0:
        phi = math.asin(zeta)
        return (math.pi - 2.0 * phi) * math.tan(phi)
    psi = math.acosh(zeta)
    return 2.0 * psi / math.tanh(psi) if psi > 0.0 else CRITICAL


def normal_damping(restitution: float) -> float:
    """c_n of the Hertzian contact, dimensionless, for a restitution 0 < e ≤ 1; 0 for e = 1."""
    return damping_ratio(restitution) / math.sqrt(0.3)


@lru_cache(maxsize=1024)
def damping_ratio(restitution: float) -> float:
    """ζ, dimensionless, for a restitution 0 < e ≤ 1; 0 for e = 1. Relative error below 1e-9."""
    if not 0.0 < restitution <= 1.0:
        raise ValueError(
            f"restitution: {restitution:g}; allowed: more than 0 (which needs infinite damping) and at most 1"
        )
    wanted = -math.log(restitution)
    # exponent(ζ) ≥ 2 acosh ζ bounds ζ from above.
    low, high = 0.0, max(1.0, math.cosh(wanted / 2.0))
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return middle
        if exponent(middle) < wanted:
            low = middle
        else:
            high = middle
