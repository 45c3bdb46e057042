"""Shrunk covariance of grouped observations, with the effects of covariates removed; density of data under a covariance
that is estimated from few observations; shrunk means of few observations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import stats

FloatArray = npt.NDArray[np.float64]
Groups = npt.NDArray[np.int64]

OUTLIER = 0.01
"""Probability of an observation at least as far off as an outlier."""
ROUNDS = 20
"""Iterations in which the weights of outliers settle."""


def shrunk_covariance(residuals: FloatArray) -> FloatArray:
    """Covariance (d, d) of the rows (n, d), correlations shrunk to zero by λ* = Σ Var(r_ij) / Σ r_ij² over i ≠ j.

    Schäfer & Strimmer 2005, doi 10.2202/1544-6115.1175.
    """
    n = len(residuals)
    deviation = np.sqrt((residuals**2).mean(axis=0))
    z = residuals / deviation
    correlation = z.T @ z / n
    scatter = ((z**2).T @ (z**2) / n - correlation**2) / (n - 1)
    off = ~np.eye(z.shape[1], dtype=bool)
    denominator = float((correlation[off] ** 2).sum())
    share = min(1.0, float(scatter[off].sum()) / denominator) if denominator > 0.0 else 1.0
    shrunk = np.where(off, (1.0 - share) * correlation, 1.0)
    return np.asarray(shrunk * np.outer(deviation, deviation), dtype=np.float64)


def pooled_slopes(values: FloatArray, group: Groups, covariates: FloatArray) -> FloatArray:
    """Least-squares slopes (k, d) of ``values`` (n, d) on ``covariates`` (n, k) within groups."""
    inside, moved = _within(values, group), _within(covariates, group)
    return np.asarray(np.linalg.lstsq(moved, inside, rcond=None)[0], dtype=np.float64)


def residuals_within(values: FloatArray, group: Groups, covariates: FloatArray) -> FloatArray:
    """Deviations from the group means, less the effect of ``covariates``, of the rows in groups of two or more."""
    left = _within(values, group) - _within(covariates, group) @ pooled_slopes(values, group, covariates)
    count = np.bincount(group)[group].astype(np.float64)
    several = count > 1
    # Each group's mean takes a degree of freedom.
    return np.asarray((left * np.sqrt(count / np.maximum(1.0, count - 1.0))[:, None])[several], dtype=np.float64)


def log_t(d: FloatArray, variance: FloatArray, loadings: FloatArray, freedom: int) -> FloatArray:
    """Log densities (n,) at ``d`` (n, D), without the terms in D and ν = ``freedom`` alone (by Woodbury's identity).

    −½ ln|S| − ½ (ν + 1) ln(1 + dᵀ S⁻¹ d/ν),  S = diag(``variance``, (n, D)) + L Lᵀ,  L = ``loadings`` (n, D, k).
    """
    weighted = (loadings / variance[:, :, None]).swapaxes(1, 2)
    inner = np.eye(loadings.shape[2]) + weighted @ loadings
    seen = (weighted @ d[:, :, None])[:, :, 0]
    square = (d**2 / variance).sum(axis=1) - (seen * np.linalg.solve(inner, seen[..., None])[..., 0]).sum(axis=1)
    determinant = np.log(variance).sum(axis=1) + np.linalg.slogdet(inner)[1]
    return np.asarray(-0.5 * determinant - 0.5 * (freedom + 1) * np.log1p(square / freedom))


def scatter_between(
    blocks: Sequence[FloatArray],
    features: Sequence[int],
    freedom: int,
    weights: Sequence[FloatArray] | None = None,
) -> tuple[list[FloatArray], float]:
    """Squared distances of whitened observations from their mean, and their variance over its expectation, at least 1.

    Parameters
    ----------
    blocks
        Whitened observations of each group, on any axes, (n, D).
    features
        Number of features d of each group.
    freedom
        ν, degrees of freedom of the covariance that whitened them: new observations look wider by ν/(ν − d − 1).
    weights
        Weights of the observations in the mean of their group, (n,) each; equal by default.

    Returns
    -------
    Squared distances by group, (n,), each distributed as χ²_d, and the ratio of variances over all groups.
    """
    weights = [np.ones(len(z)) for z in blocks] if weights is None else weights
    squares, total, expected = [], 0.0, 0.0
    for z, d, some in zip(blocks, features, weights, strict=True):
        n = len(z)
        slack = freedom / max(0.5 * freedom, freedom - d - 1.0)
        # An observation is closer to a mean that includes it.
        squares.append(((z - np.average(z, axis=0, weights=some)) ** 2).sum(axis=1) / slack * n / max(1, n - 1))
        total += float(some @ squares[-1]) * (n - 1) / n
        expected += (n - 1) * d
    return squares, max(1.0, total / expected) if expected > 0.0 else 1.0


def outlier_weights(
    blocks: Sequence[FloatArray], features: Sequence[int], freedom: int
) -> tuple[list[FloatArray], float]:
    """Weights (n,) of whitened observations in the mean of their group, and the ratio of variances that remains.

    min(1, χ²_d(1 − ``OUTLIER``) r/q), with squared distance q and ratio r, as Huber weighs scatter (1981, Robust
    Statistics, ch. 8): an observation farther off than one in a hundred is taken to have the larger variance that puts
    it at that limit, and is weighted by the inverse of the increase. Parameters as in :func:`scatter_between`.
    """
    weights, scatter = [np.ones(len(z)) for z in blocks], 1.0
    farthest = stats.chi2.isf(OUTLIER, features)
    for _ in range(ROUNDS):
        squares, scatter = scatter_between(blocks, features, freedom, weights)
        weights = [limit / np.maximum(limit, one) for one, limit in zip(squares, farthest * scatter, strict=True)]
    return weights, scatter


def _within(values: FloatArray, group: Groups) -> FloatArray:
    count = np.bincount(group).astype(np.float64)
    means = np.zeros((len(count), values.shape[1]))
    np.add.at(means, group, values)
    return np.asarray(values - (means / count[:, None])[group], dtype=np.float64)


def shrunk_means(means: FloatArray, noise: FloatArray, weights: FloatArray) -> FloatArray:
    """Return ``means`` without the share of their differences that their errors alone would produce.

    Along each principal axis of the differences only the part that exceeds the noise is kept: the square is multiplied
    by the factor of James and Stein (1961, Proc. 4th Berkeley Symp. 1:361), 1 − noise/|m̂|², at least 0.

    Parameters
    ----------
    means
        Means to be shrunk, (n, d).
    noise
        Covariance of their errors, summed over the d features, (n, n).
    weights
        Weight of each mean, (n,).

    Returns
    -------
    Shrunk means (n, d), with the same weighted mean.
    """
    share = weights / weights.sum()
    off, root = np.eye(len(share)) - share, np.sqrt(share)[:, None]  # off @ x is x less its weighted mean
    apart, error = root * (off @ means), root * (off @ noise @ off.T) * root.T
    squares, axes = np.linalg.eigh(apart @ apart.T)
    made_up = np.einsum("iq,ij,jq->q", axes, error, axes)
    kept = np.sqrt(np.clip(1.0 - made_up / np.maximum(squares, np.finfo(float).tiny), 0.0, 1.0))
    return np.asarray(share @ means + (axes * kept) @ axes.T @ apart / root, dtype=np.float64)
