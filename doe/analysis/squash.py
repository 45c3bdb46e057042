"""Compression of the tails of observations, so that rare large values do not dominate.

Each observation x becomes  s asinh((x − x̄)/(s σ)),  s = ``SQUASH``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.analysis.covariance import FloatArray, Groups, residuals_within

SQUASH = 2.0
"""Deviation [standard deviations] up to which an observation counts in full."""


@dataclass(frozen=True)
class Squash:
    """Compresses the tails of observations that have this centre and standard deviation, (d,)."""

    centre: FloatArray
    deviation: FloatArray

    def __call__(self, values: FloatArray) -> FloatArray:
        """``values``, (n, d), with their tails compressed."""
        return np.asarray(SQUASH * np.arcsinh((values - self.centre) / (SQUASH * self.deviation)), dtype=np.float64)

    def undone(self, compressed: FloatArray) -> FloatArray:
        """The values that ``compressed``, (n, d), stand for."""
        return np.asarray(self.centre + SQUASH * self.deviation * np.sinh(compressed / SQUASH), dtype=np.float64)

    def slope(self, values: FloatArray) -> FloatArray:
        """Derivative of the compressed ``values``."""
        x = (values - self.centre) / (SQUASH * self.deviation)
        return np.asarray(1.0 / (self.deviation * np.sqrt(1.0 + x**2)), dtype=np.float64)


def squash_of(values: FloatArray, group: Groups, covariates: FloatArray, still: npt.NDArray[np.bool_]) -> Squash:
    """Centre from the mean of the rows ``still`` of ``values`` (n, d), deviation from the residuals in all groups."""
    deviation = np.sqrt((residuals_within(values, group, covariates) ** 2).mean(axis=0))
    return Squash(values[still].mean(axis=0), np.where(deviation > 0.0, deviation, 1.0))
