"""Polynomials in natural units and adequate precision against statsmodels on the natural data, and textbooks."""

import math

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf

from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import fit_surface
from doe.analysis.surface_anova import analyse_surface
from tests.doe.analysis.natural_units import fitted_in_natural_units, natural_errors, quadratic
from tests.doe.analysis.textbook import FILTRATION, FILTRATION_RATE, YIELD, YIELD_POINTS, YIELD_REGION, region

# Solutions to Montgomery 2017, Design and Analysis of Experiments, problem 11.1: purity of oxygen over condenser
# temperature [°C] and pressure ratio, four corners and four centre runs, with the output of Design-Expert.
OXYGEN = Region(("A", "B"), np.array([-220.0, 1.2]), np.array([5.0, 0.1]), ())
OXYGEN_POINTS = np.array([(-1, -1), (-1, 1), (1, -1), (1, 1), *[(0, 0)] * 4], dtype=float)
PURITY = np.array([82.8, 83.5, 84.7, 85.0, 84.1, 84.5, 83.9, 84.3])


def test_coefficients_and_errors_of_a_central_composite_design():
    """Montgomery 2017, section 11.2: time and temperature as they are, 85 ± 5 min and 175 ± 5 °F."""
    surface = fit_surface(YIELD_POINTS, YIELD, YIELD_REGION)
    fit, room = fitted_in_natural_units(quadratic("AB"), "AB", YIELD_REGION.natural(YIELD_POINTS), YIELD)
    assert surface.coefficients_natural == pytest.approx(fit.params.to_numpy(), rel=10 * room)
    assert natural_errors(surface) == pytest.approx(fit.bse.to_numpy(), rel=10 * room)
    assert room < 1e-7


def test_design_expert_s_equation_in_actual_factors():
    """Problem 11.1: purity = 118.4 + 0.17 temperature + 2.5 pressure ratio; its intercept is that of the corners."""
    surface = fit_surface(OXYGEN_POINTS[:4], PURITY[:4], OXYGEN, ["A", "B"])
    assert surface.coefficients_natural[surface.included] == pytest.approx([118.4, 0.17, 2.5], rel=1e-10)


def test_design_expert_s_adequate_precision():
    """Problem 11.1 prints 12.702: corners, centre and the term between them, here A², whose column is the same."""
    surface = fit_surface(OXYGEN_POINTS, PURITY, OXYGEN, ["A", "B", "A^2"])
    # printed digits
    assert analyse_surface(surface).adequate_precision == pytest.approx(12.702, abs=5e-4)


@pytest.mark.parametrize(
    "points, y, where, terms",
    [
        (FILTRATION[:, [0, 2, 3]], FILTRATION_RATE, region("ACD"), ["A", "C", "D", "A*C", "A*D"]),
        (YIELD_POINTS, YIELD, YIELD_REGION, None),
    ],
    ids=["filtration", "yield"],
)
def test_adequate_precision_is_the_range_of_predictions_over_their_mean_error(points, y, where, terms):
    """statsmodels' standard error of every prediction, their variances averaged over the runs."""
    surface = fit_surface(points, y, where, terms)
    names = [f"x_{name}" for name in where.names]
    if terms is None:
        formula = quadratic(names)
    else:
        formula = "y ~ " + " + ".join(":".join(f"x_{name}" for name in term.split("*")) for term in terms)
    fit = smf.ols(formula, pd.DataFrame(points, columns=names).assign(y=y)).fit()
    error = math.sqrt((fit.get_prediction().se_mean ** 2).mean())
    assert analyse_surface(surface).adequate_precision == pytest.approx(np.ptp(fit.fittedvalues) / error, rel=1e-10)
