"""Replicated responses: a matrix with one row per design point and one column per replicate, NaN where
missing.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


def require_matrix(name: str, values: npt.ArrayLike, rows: int) -> FloatArray:
    """Return `values` as floats of shape (rows, replicates); a vector counts as one replicate per row.

    Raises StatisticsError for another shape, an infinite value or no valid value at all.
    """
    matrix = np.asarray(values, dtype=np.float64)
    if matrix.ndim == 1:
        matrix = matrix[:, None]
    if matrix.ndim != 2 or matrix.shape[0] != rows:
        raise StatisticsError(f"{name} has shape {matrix.shape}; allowed is ({rows}, replicates)")
    if np.isinf(matrix).any():
        raise StatisticsError(f"{name} holds an infinite value; a missing run is written as NaN")
    if np.isnan(matrix).all():
        raise StatisticsError(f"{name} holds no valid run")
    return matrix


def valid_runs(responses: npt.ArrayLike, rows: int) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return the responses as in `require_matrix`, and the row and the value of every valid run, row by row."""
    values = require_matrix("responses", responses, rows)
    row, replicate = np.nonzero(~np.isnan(values))
    return values, row, values[row, replicate]


def row_moments(matrix: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return per row the mean (NaN if empty), the number of valid runs, and the sum of squares about the
    mean.
    """
    valid = ~np.isnan(matrix)
    counts = valid.sum(axis=1).astype(np.float64)
    means = np.where(counts > 0, np.where(valid, matrix, 0.0).sum(axis=1) / np.maximum(counts, 1), np.nan)
    deviation = np.where(valid, matrix - np.where(counts > 0, means, 0.0)[:, None], 0.0)
    # Equal replicates leave rounding errors of the order of eps x value, which must not count as measured noise.
    dust = 8 * np.finfo(np.float64).eps * np.abs(np.where(valid, matrix, 0.0)).max(axis=1)
    deviation[np.abs(deviation) <= dust[:, None]] = 0.0
    return means, counts, (deviation**2).sum(axis=1)


def centred(values: FloatArray) -> FloatArray:
    """Return `values` minus their mean, shape (n,); exact zeros if they differ only by rounding."""
    dust = 8 * np.finfo(np.float64).eps * np.abs(values).max()
    return np.zeros_like(values) if np.ptp(values) <= dust else values - values.mean()
