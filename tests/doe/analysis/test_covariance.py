"""Means of few observations, drawn together, and observations that are far off theirs, against closed forms."""

import numpy as np
import pytest
from scipy import stats

from doe.analysis.covariance import outlier_weights, scatter_between, shrunk_means


@pytest.mark.parametrize("weights", [(0.5, 0.5), (0.9, 0.1)])
def test_of_two_means_the_square_of_the_gap_loses_what_their_noise_puts_there(weights):
    rng, weights = np.random.default_rng(1), np.array(weights)
    means = rng.standard_normal((2, 30)) + np.array([[0.0], [1.5]])
    found = shrunk_means(means, np.diag([12.0, 5.0]), weights)
    gap, left = means[1] - means[0], found[1] - found[0]
    assert left @ left == pytest.approx(gap @ gap - 17.0)
    assert left == pytest.approx(gap * np.sqrt(1.0 - 17.0 / (gap @ gap)))
    assert weights @ found == pytest.approx(weights @ means)


def test_errors_that_two_means_share_are_no_noise_between_them():
    means = np.random.default_rng(2).standard_normal((2, 30))
    found = shrunk_means(means, np.full((2, 2), 40.0), np.array([0.7, 0.3]))
    assert found == pytest.approx(means)


def test_means_within_their_noise_become_one():
    means = np.random.default_rng(3).standard_normal((2, 30))
    found = shrunk_means(means, np.eye(2) * 60.0, np.array([0.5, 0.5]))
    assert found == pytest.approx(np.tile(means.mean(axis=0), (2, 1)))


def test_two_that_differ_by_noise_come_together_beside_one_that_is_far_off():
    """True squares of the gaps are 900 and 0; the raw ones have 60 of noise, over 300 sets of 30 features each."""
    rng, gaps = np.random.default_rng(4), []
    for _ in range(300):
        means = rng.standard_normal((3, 30))
        means[0, 0] += 30.0
        found = shrunk_means(means, np.eye(3) * 30.0, np.array([0.4, 0.3, 0.3]))
        gaps.append([((found[i] - found[j]) ** 2).sum() for i, j in ((0, 1), (1, 2))])
    far, near = np.mean(gaps, axis=0)
    # Four standard errors of |30 + N(0, 2)|², whose deviation is 2 x 30 x sqrt 2 and that of the rest's square.
    assert far == pytest.approx(900.0, abs=4.0 * 85.0 / np.sqrt(300) + 30.0)
    assert near < 8.0


def test_scatter_between_is_that_of_pours_and_of_no_single_one():
    rng = np.random.default_rng(5)
    blocks = [2.0 * rng.standard_normal((400, 20)), 2.0 * rng.standard_normal((400, 10))]
    squares, scatter = scatter_between(blocks, [20, 10], 10**9)
    assert scatter == pytest.approx(4.0, rel=0.05)
    assert [one.mean() for one in squares] == pytest.approx([80.0, 40.0], rel=0.05)
    assert scatter_between([np.ones((1, 20))], [20], 10**9)[1] == 1.0


def test_what_was_whitened_by_few_pours_looks_wider():
    """Five hundred covariances of 30 degrees of freedom each, in ten features."""
    rng, found = np.random.default_rng(6), []
    for _ in range(500):
        taught = rng.standard_normal((30, 10))
        white = np.linalg.inv(np.linalg.cholesky(taught.T @ taught / 30))
        found.append(scatter_between([rng.standard_normal((6, 10)) @ white.T], [10], 30)[0][0].mean())
    assert np.mean(found) == pytest.approx(10.0, rel=0.05)


def test_an_outlier_counts_as_if_it_were_as_far_off_as_one_in_a_hundred():
    rng = np.random.default_rng(7)
    calm = rng.standard_normal((6, 20))
    wild = calm.copy()
    wild[2] += 10.0
    (same, one), scatter = outlier_weights([calm, wild], [20, 20], 10**9)
    assert same == pytest.approx(np.ones(6))
    assert np.delete(one, 2) == pytest.approx(np.ones(5))
    mean = np.average(wild, axis=0, weights=one)
    assert one[2] == pytest.approx(stats.chi2.isf(0.01, 20) * scatter / (((wild[2] - mean) ** 2).sum() * 6 / 5))
    assert one[2] < 0.05
    assert scatter < 1.3 < 9.0 < scatter_between([calm, wild], [20, 20], 10**9)[1]


def test_one_in_a_hundred_is_an_outlier():
    rng = np.random.default_rng(8)
    ((weights,), scatter) = outlier_weights([rng.standard_normal((4000, 20))], [20], 10**9)
    assert (weights < 1.0).mean() == pytest.approx(0.01, abs=0.005)
    assert scatter == pytest.approx(1.0, abs=0.02)
