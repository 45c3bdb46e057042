"""Mean and interval of numbers with weights."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


def mean_towards(values: FloatArray, best: int, weights: FloatArray) -> FloatArray:
    """Mean (p,) of the rows of ``values`` (n, p) with the sign, or within 45° of the direction, of row ``best``.

    Over all signs or directions the mean is near zero where the weights do not tell them apart. Its size is the mean of
    the sizes, its direction that of the mean.
    """
    sizes = np.linalg.norm(values, axis=1)
    near = values @ values[best] > (math.sqrt(0.5) - 1e-9) * sizes * sizes[best]
    mean, size = weights[near] @ values[near], weights[near] @ sizes[near] / weights[near].sum()
    return np.asarray(size * mean / np.linalg.norm(mean), dtype=np.float64)


def weighted_interval(values: FloatArray, weights: FloatArray) -> tuple[float, float]:
    """95 % interval of ``values`` (n,) with ``weights`` that add up to one, interpolated linearly between them."""
    order = np.argsort(values)
    below = np.cumsum(weights[order]) - 0.5 * weights[order]
    low, high = np.interp([0.025, 0.975], below, values[order])
    return float(low), float(high)
