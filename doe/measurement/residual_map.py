"""Where a model deviates from scanned piles: measured minus poured height over the plate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.record import Record

FloatArray = npt.NDArray[np.float64]

LEAST_ERROR = 1e-4
"""Least standard error [m] assumed for a height: far from the pile the plate is bare in every pour, without scatter."""


@dataclass(frozen=True)
class HeightDifference(Record):
    """Measured minus poured mean height (n, n) [m], rows along x, and the same in standard errors of the difference."""

    height: FloatArray
    z: FloatArray


@dataclass(frozen=True)
class ResidualMap(Record):
    """The differences of one scanned condition.

    Attributes
    ----------
    condition, role
        Its name, and "fit" or "holdout".
    pixel
        Width of a pixel [m]; the axis is in the middle of the map.
    measured
        Mean measured height (n, n) [m].
    before, after
        Differences from the calibrated base model, and from the final one.
    """

    condition: str
    role: str
    pixel: float
    measured: FloatArray
    before: HeightDifference
    after: HeightDifference


def height_difference(measured: FloatArray, poured: FloatArray) -> HeightDifference:
    """Return the difference of measured (r, n, n) and poured (m, n, n) heights, with a pooled SD of a pour for both."""
    r, m = len(measured), len(poured)
    step = measured.mean(axis=0) - poured.mean(axis=0)
    error = pooled_deviation(measured, poured) * np.sqrt(1.0 / r + 1.0 / m)
    return HeightDifference(step, step / np.maximum(error, LEAST_ERROR))


def pooled_deviation(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the pooled standard deviation of two samples of shape (n, …)."""
    both = np.concatenate([one - one.mean(axis=0), other - other.mean(axis=0)])
    return np.asarray(np.sqrt((both**2).sum(axis=0) / (len(both) - 2)), dtype=np.float64)
