"""Definitive screening designs against the algebra that defines them."""

import numpy as np
import pytest

from doe.analysis.analyse import analyse_design
from doe.analysis.steepest_ascent import Region
from doe.designs import DESIGNS, DesignOptions, definitive_screening, factor_letters
from doe.designs.definitive_screening import ORDERS, conference_matrix
from doe.errors import StatisticsError


@pytest.mark.parametrize("order", ORDERS)
def test_conference_matrices_are_orthogonal_with_a_zero_diagonal(order):
    c = conference_matrix(order)
    assert np.array_equal(c.T @ c, (order - 1) * np.eye(order))
    assert not np.diag(c).any()
    assert (np.abs(c).sum(axis=0) == order - 1).all()


@pytest.mark.parametrize("factors", [3, 4, 5, 6, 7, 9, 16, 22, 30])
def test_main_effects_are_clear_of_each_other_of_interactions_and_of_squares(factors):
    design = definitive_screening(factors)
    m = design.shape[1]
    assert len(design) == 2 * m + 1
    assert np.array_equal(design.T @ design, 2 * (m - 1) * np.eye(m))
    i, j = np.triu_indices(m)
    second_order = design[:, i] * design[:, j]
    assert not (design.T @ second_order).any()


@pytest.mark.parametrize("factors", [4, 6, 8, 10, 12])
def test_squares_are_correlated_as_published(factors):
    """1/3 − 1/(m − 1) between any two squares (Jones and Nachtsheim 2011, p. 6)."""
    squares = definitive_screening(factors) ** 2
    shared = np.corrcoef(squares.T)[np.triu_indices(factors, 1)]
    np.testing.assert_allclose(shared, 1.0 / 3.0 - 1.0 / (factors - 1), atol=1e-12)


def test_columns_left_over_carry_no_factor():
    points = DESIGNS["definitive-screening"].points(7, DesignOptions(centre=3))
    assert points.coded.shape == (19, 7)
    assert points.unused.shape == (19, 1)
    assert not (points.coded.T @ points.unused).any()
    assert not points.coded[-3:].any()


@pytest.mark.parametrize(("factors", "centre"), [(2, 1), (31, 1), (6, 0)])
def test_what_it_is_not_made_for_is_refused(factors, centre):
    with pytest.raises(StatisticsError, match=r"factors = (2|31)|centre = 0"):
        definitive_screening(factors, centre)


def test_a_planted_plane_is_found_beside_interactions_and_squares():
    """Interactions and squares shift no main effect: the fitted slopes are the planted ones to rounding."""
    x = DESIGNS["definitive-screening"].points(6, DesignOptions()).coded
    slopes = np.array([3.0, 0.0, -2.0, 0.0, 0.5, 0.0])
    y = 20.0 + x @ slopes + 4.0 * x[:, 0] * x[:, 2] - 3.0 * x[:, 4] ** 2
    letters = factor_letters(6)
    region = Region(letters, np.zeros(6), np.ones(6), ())
    found = analyse_design(x, y[:, None], region, order="linear")
    assert found.effects is None, "three levels are no contrasts of two"
    np.testing.assert_allclose(found.model.surface.coefficients[1:7], slopes, atol=1e-12)
