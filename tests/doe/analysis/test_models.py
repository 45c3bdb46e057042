"""Polynomials with fewer terms against statsmodels; fit summary and hierarchy."""

import math

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from statsmodels.stats.anova import anova_lm

from doe.analysis.models import fit_summary, hierarchical, highest_order, terms_of
from doe.analysis.optimum import bootstrap_coefficients
from doe.analysis.surface import Blocks, fit_surface
from doe.analysis.surface_anova import analyse_surface
from doe.designs import box_behnken, factorial
from doe.errors import StatisticsError
from tests.doe.analysis.textbook import FILTRATION, FILTRATION_RATE, YIELD, YIELD_POINTS, YIELD_REGION, region

REGION = region("ACD")


def frame():
    columns = pd.DataFrame(FILTRATION[:, [0, 2, 3]], columns=["A", "C_", "D"])
    return columns.assign(y=FILTRATION_RATE)


def test_reduced_model_agrees_with_statsmodels():
    """Montgomery 2017, example 6.2: A, C, D, AC, AD; the other terms have no part in any number."""
    surface = fit_surface(FILTRATION[:, [0, 2, 3]], FILTRATION_RATE, REGION, ["A", "C", "D", "A*C", "A*D"])
    anova = analyse_surface(surface)
    fit = smf.ols("y ~ A + C_ + D + A:C_ + A:D", frame()).fit()
    assert surface.coefficients[surface.included] == pytest.approx(fit.params.to_numpy(), rel=1e-12)
    assert not surface.coefficients[~surface.included].any()
    assert anova.r_squared == pytest.approx(fit.rsquared, rel=1e-12)
    assert anova.r_squared_adjusted == pytest.approx(fit.rsquared_adj, rel=1e-12)
    assert anova.press == pytest.approx((fit.get_influence().resid_press ** 2).sum(), rel=1e-10)
    table = anova_lm(fit, typ=3)
    for ours, theirs in (("A", "A"), ("C", "C_"), ("D", "D"), ("A*C", "A:C_"), ("A*D", "A:D")):
        row = anova.row(ours)
        assert row.sum_of_squares == pytest.approx(table.loc[theirs, "sum_sq"], rel=1e-10)
        assert row.p == pytest.approx(table.loc[theirs, "PR(>F)"], rel=1e-8)
    with pytest.raises(KeyError):
        anova.row("C*D")


def test_lack_of_fit_of_a_reduced_model_agrees_with_nested_fits():
    surface = fit_surface(FILTRATION[:, [0, 2, 3]], FILTRATION_RATE, REGION, ["A", "C", "D", "A*C", "A*D"])
    data = frame()
    point = data["A"].astype(str) + data["C_"].astype(str) + data["D"].astype(str)
    full = smf.ols("y ~ C(point)", data.assign(point=point)).fit()
    nested = anova_lm(smf.ols("y ~ A + C_ + D + A:C_ + A:D", data).fit(), full)
    row = analyse_surface(surface).row("lack_of_fit")
    assert row.df == 2
    assert row.f == pytest.approx(nested.loc[1, "F"], rel=1e-9)
    assert row.p == pytest.approx(nested.loc[1, "Pr(>F)"], rel=1e-9)


def test_prediction_and_interval_of_a_reduced_model_agree_with_statsmodels():
    surface = fit_surface(FILTRATION[:, [0, 2, 3]], FILTRATION_RATE, REGION, ["A", "C", "D", "A*C", "A*D"])
    at = np.array([0.3, -0.8, 0.5])
    fit = smf.ols("y ~ A + C_ + D + A:C_ + A:D", frame()).fit()
    theirs = fit.get_prediction(pd.DataFrame([at], columns=["A", "C_", "D"])).summary_frame()
    low, high = surface.confidence_interval(at)
    assert surface.predict(at) == pytest.approx(theirs["mean"][0], rel=1e-12)
    assert (float(low), float(high)) == pytest.approx(
        (theirs["mean_ci_lower"][0], theirs["mean_ci_upper"][0]), rel=1e-10
    )


def test_refits_of_a_reduced_model_keep_its_terms():
    surface = fit_surface(FILTRATION[:, [0, 2, 3]], FILTRATION_RATE, REGION, ["A", "C", "D", "A*C", "A*D"])
    refits, _ = bootstrap_coefficients(surface, 500, 0)
    assert not refits[:, ~surface.included].any()
    spread = refits[:, surface.included].std(axis=0)
    errors = analyse_surface(surface).coefficient_standard_errors[surface.included]
    assert spread == pytest.approx(errors, rel=0.25)  # replicates within points: 8 of the 12 error df, 500 refits


def test_orders_of_the_fit_summary_are_nested_fits():
    """Each order's F against its own residual, as anova_lm of three nested models does it step by step."""
    fits = fit_summary(YIELD_POINTS, YIELD[:, None], YIELD_REGION)
    data = pd.DataFrame(YIELD_POINTS, columns=["A", "B"]).assign(y=YIELD)
    formulas = ("y ~ 1", "y ~ A + B", "y ~ A + B + A:B", "y ~ A + B + A:B + I(A**2) + I(B**2)")
    models = [smf.ols(formula, data).fit() for formula in formulas]
    for one, before, model in zip(fits, models, models[1:], strict=False):
        table = anova_lm(before, model)
        assert one.f == pytest.approx(table.loc[1, "F"], rel=1e-8)
        assert one.p == pytest.approx(table.loc[1, "Pr(>F)"], rel=1e-8)
        assert one.r_squared == pytest.approx(model.rsquared, rel=1e-9)
        assert one.df_residual == model.df_resid
    assert [one.order for one in fits] == ["linear", "interactions", "quadratic"]


def test_an_order_that_the_runs_cannot_bear_has_no_numbers():
    fits = fit_summary(factorial(2).astype(float), np.array([[1.0, 2.0], [2.0, 3.0], [3, 5], [4, 4]]), region("AB"))
    assert [one.estimable for one in fits] == [True, True, False]
    assert math.isnan(fits[2].r_squared)


def test_highest_order_keeps_an_error():
    design, values = box_behnken(3, 5).astype(float), np.ones((17, 1))
    assert highest_order(design, values, "ABC") == "quadratic"
    # Eight corners: the interactions leave one degree of freedom, the linear model four.
    assert highest_order(factorial(3).astype(float), np.ones((8, 1)), "ABC") == "linear"
    assert highest_order(factorial(3).astype(float), np.ones((8, 2)), "ABC") == "interactions"


def test_terms_get_what_they_stand_on():
    assert hierarchical("ABC", ["A*C", "B^2"]) == ("A", "B", "C", "A*C", "B^2")
    assert hierarchical("ABC", ["C"]) == ("C",)
    with pytest.raises(StatisticsError, match="not a term of the model"):
        hierarchical("ABC", ["A*Z"])


def test_terms_of_an_order():
    assert terms_of("AB", "linear") == ("A", "B")
    assert terms_of("AB", "interactions") == ("A", "B", "A*B")
    assert terms_of("AB", "quadratic") == ("A", "B", "A*B", "A^2", "B^2")


def test_blocks_take_degrees_of_freedom_from_the_highest_order():
    """Twelve runs and 3 terms up to the interaction: 4 are left beside five blocks, 3 beside six, 2 beside seven."""
    coded = np.tile(factorial(2), (3, 1)).astype(float)
    random = np.random.default_rng(1)
    values = random.standard_normal((12, 1))
    for number, order in ((5, "interactions"), (6, "interactions"), (7, "linear")):
        block = random.permutation(np.resize(np.arange(number), 12))[:, None]
        days = Blocks(tuple(map(str, range(number))), block)
        assert highest_order(coded, values, "AB", blocks=days) == order
