"""Prior variances of vectors, learned from noisy estimates of all of them (empirical Bayes).

Efron & Morris 1973, doi 10.1080/01621459.1973.10481350. Of an eigenvalue of the estimates' scatter, only the excess
over the largest that noise alone produces counts, ν (1 + √(D/m))² for m estimates with noise ν in D features (Marchenko
& Pastur 1967, doi 10.1070/SM1967v001n04ABEH001994); what else they vary by is spread evenly over all axes.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

LEAST_VARIANCE = 1e-3
"""Least variance of a vector along an axis, for estimates near zero."""
SCALES = np.geomspace(0.003, 3.0, 31)
"""Trial values for the variance of one vector relative to that of all."""


def prior_along_axes(estimates: FloatArray, noise: FloatArray, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Prior variances v (D,) of the vectors ``estimates`` (m, D) along their principal axes, and these axes as columns.

    ``noise``: noise variance of each estimate, (m,), times that of each feature, ``unit`` (D,). If features are not
    alike, ν and D of the largest eigenvalue are those with the same Σ ν and Σ ν².
    """
    (m, size), level = estimates.shape, float(noise.mean()) * unit
    values, axes = np.linalg.eigh(estimates.T @ estimates / m)
    alike = float((level**2).sum() / level.sum())
    leading = np.maximum(values - alike * (1.0 + np.sqrt(level.sum() / alike / m)) ** 2, 0.0)
    rest = max(LEAST_VARIANCE, float(values.sum() - level.sum() - leading.sum()) / size)
    return leading + rest, axes


def relative_sizes(estimates: FloatArray, noise: FloatArray, variances: FloatArray) -> FloatArray:
    """s (m,): variance of each of ``estimates`` (m, D), along the axes of ``variances`` v (D,), relative to the others.

    ``noise``: variance of the noise in each of them, (m, D).
    Maximizes the likelihood of β̂ ~ N(0, s v + noise). Without s, an effect that does hardly anything at the end of its
    range, such as twisting friction under a pile of small bodies, would keep the freedom of a strong effect and, by the
    noise of its own pours, agree with data of the base model better than the base model does.
    """
    square = estimates[:, None] ** 2
    total = SCALES[None, :, None] * variances + noise[:, None]
    likelihood = -0.5 * (np.log(total) + square / total).sum(axis=2)
    return np.asarray(SCALES[likelihood.argmax(axis=1)], dtype=np.float64)
