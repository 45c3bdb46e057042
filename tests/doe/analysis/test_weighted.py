"""Mean and interval of numbers with weights, against closed forms."""

import math

import numpy as np
import pytest
from scipy import stats

from doe.analysis.weighted import mean_towards, weighted_interval


def test_an_interval_is_that_of_its_weights():
    """Nodes 0.1 apart with the weights of a normal number of deviation 0.7 about 1; half of a step is 0.05."""
    nodes = np.random.default_rng(0).permutation(np.arange(-4.0, 6.05, 0.1))
    weights = stats.norm.pdf(nodes, 1.0, 0.7)
    assert weighted_interval(nodes, weights / weights.sum()) == pytest.approx(
        stats.norm.ppf([0.025, 0.975], 1.0, 0.7), abs=5e-3
    )


def test_a_mean_has_the_sign_of_the_best_number():
    values, weights = np.array([[-2.0], [-1.0], [1.0], [2.0]]), np.array([0.2, 0.3, 0.1, 0.4])
    assert mean_towards(values, 3, weights) == pytest.approx([(0.1 + 2.0 * 0.4) / 0.5])
    assert mean_towards(values, 0, weights) == pytest.approx([-(0.3 + 2.0 * 0.2) / 0.5])


def test_a_mean_in_the_plane_is_over_a_quarter_about_the_best_and_as_long_as_its_vectors():
    """Every 30° on a circle of radius 3, all as likely: those within 45° of the best, whose mean is not shortened."""
    angles = np.radians(np.arange(0.0, 360.0, 30.0))
    circle = 3.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    found = mean_towards(circle, 2, np.full(12, 1.0 / 12.0))
    assert found == pytest.approx([3.0 * math.cos(math.radians(60.0)), 3.0 * math.sin(math.radians(60.0))])
