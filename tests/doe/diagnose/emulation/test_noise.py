"""Covariance of a pour, its shrinkage, and the comparison of variances."""

import numpy as np
import pytest
from scipy import stats

from doe.diagnose.emulation.noise import LEAST_SHRINKAGE, compare_variances, diagonal_weight, pour_noise, shrink
from doe.diagnose.fitting.pseudo_data import wishart


def normal_rows(n, covariance, seed=0):
    return np.random.default_rng(seed).multivariate_normal(np.zeros(len(covariance)), covariance, n)


def test_covariance_of_replicates_is_the_sample_covariance():
    """One mean fitted to n runs: leverage 1/n, df = n - 1."""
    rows = normal_rows(400, np.array([[4.0, 1.0], [1.0, 1.0]]))
    residuals = rows - rows.mean(axis=0)
    noise = pour_noise(residuals, np.full(400, 1 / 400), np.zeros(2))
    assert noise.df == pytest.approx(399)
    assert noise.shrinkage == LEAST_SHRINKAGE
    expected = np.cov(rows.T) * np.array([[1, 0.99], [0.99, 1]])
    assert noise.covariance == pytest.approx(expected)
    assert np.cov(noise.rows.T, ddof=0) == pytest.approx(np.eye(2), abs=0.02)


def test_few_rows_are_shrunk_and_invertible():
    rows = normal_rows(6, np.eye(10))
    noise = pour_noise(rows, np.zeros(6), np.zeros(10))
    assert noise.shrinkage > 0.5
    assert np.linalg.eigvalsh(noise.covariance).min() > 0
    assert noise.rows.size == 0


def test_weight_falls_with_the_rows_when_summaries_are_correlated():
    correlated = np.full((4, 4), 0.8) + 0.2 * np.eye(4)
    assert diagonal_weight(normal_rows(2000, correlated)) < 0.01 < diagonal_weight(normal_rows(12, correlated))


def test_weight_is_large_when_they_are_not():
    weights = [diagonal_weight(normal_rows(50, np.eye(6), seed)) for seed in range(20)]
    assert np.mean(weights) > 0.7


def test_shrinking_keeps_the_diagonal():
    matrix = np.array([[2.0, 1.0], [1.0, 3.0]])
    assert shrink(matrix, 0.25).tolist() == [[2.0, 0.75], [0.75, 3.0]]


def test_floor_replaces_a_zero_variance():
    noise = pour_noise(np.column_stack([normal_rows(50, np.eye(1)), np.zeros(50)]), np.zeros(50), np.array([0, 0.5]))
    assert noise.covariance[1, 1] == 0.25


def test_variance_comparison_has_its_level():
    """F test with Bonferroni at 0.01 over 8 summaries: at most about 1 % of sets see a difference where there is
    none.
    """
    noise = pour_noise(normal_rows(200, np.eye(8)), np.zeros(200), np.zeros(8))
    seen = sum(
        compare_variances(noise, normal_rows(6, noise.covariance, seed), 8)[1].differs.any() for seed in range(1, 401)
    )
    assert seen <= stats.binom.ppf(0.999, 400, 0.01)


def test_a_measured_variance_that_differs_is_used():
    noise = pour_noise(normal_rows(200, np.eye(2)), np.zeros(200), np.zeros(2))
    replicates = normal_rows(8, np.diag([400.0, 1.0]), 3)
    covariance, comparison = compare_variances(noise, replicates, 2)
    assert comparison.differs.tolist() == [True, False]
    assert covariance[0, 0] == pytest.approx(replicates[:, 0].var(ddof=1))
    assert covariance[1, 1] == noise.covariance[1, 1]
    assert "1 of 2" in comparison.statement
    assert comparison.p[0] == pytest.approx(2 * stats.f.sf(comparison.ratio[0], 7, noise.df))


def test_one_replicate_is_not_compared():
    noise = pour_noise(normal_rows(200, np.eye(2)), np.zeros(200), np.zeros(2))
    covariance, comparison = compare_variances(noise, np.zeros((1, 2)), 2)
    assert (covariance == noise.covariance).all()
    assert not comparison.differs.any()


def test_wishart_draws_have_the_mean_and_variance_of_the_distribution():
    """Var(S_ij) = (s_ij^2 + s_ii s_jj)/df; 4000 draws, limits of four standard errors."""
    covariance = np.array([[2.0, 0.6], [0.6, 1.0]])
    draws = wishart(covariance, 20.0, 4000, np.random.default_rng(0))
    variance = (covariance**2 + np.outer(np.diag(covariance), np.diag(covariance))) / 20
    assert (np.abs(draws.mean(axis=0) - covariance) < 4 * np.sqrt(variance / 4000)).all()
    # The relative standard error of a variance from 4000 draws of a skewed distribution is about 3 %.
    assert draws.var(axis=0) == pytest.approx(variance, rel=0.12)
