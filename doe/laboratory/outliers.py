"""Outliers among replicates: Grubbs's test, and its extension to several, the generalised extreme studentised deviate.

    R_i = max |x − mean| / s  of what is left after i − 1 removals
    λ_i = (n − i) t / √((n − i − 1 + t²)(n − i + 1)),  t the 1 − α/(2(n − i + 1)) point of Student's t, n − i − 1 df

The number of outliers is the largest i with R_i > λ_i. With one removal at most it is Grubbs's two-sided test, which is
exact for any n; with several it needs about 15 values. Sources: Grubbs 1969, Technometrics 11:1; Rosner 1983,
Technometrics 25:165.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy import stats

ENOUGH_FOR_SEVERAL = 15
LARGEST_SHARE = 0.2
"""Of the values, that may be outliers where there are enough to look for several."""
NEGLIGIBLE = 1e-12
"""Spread relative to the largest value that is rounding."""


def most_outliers(n: int) -> int:
    """How many of ``n`` values may be named outliers: one below 15, a fifth of them from there on, none of two."""
    if n < 3:
        return 0
    return 1 if n < ENOUGH_FOR_SEVERAL else int(LARGEST_SHARE * n)


def critical_deviate(n: int, removed: int, level: float = 0.05) -> float:
    """λ for the deviate found after ``removed`` removals from ``n`` values."""
    left = n - removed
    t = float(stats.t.ppf(1.0 - level / (2.0 * left), left - 2))
    return (left - 1) * t / math.sqrt((left - 2 + t * t) * left)


def deviates(values: npt.ArrayLike, most: int) -> tuple[tuple[int, float], ...]:
    """Index and R of the farthest value, of the farthest of the rest, … ``most`` of them."""
    array = np.asarray(values, dtype=np.float64)
    left, found = list(range(array.size)), []
    for _ in range(most):
        rest = array[left]
        spread = float(rest.std(ddof=1))
        if spread <= NEGLIGIBLE * float(np.abs(rest).max()):
            break
        distance = np.abs(rest - rest.mean()) / spread
        k = int(distance.argmax())
        found.append((left[k], float(distance[k])))
        del left[k]
    return tuple(found)


def outliers(values: npt.ArrayLike, level: float = 0.05) -> tuple[int, ...]:
    """Indices of the outliers at ``level``, the farthest first."""
    n = np.asarray(values).size
    found = deviates(values, most_outliers(n))
    beyond = [i for i, (_, deviate) in enumerate(found) if deviate > critical_deviate(n, i, level)]
    return tuple(index for index, _ in found[: beyond[-1] + 1]) if beyond else ()
