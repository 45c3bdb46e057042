"""Means of few observations, drawn together, against closed forms."""

import numpy as np
import pytest

from doe.analysis.covariance import shrunk_means


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
