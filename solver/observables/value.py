"""What an observable returns: a number with its unit and, where one exists, its spread."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Value:
    """One observed number. NaN means: not measurable on this record."""

    value: float
    unit: str
    spread: float | None = None
    """Sample standard deviation of the parts that ``value`` is the mean of (views, flanks), same unit."""


def mean_value(parts: Sequence[float], unit: str) -> Value:
    """Mean and sample standard deviation of those ``parts`` that could be measured; NaN where none could."""
    finite = np.asarray(parts, dtype=np.float64)
    finite = finite[np.isfinite(finite)]
    if finite.size == 0:
        return Value(float("nan"), unit, None)
    spread = float(finite.std(ddof=1)) if finite.size > 1 else None
    return Value(float(finite.mean()), unit, spread)
