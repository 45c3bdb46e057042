"""The damping constant against an independent integration of the contact in SI units."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solver.laws.restitution import damping_ratio, exponent, normal_damping

IMPACTS = ((5e-3, 1.3e-3, 5.3e6, 1.0), (1e-5, 3.3e-11, 2.3e11, 5.0), (0.1, 11.3, 7.7e10, 0.2))
"""Radius [m], mass [kg], E* [Pa], speed [m/s]: a soft grain, a steel grain of 10 µm, an aluminium ball of 0.1 m."""


def hertz(e, radius, mass, e_star, state):
    """4/3 E* a δ + c_n √(2 E* a m) δ' [N]."""
    a = math.sqrt(radius * max(state[0], 0.0))
    return 4 / 3 * e_star * a * state[0] + normal_damping(e) * math.sqrt(2 * e_star * a * mass) * state[1]


def linear(e, radius, mass, e_star, state):
    """k δ + 2 ζ √(k m) δ' [N], with some k."""
    k = e_star * radius
    return k * state[0] + 2 * damping_ratio(e) * math.sqrt(k * mass) * state[1]


def speed_out(law, e, radius, mass, e_star, speed):
    """Integrate m δ'' = −F until the force is zero."""

    def force(state):
        return law(e, radius, mass, e_star, state)

    def pulls(_, state):
        return force(state)

    pulls.terminal, pulls.direction = True, -1
    if law is hertz:
        depth = (15 * mass * speed**2 / (16 * e_star * math.sqrt(radius))) ** 0.4
        # The first millionth of the depth passes at constant speed: at δ = 0 the force is zero and would end the run.
        start = [1e-6 * depth, speed]
    else:
        depth = speed * math.sqrt(mass / (e_star * radius))
        start = [0.0, speed]
    done = solve_ivp(
        lambda _, s: (s[1], -force(s) / mass),
        (0.0, 40 * depth / speed),
        start,
        events=pulls,
        rtol=1e-11,
        atol=[1e-14 * depth, 1e-13 * speed],
        method="DOP853",
    )
    assert done.t_events[0].size == 1
    return -done.y_events[0][0][1]


@pytest.mark.parametrize("law", [hertz, linear])
@pytest.mark.parametrize("impact", IMPACTS)
@pytest.mark.parametrize("e", [0.05, 0.1, 0.1353, 0.2, 0.3, 0.5, 0.7, 0.9, 0.98, 0.999])
def test_the_damping_inverts_the_contact_at_every_size_and_stiffness(e, impact, law):
    # 1e-6: the integration starts at a millionth of the depth, where damping ∝ δ^(1/4) has already cost some 1e-8 c_n.
    assert speed_out(law, e, *impact) / impact[3] == pytest.approx(e, rel=1e-6)


def test_no_damping_at_one_and_a_refusal_outside():
    assert normal_damping(1.0) == 0.0
    for wrong in (0.0, -0.1, 1.1):
        with pytest.raises(ValueError, match="restitution"):
            normal_damping(wrong)


def test_the_two_branches_meet_and_the_exponent_grows():
    ratios = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 4.0, 50)[1:]])
    assert np.all(np.diff([exponent(z) for z in ratios]) > 0)
    assert exponent(1.0) == 2.0
    # tan φ ~ 1/√(2 (1 − ζ)): rounding of asin and acosh is amplified to 1e-10 this near.
    assert exponent(1.0 - 1e-9) == pytest.approx(2.0, abs=1e-4)
    assert exponent(1.0 + 1e-9) == pytest.approx(2.0, abs=1e-4)


def test_weak_damping_by_series():
    """ζ → 0: −ln e = π ζ − 2 ζ² + …, by hand from (π − 2 φ) tan φ."""
    assert exponent(1e-4) == pytest.approx(math.pi * 1e-4 - 2e-8, rel=1e-7)
