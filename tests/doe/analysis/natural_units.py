"""A second-order polynomial fitted by statsmodels to levels in natural units, to hold others' coefficients against."""

import numpy as np
import pandas as pd
import statsmodels.formula.api as smf

from doe.analysis.surface import natural_coefficients


def quadratic(names):
    """The full second-order formula in the order of `doe.analysis.surface`."""
    pairs = [f"{a}:{b}" for i, a in enumerate(names) for b in names[i + 1 :]]
    return "y ~ " + " + ".join([*names, *pairs, *(f"I({name}**2)" for name in names)])


def fitted_in_natural_units(formula, names, natural, y):
    """statsmodels on natural levels as they are, and how much of a double's precision their condition leaves."""
    fit = smf.ols(formula, pd.DataFrame(natural, columns=list(names)).assign(y=y)).fit(method="qr")
    return fit, np.linalg.cond(fit.model.exog) * np.finfo(float).eps


def natural_errors(surface):
    """Standard errors of the natural coefficients: the change of units is linear, so its columns are unit vectors'."""
    change = np.array([natural_coefficients(unit, surface.region) for unit in np.eye(len(surface.coefficients))]).T
    return np.sqrt(np.diag(change @ surface.information_inverse @ change.T) * surface.mse)
