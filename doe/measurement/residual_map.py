"""Where in scanned piles a model is off: measured minus poured height over the plate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.record import Record

FloatArray = npt.NDArray[np.float64]

LEAST_ERROR = 1e-4
"""Standard error [m] below which no height is known: the plate far from the pile is bare in every pour."""


@dataclass(frozen=True)
class HeightDifference(Record):
    """Measured minus poured mean height (n, n) [m], rows along x, and the same in standard errors of the two means."""

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
        To the calibrated base model, and to the final one.
    """

    condition: str
    role: str
    pixel: float
    measured: FloatArray
    before: HeightDifference
    after: HeightDifference


def height_difference(measured: FloatArray, poured: FloatArray) -> HeightDifference:
    """Of measured (r, n, n) and poured (m, n, n) heights, with one standard deviation of a pour for both."""
    r, m = len(measured), len(poured)
    step = measured.mean(axis=0) - poured.mean(axis=0)
    error = pooled_deviation(measured, poured) * np.sqrt(1.0 / r + 1.0 / m)
    return HeightDifference(step, step / np.maximum(error, LEAST_ERROR))


def pooled_deviation(one: FloatArray, other: FloatArray) -> FloatArray:
    """Standard deviation within two samples (n, …), one for both."""
    both = np.concatenate([one - one.mean(axis=0), other - other.mean(axis=0)])
    return np.asarray(np.sqrt((both**2).sum(axis=0) / (len(both) - 2)), dtype=np.float64)
