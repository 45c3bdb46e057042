"""Observations in clusters that share part of their noise, such as several views of one experiment.

With correlation ρ within a cluster of g observations, its mean has (1 + (g − 1) ρ)/g of one variance, and a deviation
from it 1 − ρ. Divided by the roots of 1 − ρ and of 1 + (g − 1) ρ, deviations and means have the noise of g independent
observations, so that ordinary least squares becomes generalized least squares (Aitken 1935, doi
10.1017/S0370164600014346).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Clusters = npt.NDArray[np.int64]

MOST_ALIKE = 0.95
"""Largest correlation. No model of the differences within a cluster is exact enough to know them without noise."""


def intraclass_correlation(residuals: FloatArray, cluster: Clusters) -> FloatArray:
    """ρ (D,) of each column of ``residuals`` (n, D) of mean zero, from 0 to ``MOST_ALIKE``; 0 without a cluster of two.

    Mean product of two residuals of a cluster over their mean square (Fisher 1925, Statistical Methods for Research
    Workers, § 38).
    """
    own, count = _members(cluster)
    products = ((own @ residuals) ** 2).sum(axis=0) - (residuals**2).sum(axis=0)
    squares = (count - 1.0) @ residuals**2
    found = np.divide(products, squares, out=np.zeros_like(squares), where=squares > 0.0)
    return np.asarray(np.clip(found, 0.0, MOST_ALIKE), dtype=np.float64)


def decorrelated(values: FloatArray, cluster: Clusters, correlation: FloatArray) -> FloatArray:
    """``values`` (n, c) or (D, n, c) made independent, (D, n, c).

    ``correlation``: ρ (D, n) of the noise of each observation with that of the others in its cluster.
    """
    own, count = _members(cluster)
    mean = (own @ values)[..., np.unique(cluster, return_inverse=True)[1], :] / count[:, None]
    inside = 1.0 / np.sqrt(1.0 - correlation)[:, :, None]
    between = 1.0 / np.sqrt(1.0 + (count - 1.0) * correlation)[:, :, None]
    return np.asarray(inside * (values - mean) + between * mean, dtype=np.float64)


def _members(cluster: Clusters) -> tuple[FloatArray, FloatArray]:
    """Which observations are in each cluster, 1 or 0, (clusters, n), and how many are in each one's cluster, (n,)."""
    own = (np.unique(cluster)[:, None] == cluster).astype(np.float64)
    return own, own.sum(axis=1) @ own
