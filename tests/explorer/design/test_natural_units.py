"""`explorer analyse` in natural units against statsmodels, which reads the same sheet by itself."""

import math

import numpy as np
import pandas as pd
import pytest

from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import fit_surface
from explorer.design.analysis import AnalyseOrder, run_analyse
from solver.assets import asset_path
from tests.doe.analysis.natural_units import fitted_in_natural_units, natural_errors, quadratic

LEVELS = ["shear_modulus [MPa]", "static_friction", "restitution"]
NAMES = "ABD"
"""C is a function in a formula."""


def test_coefficients_their_errors_and_adequate_precision_of_the_shipped_sheet():
    """Table 8 of Processes 2022, 10, 185, at its natural levels."""
    sheet = pd.read_csv(asset_path("designs", "sunflower_extract").with_suffix(".csv"), comment="#")
    natural, y = sheet[LEVELS].to_numpy(), sheet["angle_of_repose_deg"].to_numpy()
    fit, room = fitted_in_natural_units(quadratic(NAMES), NAMES, natural, y)
    # what the condition of natural levels leaves of a double, about 1e-8
    assert room < 1e-7
    found = run_analyse(AnalyseOrder("sunflower_extract"))
    assert found.analysis.model.surface.coefficients_natural == pytest.approx(fit.params.to_numpy(), rel=10 * room)
    precision = np.ptp(fit.fittedvalues) / math.sqrt((fit.get_prediction().se_mean ** 2).mean())
    assert found.analysis.model.anova.adequate_precision == pytest.approx(precision, rel=10 * room)
    middle, half = (natural.max(axis=0) + natural.min(axis=0)) / 2, np.ptp(natural, axis=0) / 2
    surface = fit_surface(found.coded, y, Region(tuple(NAMES), middle, half, ()))
    assert natural_errors(surface) == pytest.approx(fit.bse.to_numpy(), rel=10 * room)
