"""What the best pair explains, against bounded least squares, and the chance in a world of known size."""

from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import nnls

from doe.diagnose.decision.specificity import best_pair_share


def test_the_best_pair_is_that_of_non_negative_least_squares():
    generator = np.random.default_rng(0)
    units = generator.standard_normal((4, 6))
    units /= np.linalg.norm(units, axis=1)[:, None]
    drawn = generator.standard_normal((50, 6))
    along = drawn @ units.T
    found = best_pair_share(along, along, units @ units.T, np.zeros(4, dtype=bool))
    for row, share in zip(drawn, found, strict=True):
        left = min(nnls(units[list(pair)].T, row)[1] for pair in combinations(range(4), 2))
        assert row @ row - share == pytest.approx(left**2)


def test_either_sign_is_ordinary_least_squares():
    """One pair of orthogonal axes: the sum of both squares, whatever their signs."""
    along = np.array([[3.0, -4.0], [-1.0, -2.0]])
    found = best_pair_share(np.abs(along), along, np.eye(2), np.ones(2, dtype=bool))
    assert found == pytest.approx([25.0, 5.0])
