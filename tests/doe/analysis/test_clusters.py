"""Observations in clusters that share part of their noise: generalized least squares, written out as matrices."""

import numpy as np
import pytest
from scipy.linalg import block_diag

from doe.analysis.clusters import MOST_ALIKE, decorrelated, intraclass_correlation

SIZES = (1, 3, 5, 2, 1)
CLUSTER = np.repeat([7, 2, 4, 0, 9], SIZES)


@pytest.mark.parametrize("correlation", [0.0, 0.3, 0.9])
def test_what_was_decorrelated_gives_generalized_least_squares(correlation):
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((12, 3)), rng.standard_normal((12, 1))
    noise = block_diag(*((1.0 - correlation) * np.eye(g) + correlation * np.ones((g, g)) for g in SIZES))
    weight = np.linalg.inv(noise)
    alike = np.full((1, 12), correlation)
    rows, values = (decorrelated(one, CLUSTER, alike)[0] for one in (x, y))
    assert rows.T @ rows == pytest.approx(x.T @ weight @ x)
    assert rows.T @ values == pytest.approx(x.T @ weight @ y)


def test_every_column_has_a_correlation_of_its_own():
    rng = np.random.default_rng(1)
    x, alike = rng.standard_normal((12, 2)), np.array([0.2, 0.7])[:, None] * np.ones(12)
    both = decorrelated(x, CLUSTER, alike)
    assert both.shape == (2, 12, 2)
    for one, some in zip(both, alike, strict=True):
        assert one == pytest.approx(decorrelated(x, CLUSTER, some[None])[0])
    assert decorrelated(both, CLUSTER, 0.0 * alike) == pytest.approx(both)


def test_the_correlation_within_clusters_is_found():
    """Common and own noise of variances ρ and 1 − ρ in 2,000 clusters of two to four; standard error 0.02."""
    rng, rho = np.random.default_rng(2), np.array([0.0, 0.4, 0.8, 1.0])
    cluster = np.repeat(np.arange(2000), rng.integers(2, 5, 2000))
    common, own = rng.standard_normal((2000, 4)), rng.standard_normal((len(cluster), 4))
    found = intraclass_correlation(np.sqrt(rho) * common[cluster] + np.sqrt(1.0 - rho) * own, cluster)
    assert found == pytest.approx([0.0, 0.4, 0.8, MOST_ALIKE], abs=0.08)


def test_single_observations_and_opposite_ones_share_nothing():
    rng = np.random.default_rng(3)
    assert intraclass_correlation(rng.standard_normal((5, 2)), np.arange(5)) == pytest.approx([0.0, 0.0])
    one = rng.standard_normal((5, 2))
    assert intraclass_correlation(np.concatenate([one, -one]), np.tile(np.arange(5), 2)) == pytest.approx([0.0, 0.0])
    assert intraclass_correlation(np.zeros((0, 2)), np.zeros(0, int)) == pytest.approx([0.0, 0.0])
