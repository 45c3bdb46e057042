"""Response surface against the paper's printed ANOVA, statsmodels, and simulated truth."""

import json
import math

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from hypothesis import given, settings
from hypothesis import strategies as st
from statsmodels.stats.anova import anova_lm

from doe.analysis.canonical import canonical_analysis
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import Blocks, fit_surface, second_order_terms
from doe.analysis.surface_anova import analyse_surface
from doe.designs import box_behnken
from doe.errors import StatisticsError

REGION = Region(("A", "B", "D"), np.array([58.34, 0.62, 0.608]), np.array([6.08, 0.05, 0.036]), ())
DESIGN = box_behnken(3, centre=5)
FORMULA = "y ~ A + B + D + A:B + A:D + B:D + I(A**2) + I(B**2) + I(D**2)"
STATSMODELS_TERMS = ("A", "B", "D", "A:B", "A:D", "B:D", "I(A ** 2)", "I(B ** 2)", "I(D ** 2)")

# Processes 2022, 10, 185, Table 8: coded X1, X2, X3 and the angle of repose in degrees.
PAPER = np.array(
    [
        (-1, 0, -1, 21.48),
        (-1, 0, 1, 22.39),
        (1, 0, -1, 23.95),
        (1, 0, 1, 26.48),
        (0, -1, -1, 21.34),
        (0, -1, 1, 22.49),
        (0, 1, -1, 25.22),
        (0, 1, 1, 26.53),
        (-1, -1, 0, 20.77),
        (1, -1, 0, 21.63),
        (-1, 1, 0, 22.15),
        (1, 1, 0, 26.67),
        (0, 0, 0, 24.15),
        (0, 0, 0, 24.72),
        (0, 0, 0, 24.65),
        (0, 0, 0, 23.96),
        (0, 0, 0, 24.37),
    ]
)
# Table 9 and the text: source, sum of squares, p value (None where the paper prints none).
PRINTED = (
    ("A", 17.82, None, 0.01),
    ("B", 25.70, None, 0.01),
    ("D", 4.35, 0.0009, 0.01),
    ("A*B", 3.35, 0.0018, 0.01),
    ("A*D", 0.6561, 0.0685, 1e-4),
    ("B*D", 0.0064, 0.8378, 1e-4),
    ("A^2", 3.74, 0.0013, 0.01),
    ("B^2", 1.63, 0.0116, 0.01),
    ("D^2", 0.0916, 0.4480, 1e-4),
    ("lack_of_fit", 0.5753, 0.2805, 1e-4),
    ("pure_error", 0.4174, None, 1e-4),
    ("residual", 0.9927, None, 1e-4),
    ("model", 57.55, None, 0.01),
    ("total", 58.54, None, 0.01),
)


def paper_surface():
    return fit_surface(PAPER[:, :3], PAPER[:, 3], REGION)


def frame_of(surface):
    return pd.DataFrame(surface.points, columns=["A", "B", "D"]).assign(y=surface.observed, point=surface.point_of_run)


def noisy(coefficients, sigma, replicates, seed=0):
    mean = second_order_terms(DESIGN.astype(float)) @ np.asarray(coefficients, dtype=float)
    return mean[:, None] + sigma * np.random.default_rng(seed).standard_normal((17, replicates))


@pytest.mark.parametrize("source, sum_of_squares, p, last_digit", PRINTED)
def test_table_8_reproduces_table_9(source, sum_of_squares, p, last_digit):
    row = analyse_surface(paper_surface()).row(source)
    # Half a unit in the last printed digit, and 1 % of it for a tie at the half.
    assert row.sum_of_squares == pytest.approx(sum_of_squares, abs=0.505 * last_digit)
    if p is not None:
        assert row.p == pytest.approx(p, abs=0.505e-4)


def test_table_8_reproduces_the_printed_fit_statistics():
    anova = analyse_surface(paper_surface())
    assert anova.cv_percent == pytest.approx(1.59, abs=0.005)
    assert anova.r_squared == pytest.approx(0.983, abs=0.0005)
    assert anova.r_squared_adjusted == pytest.approx(0.9612, abs=0.00005)
    assert anova.row("model").p < 1e-4
    assert anova.better_than_noise
    assert [anova.row(name).df for name in ("model", "residual", "lack_of_fit", "pure_error")] == [9, 7, 3, 4]


@pytest.mark.parametrize("replicates", [1, 3])
def test_anova_and_diagnostics_agree_with_statsmodels(replicates):
    values = noisy([24, 1, 2, 0.5, 0.5, 0, 0, -1, 0, 0.2], 1.0, replicates)
    values[3, 0] = np.nan if replicates > 1 else values[3, 0]
    surface = fit_surface(DESIGN, values, REGION)
    anova = analyse_surface(surface)
    frame = frame_of(surface)
    fit = smf.ols(FORMULA, frame).fit()
    table = anova_lm(fit, typ=3)
    influence = fit.get_influence()
    for own, other in zip(surface.terms[1:], STATSMODELS_TERMS, strict=True):
        assert anova.row(own).sum_of_squares == pytest.approx(table.loc[other, "sum_sq"], rel=1e-8)
        assert anova.row(own).p == pytest.approx(table.loc[other, "PR(>F)"], rel=1e-7)
    pure = anova_lm(fit, smf.ols("y ~ C(point)", frame).fit())
    assert anova.row("lack_of_fit").f == pytest.approx(pure.loc[1, "F"])
    assert anova.row("lack_of_fit").p == pytest.approx(pure.loc[1, "Pr(>F)"])
    assert anova.row("model").f == pytest.approx(fit.fvalue)
    assert anova.r_squared == pytest.approx(fit.rsquared)
    assert anova.r_squared_adjusted == pytest.approx(fit.rsquared_adj)
    assert anova.press == pytest.approx((influence.resid_press**2).sum())
    assert anova.studentized_residuals == pytest.approx(influence.resid_studentized_external)
    assert surface.leverage == pytest.approx(influence.hat_matrix_diag)
    assert anova.coefficient_standard_errors == pytest.approx(fit.bse.to_numpy())
    place = {"A": [0.3], "B": [-0.7], "D": [1.0]}
    summary = fit.get_prediction(pd.DataFrame(place)).summary_frame(alpha=0.05)
    low, high = surface.confidence_interval([0.3, -0.7, 1.0])
    assert surface.standard_error([0.3, -0.7, 1.0]) == pytest.approx(summary["mean_se"][0])
    assert (low, high) == pytest.approx((summary["mean_ci_lower"][0], summary["mean_ci_upper"][0]))


def test_leaving_out_rows_is_harder_than_leaving_out_runs():
    """Checked by brute force: refit without each design row and all its replicates."""
    values = noisy([24, 1, 2, 0.5, 0.5, 0, 0, -1, 0, 0.2], 1.0, 3)
    anova = analyse_surface(fit_surface(DESIGN, values, REGION))
    press = 0.0
    for row in range(17):
        others = np.delete(np.arange(17), row)
        left_out = fit_surface(DESIGN[others], values[others], REGION)
        press += float(((values[row] - left_out.predict(DESIGN[row])) ** 2).sum())
    assert anova.r_squared_predicted_by_row == pytest.approx(1 - press / anova.row("total").sum_of_squares)
    assert anova.r_squared_predicted_by_row < anova.r_squared_predicted


def test_one_run_per_row_makes_both_predicted_r_squared_the_same():
    anova = analyse_surface(paper_surface())
    assert anova.r_squared_predicted_by_row == pytest.approx(anova.r_squared_predicted)


@pytest.mark.parametrize(
    "point, factor", [((0, 0, 0), 0.447), ((1, 0, 0), 0.602), ((1, 1, 0), 0.866), ((1, 1, 1), 1.167)]
)
def test_standard_error_over_the_cube_in_units_of_sigma(point, factor):
    """sqrt(x'(X'X)^-1 x) of the 17-run design: centre sqrt(1/5), edge sqrt(3/4), corner above one."""
    surface = paper_surface()
    assert surface.standard_error(point) / math.sqrt(surface.mse) == pytest.approx(factor, abs=5e-4)


def test_adequate_precision_by_its_definition():
    surface = paper_surface()
    # The mean variance of a prediction over the design is p MSE/n, since leverages sum to p.
    mean_variance = np.mean(surface.standard_error(surface.points) ** 2)
    expected = (surface.predicted.max() - surface.predicted.min()) / math.sqrt(mean_variance)
    assert analyse_surface(surface).adequate_precision == pytest.approx(expected)


def test_noise_alone_gives_a_high_r_squared_and_is_called_noise():
    """R^2 of 9 terms on 17 noise runs is Beta(9/2, 7/2): mean 9/16, 95th percentile 0.83."""
    studies = [analyse_surface(fit_surface(DESIGN, noisy([24] + [0] * 9, 1.0, 1, s), REGION)) for s in range(300)]
    r_squared = np.array([study.r_squared for study in studies])
    # Standard error of the mean of 300 values with sd 0.165.
    assert r_squared.mean() == pytest.approx(9 / 16, abs=4 * 0.165 / math.sqrt(300))
    assert np.percentile(r_squared, 95) == pytest.approx(0.83, abs=0.05)
    assert np.mean([study.better_than_noise for study in studies]) < 0.08
    assert any("not better than noise" in note for note in studies[0].notes)


def test_a_planted_surface_is_recovered_within_its_standard_errors():
    truth = np.array([24, 1.5, 1.8, 0.7, 0.9, 0.4, 0.0, -0.9, -0.6, 0.1])
    surface = fit_surface(DESIGN, noisy(truth, 0.5, 4, seed=5), REGION)
    errors = analyse_surface(surface).coefficient_standard_errors
    # 4 standard errors for ten coefficients: one wrong alarm in about 1500 seeds; this seed is fixed.
    assert (np.abs(surface.coefficients - truth) < 4 * errors).all()


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-5, 5), min_size=3, max_size=3))
def test_natural_coefficients_are_the_same_polynomial(place):
    surface = paper_surface()
    natural = REGION.natural(np.array(place))
    # Cancellation among terms of size 1e3 costs about three digits.
    assert second_order_terms(natural) @ surface.coefficients_natural == pytest.approx(
        float(surface.predict(place)), abs=1e-8
    )


def test_a_missing_centre_and_missing_replicates_are_left_out_and_counted():
    values = noisy([24, 1, 2, 0.5, 0, 0, 0, 0, 0, 0], 0.3, 2)
    values[0, 1] = values[16] = np.nan
    surface = fit_surface(DESIGN, values, REGION)
    assert surface.missing_runs == 3
    assert surface.df_residual == 31 - 10


def test_too_many_missing_points_are_refused():
    values = noisy([24] + [0] * 9, 1.0, 2)
    values[:4] = np.nan
    with pytest.raises(StatisticsError, match=r"9 distinct points .* cannot separate the 10 terms"):
        fit_surface(DESIGN, values, REGION)


def test_a_constant_response_has_no_ratio_and_says_so():
    anova = analyse_surface(fit_surface(DESIGN, np.full((17, 2), 24.1), REGION))
    assert math.isnan(anova.r_squared)
    assert math.isnan(anova.row("A").p)
    assert not anova.better_than_noise
    assert anova.notes == ("The response is the same in every run; there is nothing to fit.",)


def test_identical_replicates_are_not_taken_for_pure_error():
    values = np.repeat(noisy([24, 1, 2, 0.5, 0, 0, 0, 0, 0, 0], 0.3, 1), 3, axis=1)
    values[12:] = values[12]
    anova = analyse_surface(fit_surface(DESIGN, values, REGION))
    assert math.isnan(anova.row("lack_of_fit").p)
    assert any("seed" in note for note in anova.notes)


def test_canonical_analysis_finds_a_planted_maximum():
    # y = 30 - (A - 0.5)^2 - 2 (B + 0.2)^2 - 3 D^2, multiplied out.
    truth = [30 - 0.25 - 0.08, 1.0, -0.8, 0, 0, 0, 0, -1, -2, -3]
    found = canonical_analysis(fit_surface(DESIGN, noisy(truth, 0.0, 1), REGION))
    assert found.kind == "maximum"
    assert found.inside
    assert found.stationary_coded == pytest.approx([0.5, -0.2, 0])
    assert found.stationary_response == pytest.approx(30)
    assert found.eigenvalues == pytest.approx([-3, -2, -1])
    assert found.stationary_natural == pytest.approx(REGION.natural([0.5, -0.2, 0]))


@pytest.mark.parametrize("squares, kind", [((1, 2, 3), "minimum"), ((-1, 2, 3), "saddle"), ((0, 0, 0), "ridge")])
def test_canonical_analysis_names_the_shape(squares, kind):
    found = canonical_analysis(fit_surface(DESIGN, noisy([24, 1, 2, 0.5, 0, 0, 0, *squares], 0.0, 1), REGION))
    assert found.kind == kind
    assert np.isnan(found.stationary_coded).all() == (kind == "ridge")


def test_wrong_shapes_are_named():
    with pytest.raises(StatisticsError, match=r"coded has shape \(17, 2\)"):
        fit_surface(DESIGN[:, :2], np.ones(17), REGION)
    with pytest.raises(StatisticsError, match=r"responses has shape \(16, 1\)"):
        fit_surface(DESIGN, np.ones(16), REGION)


def test_the_results_are_plain_json():
    surface = paper_surface()
    for result in (surface, analyse_surface(surface), canonical_analysis(surface)):
        kept = json.loads(json.dumps(result.to_dict(), allow_nan=False))
        assert type(result).from_dict(kept).to_dict() == kept


def test_a_run_that_the_fit_cannot_do_without_has_no_left_out_residual(recwarn):
    """Seven runs for six terms, one point twice: all the other runs have leverage 1."""
    points = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1], [0, 0], [1, 0]], dtype=float)
    responses = np.array([[1.0, np.nan], [2.0, np.nan], [4.0, np.nan], [3.0, np.nan], [2.5, 2.7], [2.2, np.nan]])
    anova = analyse_surface(fit_surface(points, responses, Region(("a", "b"), np.zeros(2), np.ones(2), ())))
    assert anova.press == np.inf
    assert np.isnan(anova.r_squared_predicted)
    assert np.isnan(anova.r_squared_predicted_by_row)
    assert not anova.better_than_noise
    assert not [warning for warning in recwarn if issubclass(warning.category, RuntimeWarning)]


def test_blocks_of_unequal_size_are_those_of_statsmodels():
    """Of the blocks before the terms (Type I), of the terms beside all (Type III), effects that sum to zero."""
    rng = np.random.default_rng(6)
    design = np.repeat(DESIGN, 2, axis=0)
    block = rng.integers(3, size=len(design))
    block[:12] = 0
    y = 20 + 2 * design[:, 0] + np.array([0.0, 3.0, -1.0])[block] + rng.standard_normal(len(design))
    region = Region(("A", "B", "D"), np.zeros(3), np.ones(3), ())
    surface = fit_surface(design, y[:, None], region, ("A", "B", "D"), Blocks(("x", "y", "z"), block[:, None]))
    found = analyse_surface(surface)
    frame = pd.DataFrame(design, columns=["A", "B", "D"]).assign(y=y, block=block)
    fit = smf.ols("y ~ C(block, Sum) + A + B + D", frame).fit()
    first, partial = anova_lm(fit, typ=1), anova_lm(fit, typ=3)
    assert found.row("block").sum_of_squares == pytest.approx(first.loc["C(block, Sum)", "sum_sq"])
    for name in ("A", "B", "D"):
        assert found.row(name).p == pytest.approx(partial.loc[name, "PR(>F)"])
    effects = [fit.params[f"C(block, Sum)[S.{k}]"] for k in (0, 1)]
    assert surface.block_effects == pytest.approx([*effects, -sum(effects)])
    assert surface.coefficients[0] == pytest.approx(fit.params["Intercept"])
    assert surface.predicted == pytest.approx(fit.fittedvalues)
