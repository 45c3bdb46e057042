"""Whether a walk said to be a steepest ascent is one.

Steepest ascent moves the factors in proportion to their effects. A walk whose coded levels are the same for every
factor is the diagonal of the box instead: an even grid through the screened ranges, on which "best" means "the k-th
step of the grid".
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from doe.audit.finding import Finding, Remark
from doe.audit.rounding import values_of
from doe.audit.study import Ascent, Screening

FloatArray = npt.NDArray[np.float64]
CLOSE = 0.01
"""Coded levels that differ by less are the same: half a percent of a range, the rounding of printed settings."""


def check_walk(ascent: Ascent, screening: Screening) -> Iterator[Finding]:
    """A remark where the walk is a grid of the screened ranges or does not follow the effects."""
    ranges = {factor.name: (factor.low, factor.high) for factor in screening.factors}
    if not set(ascent.factors) <= ranges.keys():
        return
    coded = _coded(ascent, ranges)
    steps = len(ascent.steps)
    if _is_grid(coded):
        effects = _effects(ascent, screening)
        wanted = ", ".join(f"{name} {share:.2f}" for name, share in zip(ascent.factors, effects, strict=True))
        best = (
            f" The best step, {ascent.best}, is the grid's step {_position(ascent)} of {steps}." if ascent.best else ""
        )
        yield Remark(
            "direction of the ascent",
            ascent.where,
            f"The {steps} steps are an even grid from end to end of the ranges that {screening.where_runs}'s screening "
            f"used for {', '.join(ascent.factors)}, all factors at once; along the steepest ascent, shares of their "
            f"ranges would be {wanted}.{best}",
        )


def _coded(ascent: Ascent, ranges: dict[str, tuple[float, float]]) -> FloatArray:
    """Settings in the screening's coded units, shape (steps, factors)."""
    low, high = np.array([ranges[name] for name in ascent.factors]).T
    return (2 * ascent.settings - low - high) / (high - low)


def _is_grid(coded: FloatArray) -> bool:
    """Whether all factors go evenly from one end of their range to the other."""
    even = np.linspace(-1.0, 1.0, len(coded))
    return len(coded) > 2 and all(
        min(np.abs(column - even).max(), np.abs(column + even).max()) <= CLOSE for column in coded.T
    )


def _effects(ascent: Ascent, screening: Screening) -> FloatArray:
    """Sizes of the effects, √SS, as shares of the largest, shape (factors,)."""
    sums = dict(zip((factor.name for factor in screening.factors), values_of(screening.sums), strict=True))
    sizes = np.sqrt([sums[name] for name in ascent.factors])
    return np.asarray(sizes / sizes.max())


def _position(ascent: Ascent) -> int:
    return ascent.steps.index(str(ascent.best)) + 1
