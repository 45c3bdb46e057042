"""What rounding of printed inputs can do to what is computed from them.

An input that is printed to ± h is anywhere in that interval. To first order the result moves by g_i = f(x + h_i) − f(x)
for input i. Two bounds hold: the sum of |g_i|, always, and √(3 Σ g_i²), three standard deviations of a sum of
independent uniform errors (variance h²/3 each). The smaller one is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from doe.audit.printed import Printed

FloatArray = npt.NDArray[np.float64]
Computation = Callable[[FloatArray], FloatArray]


def values_of(prints: Sequence[Printed]) -> FloatArray:
    """Values of printed numbers, shape (n,)."""
    return np.array([one.value for one in prints], dtype=np.float64)


def halves_of(prints: Sequence[Printed]) -> FloatArray:
    """Half units of their last digits, shape (n,)."""
    return np.array([one.half for one in prints], dtype=np.float64)


def common_half(prints: Sequence[Printed]) -> FloatArray:
    """Half units of a column of readings, shape (n,): the finest one for all, because trailing zeros get lost."""
    halves = halves_of(prints)
    return np.full(halves.shape, halves.min()) if halves.size else halves


def rounding_slack(compute: Computation, values: FloatArray, halves: FloatArray) -> FloatArray:
    """How far ``compute(values)``, shape (k,), can move when values, shape (n,), are rounded to ± halves."""
    base = compute(values)
    moves = []
    for i in np.flatnonzero(halves > 0):
        shifted = values.copy()
        shifted[i] += halves[i]
        moves.append(np.abs(compute(shifted) - base))
    if not moves:
        return np.zeros_like(base)
    table = np.array(moves)
    return np.minimum(table.sum(axis=0), np.sqrt(3 * (table**2).sum(axis=0)))


def most_agreed(
    intervals: Sequence[Sequence[tuple[float, float]]], near: float
) -> tuple[float, float, tuple[bool, ...]]:
    """The interval that lies in most of several sets of intervals, and which of the sets hold it.

    One wrong figure among many that imply the same unknown is outvoted; of several intervals with equally many votes
    the one nearest to ``near`` counts. Raises ValueError without an interval that has a width.
    """
    ends = sorted({end for choices in intervals for interval in choices for end in interval})
    regions = [(low, high) for low, high in pairwise(ends)]
    if not regions:
        raise ValueError("no interval was given")
    votes = [sum(_holds(choices, 0.5 * (low + high)) for choices in intervals) for low, high in regions]
    most = [region for region, count in zip(regions, votes, strict=True) if count == max(votes)]
    low, high = min(most, key=lambda region: max(region[0] - near, near - region[1], 0.0))
    return low, high, tuple(_holds(choices, 0.5 * (low + high)) for choices in intervals)


def _holds(choices: Sequence[tuple[float, float]], value: float) -> bool:
    return any(low <= value <= high for low, high in choices)
