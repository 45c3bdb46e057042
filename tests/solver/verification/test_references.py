"""The verification's own references: closed forms and the integration without the solver, against other ways."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from solver.scenes.contact_model import ContactModel
from solver.verification.chung_ooi import ALUMINIUM, OXIDE, STEEL
from solver.verification.conservation import tumbling_period
from solver.verification.hertz import Elastic
from solver.verification.impacts import Impact, rebounds
from solver.verification.oblique import closed_form
from solver.verification.one_contact import Convention, integrated
from solver.verification.row import Row, of_scale, of_value

IMPACT = Elastic(mass=2e-3, radius=4e-3, e_star=3e7, speed=1.3)


def test_an_error_is_a_share_of_its_scale_and_a_nan_is_no_pass():
    assert of_value("T", "q", -2.0, -1.99, 0.5, "s").error == pytest.approx(0.5)
    row = of_scale("T", "q", 0.0, 0.02, (4.0, "span"), 0.5, "s")
    assert row.error == pytest.approx(0.5)
    assert row.passed
    assert not of_scale("T", "q", 0.0, 0.021, (4.0, "span"), 0.5, "s").passed
    assert not of_value("T", "q", 1.0, math.nan, 0.5, "s").passed
    assert Row("T", "q", "", 1.0, 9.0, 1.0, "value", None, "s").passed


@pytest.mark.parametrize("fraction", [0.1, 0.4, 0.5, 0.8])
def test_hertz_over_time_against_an_integration(fraction):
    time = fraction * IMPACT.duration
    done = solve_ivp(
        lambda _, s: (s[1], -float(IMPACT.force(s[0])) / IMPACT.mass),
        (0, time),
        (0, IMPACT.speed),
        rtol=1e-10,
        atol=1e-16,
    )
    assert float(IMPACT.overlap(np.array([time]))[0]) == pytest.approx(done.y[0, -1], rel=1e-6)


def test_hertz_duration_and_depth():
    # Energy: ½ m v² = 8/15 E* √R δ^(5/2); the duration's constant is tabulated as 2.943.
    stored = 8 / 15 * IMPACT.e_star * math.sqrt(IMPACT.radius) * IMPACT.depth**2.5
    assert stored == pytest.approx(0.5 * IMPACT.mass * IMPACT.speed**2)
    assert IMPACT.duration * IMPACT.speed / IMPACT.depth == pytest.approx(2.943, abs=1e-3)
    assert float(IMPACT.overlap(np.array([1.01 * IMPACT.duration]))[0]) == 0.0


@pytest.mark.parametrize("spin", [[0.3, 60.0, 0.2], [5.0, 10.0, 20.0], [40.0, 5.0, 1.0]])
def test_tumbling_period_against_euler_s_equations(spin):
    inertia, spin = np.array([1e-8, 3e-8, 4e-8]), np.array(spin)
    period = tumbling_period(inertia, spin)
    done = solve_ivp(lambda _, w: -np.cross(w, inertia * w) / inertia, (0, period), spin, rtol=1e-11, atol=1e-11)
    assert done.y[:, -1] == pytest.approx(spin, abs=1e-5 * np.linalg.norm(spin))


def oblique(theta, restitution=0.98, friction=0.092, material=OXIDE):
    angle = math.radians(theta)
    return Impact(material, 2.5e-3, 3.9 * math.cos(angle), 3.9 * math.sin(angle), 0.0, restitution, friction)


def test_the_integration_slides_by_the_closed_form():
    impacts = [oblique(theta) for theta in (40, 60, 80)]
    for theta, before, after in zip((40, 60, 80), impacts, integrated(impacts), strict=True):
        exact = closed_form(theta, 0.98)
        assert after.v_t / before.v_t == pytest.approx(exact.restitution, rel=1e-4)
        # The closed form takes the overlap as small beside the radius; at 40° it is half a percent of it.
        assert after.surface_speed / before.radius == pytest.approx(exact.spin, rel=5e-3)


def test_the_integration_without_friction_leaves_the_tangential_motion_alone():
    (after,) = integrated([oblique(45, friction=0.0, restitution=0.6)])
    assert after.v_t == pytest.approx(oblique(45).v_t, abs=1e-15)
    assert after.v_n == pytest.approx(0.6 * oblique(45).v_n, rel=1e-4)


def test_the_integration_that_never_slips_against_a_linear_system():
    """μ → ∞, e = 1, spring never scaled: no cap and no damper, so that SciPy can integrate it."""
    impact = Impact(STEEL, 1e-5, 0.05, 0.02, 0.0, 1.0, 1e9)
    ratio = 4 * (1 - 0.3) / (2 * (2 - 0.3))  # 4 G*/E* of a sphere on a rigid plane

    def rates(_, s):  # z, z', slip, tangential force; units of depth, speed, mass
        root = math.sqrt(max(s[0], 0.0))
        return s[1], -1.25 * root**3, 3.5 * s[3], -1.875 * ratio * root * s[2]

    end = 0.8 * math.gamma(0.4) * math.gamma(0.5) / math.gamma(0.9)
    done = solve_ivp(rates, (0, end), (0, 1, 0.4, 0), rtol=1e-9, atol=1e-12)
    (after,) = integrated([impact], Convention(scaled="never"))
    # 0.2 %: the lever arm is shorter by half the overlap, up to 0.06 % of the radius here, over three swings.
    assert after.contact_speed / 0.05 == pytest.approx(done.y[2, -1], abs=2e-3 * 0.4)


def test_halving_the_stiffness_changes_the_sticking_part_and_not_the_sliding_one():
    sticks, slides = oblique(10, material=ALUMINIUM), oblique(60, material=ALUMINIUM)
    for impact, differs in ((sticks, True), (slides, False)):
        (one,), (half,) = integrated([impact]), integrated([impact], Convention(stiffness=0.5))
        assert (abs(one.v_t - half.v_t) > 0.01 * impact.v_t) == differs


@pytest.mark.parametrize("capped", [True, False])
def test_the_displacement_law_of_the_solver_is_the_one_integrated_without_it(capped, taichi):
    """Oblique impacts from sticking to sliding; e = 0.7, so that the dashpot counts."""
    impacts = [
        Impact(OXIDE, 2.5e-3, v_n=3.9 * math.cos(angle), v_t=3.9 * math.sin(angle), restitution=0.7, friction=0.3)
        for angle in np.radians([5.0, 10.0, 20.0, 40.0, 60.0])
    ]
    choice = "capped" if capped else "uncapped"
    ours = rebounds(impacts, contact=ContactModel(tangential_law="mindlin", tangential_dashpot=choice))
    without = integrated(impacts, Convention(scaled="always", capped=capped))
    for one, other, impact in zip(ours, without, impacts, strict=True):
        # 0.3 % of the speed: the solver's dashpot takes velocities half a step late.
        assert one.v_t == pytest.approx(other.v_t, abs=3e-3 * impact.v_n)
        assert one.surface_speed == pytest.approx(other.surface_speed, abs=6e-3 * impact.v_n)
    other_choice = Convention(scaled="always", capped=not capped)
    apart = [abs(a.v_t - b.v_t) for a, b in zip(without, integrated(impacts, other_choice), strict=True)]
    assert max(apart) > 0.01  # the choice is felt at all
