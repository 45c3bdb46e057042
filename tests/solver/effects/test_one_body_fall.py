"""One sphere falls in air: g and the strength of the drag come back from its heights; without drag nothing fits.

The smallest closed case of a missing effect: what is fitted, what is left over, and that it is left in vain where
nothing is missing. The model that is fitted is an integration of its own (SciPy), not the solver.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from solver.effects.air_drag import AIR_DENSITY, AIR_VISCOSITY
from solver.scenes.material import Material
from solver.single_body.free_world import EARTH, RADIUS, FreeWorld, sphere
from tests.solver.effects.cases import felt, scene_with
from tests.solver.effects.test_air_drag import haider_levenspiel

pytestmark = pytest.mark.usefixtures("taichi")

FOAM = Material("grain", density=100.0, shear_modulus=1e7, poisson_ratio=0.25)
STEP, SAMPLE, SAMPLES = 1e-4, 200, 50
TRUE_STRENGTH = 1.3


def heights(strength):
    """Fall from rest, a sample every 20 ms for 1 s."""
    lab = FreeWorld(
        scene_with(felt("air_drag", strength=strength), bodies=(sphere(material=FOAM),), grain=FOAM, gravity=EARTH),
        1,
        dt=STEP,
        plate=False,
    )
    lab.put(0, (0.0, 0.0, 0.0))
    found = []
    for _ in range(SAMPLES):
        lab.run(SAMPLE)
        found.append(lab.state()[0, 2])
    return np.array(found)


def model(g, strength):
    """The same by the equation of motion m v' = −m g + s ½ ρ C_D A v²."""
    times = STEP * SAMPLE * np.arange(1, SAMPLES + 1)
    mass, area = sphere(material=FOAM).mass, np.pi * RADIUS**2

    def slope(_, y):
        speed = max(-y[1], 1e-6)
        c_d = haider_levenspiel(AIR_DENSITY * speed * 2.0 * RADIUS / AIR_VISCOSITY)
        return [y[1], -g + strength * 0.5 * AIR_DENSITY * c_d * area * speed**2 / mass]

    solution = solve_ivp(slope, (0.0, times[-1]), [0.0, 0.0], t_eval=times, rtol=1e-9, atol=1e-12)
    return solution.y[1 - 1]


def fitted(data, with_drag):
    """(g, strength) by least squares, and the root of the mean square of what is left."""

    def misfit(p):
        return 1e3 * (model(p[0], p[1] if with_drag else 0.0) - data)

    result = least_squares(misfit, [9.0, 0.5] if with_drag else [9.0], x_scale=0.1)
    return result.x, np.sqrt(np.mean(result.fun**2)) / 1e3


@pytest.fixture(scope="module")
def in_air(taichi):
    return heights(TRUE_STRENGTH)


def test_gravity_and_strength_come_back(in_air):
    """Leapfrog from rest is half a step ahead, g t dt/2 or 0.01 %; the fit puts it into g and the strength."""
    (g, strength), left = fitted(in_air, True)
    assert g == pytest.approx(9.81, rel=5e-4)
    assert strength == pytest.approx(TRUE_STRENGTH, rel=5e-3)
    assert left < 1e-4


def test_without_drag_the_model_does_not_fit_and_gravity_pays_for_it(in_air):
    (g,), left = fitted(in_air, False)
    _, noise = fitted(in_air, True)
    assert g < 0.97 * 9.81
    assert left > 100.0 * noise


def test_where_nothing_is_missing_no_drag_is_found():
    (g, strength), left = fitted(heights(0.0), True)
    assert g == pytest.approx(9.81, rel=5e-4)
    assert abs(strength) < 5e-3
    (_,), plain = fitted(heights(0.0), False)
    assert plain < 2.0 * left + 1e-4
