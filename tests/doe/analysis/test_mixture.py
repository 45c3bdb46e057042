"""Mixtures: Scheffé's polynomials against their closed form on a lattice, and least squares by another program."""

import numpy as np
import pytest
import statsmodels.api as sm

from doe.analysis.mixture import bearable_order, fit_mixture, mixture_matrix, mixture_terms
from doe.designs import DESIGNS, DesignOptions
from doe.designs.mixture import simplex_centroid, simplex_lattice
from doe.errors import StatisticsError

BLENDS = np.array([(1, 0, 0), (0.5, 0.5, 0), (0, 1, 0), (0, 0.5, 0.5), (0, 0, 1), (0.5, 0, 0.5)])
ELONGATION = np.array(
    [
        (11.0, 12.4, np.nan),
        (15.0, 14.8, 16.1),
        (8.8, 10.0, np.nan),
        (10.0, 9.7, 11.8),
        (16.8, 16.0, np.nan),
        (17.7, 16.4, 16.6),
    ]
)
"""Of yarn of three polymers, of a {3, 2} lattice (Cornell 2002, Experiments with Mixtures, table 2.3)."""
NONE = np.zeros(3)


def test_lattice_and_centroid_are_the_published_sets_of_blends():
    lattice = simplex_lattice(3, 3)
    assert len(lattice) == 10  # C(5, 3)
    thirds = {(a, b, 3 - a - b) for a in range(4) for b in range(4 - a)}
    assert {tuple(row) for row in np.rint(3 * lattice).astype(int).tolist()} == thirds
    centroid = simplex_centroid(4)
    assert len(centroid) == 15  # 2^4 - 1
    assert np.allclose(centroid.sum(axis=1), 1)
    for row in centroid:
        assert len(set(row[row > 0].tolist())) == 1  # equal shares
    assert np.array_equal(lattice[:3], np.eye(3))


def test_coefficients_of_a_lattice_are_those_of_its_closed_form():
    """b_i = ȳ_i and b_ij = 4 ȳ_ij - 2 (ȳ_i + ȳ_j) (Scheffé 1958): 11.7, 9.4, 16.4, 19.0, 11.4, -9.6 for the yarn, as
    printed.
    """
    found = fit_mixture(BLENDS, ELONGATION, NONE, "ABC", "quadratic")
    means = np.nanmean(ELONGATION, axis=1)
    single, pair = means[[0, 2, 4]], {(0, 1): means[1], (0, 2): means[5], (1, 2): means[3]}
    closed = [*single, *(4 * mean - 2 * (single[i] + single[j]) for (i, j), mean in pair.items())]
    assert found.terms == ("A", "B", "C", "A*B", "A*C", "B*C")
    assert found.coefficients == pytest.approx(closed)
    assert found.coefficients == pytest.approx([11.7, 9.4, 16.4, 19.0, 11.4, -9.6])
    # All that is left is the scatter of the repeated blends; a pure part has the error of its mean.
    pure = np.nansum((ELONGATION - means[:, None]) ** 2)
    assert found.sigma**2 == pytest.approx(pure / 9)
    assert found.standard_errors[0] == pytest.approx(found.sigma / 2**0.5)


def test_errors_and_shares_explained_are_those_of_another_program():
    """statsmodels on the columns without an intercept; R² is about the mean, as the shares add up to one."""
    random = np.random.default_rng(3)
    blends = np.vstack([simplex_lattice(4, 3), np.full((3, 4), 0.25)])
    values = 40 + blends @ [3, -8, 5, 1] + 20 * blends[:, 0] * blends[:, 1] + random.normal(size=len(blends))
    found = fit_mixture(blends, values[:, None], np.zeros(4), "ABCD", "quadratic")
    model = mixture_matrix(blends, mixture_terms("ABCD", "quadratic"))
    theirs = sm.OLS(values, model, hasconst=True).fit()
    assert found.coefficients == pytest.approx(theirs.params)
    assert found.standard_errors == pytest.approx(theirs.bse)
    assert found.p[4:] == pytest.approx(theirs.pvalues[4:])
    assert np.isnan(found.p[:4]).all()
    assert found.r_squared == pytest.approx(theirs.rsquared)
    assert found.r_squared_adjusted == pytest.approx(theirs.rsquared_adj)
    for blend in (found.highest, found.lowest):
        there = theirs.get_prediction(mixture_matrix(blend.amounts[None], mixture_terms("ABCD", "quadratic")))
        assert (blend.predicted, blend.standard_error) == pytest.approx((there.predicted_mean[0], there.se_mean[0]))
    press = ((theirs.resid / (1 - theirs.get_influence().hat_matrix_diag)) ** 2).sum()
    assert found.r_squared_predicted == pytest.approx(1 - press / ((values - values.mean()) ** 2).sum())
    assert found.rows[0].f == pytest.approx(theirs.fvalue)


def test_sums_of_squares_of_the_orders_add_up():
    found = fit_mixture(BLENDS, ELONGATION, NONE, "ABC", "linear")
    rows = {row.source: row for row in found.rows}
    assert rows["model"].sum_of_squares + rows["residual"].sum_of_squares == pytest.approx(rows["total"].sum_of_squares)
    lack, pure = rows["lack_of_fit"], rows["pure_error"]
    assert lack.sum_of_squares + pure.sum_of_squares == pytest.approx(rows["residual"].sum_of_squares)
    assert (lack.df, pure.df, rows["total"].df) == (3, 9, 14)
    # What the plane leaves between the blends is what the products take.
    curved = fit_mixture(BLENDS, ELONGATION, NONE, "ABC", "quadratic")
    quadratic = next(row for row in curved.rows if row.source == "quadratic")
    assert quadratic.sum_of_squares == pytest.approx(lack.sum_of_squares)
    assert quadratic.f == pytest.approx(lack.f)


def test_lows_make_a_smaller_simplex_and_amounts_any_whole():
    """The same blends in kilograms of 20, of which at least 2, 4 and 6 of each: the same polynomial."""
    lows = np.array([2.0, 4.0, 6.0])
    found = fit_mixture(lows + 8 * BLENDS, ELONGATION, lows, "ABC", "quadratic")
    assert found.coefficients == pytest.approx([11.7, 9.4, 16.4, 19.0, 11.4, -9.6])
    assert found.highest.amounts.sum() == pytest.approx(20)


def test_the_highest_blend_is_that_of_calculus():
    """On the edge of A and C the polynomial 11.7 a + 16.4 c + 11.4 a c is highest at c = 1/2 + 4.7/22.8 = 0.706."""
    found = fit_mixture(BLENDS, ELONGATION, NONE, "ABC", "quadratic")
    c = 0.5 + 4.7 / 22.8
    assert found.highest.amounts == pytest.approx([1 - c, 0, c], abs=found.step)
    assert found.highest.predicted == pytest.approx(11.7 * (1 - c) + 16.4 * c + 11.4 * c * (1 - c), abs=1e-3)
    assert found.lowest.predicted <= 9.4


@pytest.mark.parametrize(
    "blends, order",
    [
        (simplex_centroid(3), "linear"),  # 7 runs: 4 degrees of freedom for a plane, 1 beside the products
        (np.vstack([simplex_centroid(3)] * 2), "special cubic"),
        (np.repeat(simplex_lattice(3, 2), 2, axis=0), "quadratic"),
        (np.repeat(simplex_lattice(2, 3), 2, axis=0), "quadratic"),
        (simplex_lattice(3, 1), None),
    ],
)
def test_the_order_is_the_highest_that_the_runs_bear(blends, order):
    assert bearable_order(blends, "ABCD"[: blends.shape[1]]) == order


def test_too_few_runs_and_too_many_blends_are_refused():
    with pytest.raises(
        StatisticsError, match="3 valid runs are too few for the 3 terms of the linear mixture polynomial"
    ):
        fit_mixture(np.eye(3), np.ones((3, 1)), NONE, "ABC")
    with pytest.raises(StatisticsError, match="no range is left"):
        fit_mixture(BLENDS, ELONGATION, np.full(3, 0.5), "ABC")
    with pytest.raises(StatisticsError, match="up to 20000"):
        simplex_lattice(12, 8)
    with pytest.raises(StatisticsError, match="2 to 10"):
        DESIGNS["mixture"].points(11, DesignOptions())


@pytest.mark.parametrize("value", [5.0, 0.1 + 0.2])
def test_a_constant_response_has_no_r_squared_and_no_sum_of_squares(value):
    same = np.full((6, 3), value)
    same[0, 0] = np.nextafter(value, np.inf)  # rounding is no scatter
    found = fit_mixture(BLENDS, same, NONE, "ABC", "quadratic")
    assert np.isnan(found.shares_explained).all()
    assert {row.sum_of_squares for row in found.rows} == {0.0}
    assert np.isnan([*found.p, *(row.p for row in found.rows)]).all()
    assert found.sigma == 0.0


def test_the_highest_blend_keeps_to_the_highs():
    """With c = 0.3 the polynomial of the lattice is highest at b = 4.7/38 = 0.124, by its slope along a + b = 0.7."""
    highs = np.array([1.0, 1.0, 0.3])
    found = fit_mixture(BLENDS, ELONGATION, NONE, "ABC", "quadratic", highs)
    assert found.highest.amounts == pytest.approx([0.7 - 4.7 / 38, 4.7 / 38, 0.3], abs=found.step)
    assert fit_mixture(BLENDS, ELONGATION, NONE, "ABC", "quadratic", np.ones(3)).highest.amounts[2] > 0.6
    # Highs between two steps of the lattice: what was run is left.
    narrow = fit_mixture(BLENDS, ELONGATION, NONE, "ABC", "quadratic", np.full(3, 0.3331))
    assert narrow.highest.amounts.tolist() in BLENDS.tolist()
