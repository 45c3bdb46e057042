"""Many effects at once: Holm's correction of p values and Lenth's error for designs without replicates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.record import Record

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Lenth(Record):
    """Lenth's pseudo standard error with its individual and simultaneous 95 % margins, unit of the
    response.
    """

    pseudo_standard_error: float
    df: float
    margin: float
    simultaneous_margin: float


def lenth(effects: FloatArray, alpha: float = 0.05) -> Lenth:
    """Return Lenth's pseudo standard error of m effects, shape (m,): PSE = 1.5 median{|c| : |c| < 2.5 s0}.

    s0 = 1.5 median|c|; df = m/3; margin = t(1 - alpha/2, df) PSE; the simultaneous margin uses
    (1 + (1 - alpha)^(1/m))/2 instead of 1 - alpha/2. Source: Lenth 1989.
    """
    sizes = np.abs(effects)
    first = 1.5 * float(np.median(sizes))
    kept = sizes[sizes < 2.5 * first]
    error = 1.5 * float(np.median(kept)) if kept.size else 0.0
    df = sizes.size / 3
    simultaneous = (1 + (1 - alpha) ** (1 / sizes.size)) / 2
    return Lenth(error, df, float(stats.t.ppf(1 - alpha / 2, df)) * error, float(stats.t.ppf(simultaneous, df)) * error)


def holm(p_values: FloatArray) -> FloatArray:
    """Return step-down adjusted p values (Holm 1979, Scand. J. Stat. 6:65), shape of the input; NaN stays
    NaN.
    """
    # Imported where they are used: statsmodels takes a second to load, and a page or a plan needs none of it.
    from statsmodels.stats.multitest import multipletests

    adjusted, known = np.full(p_values.shape, np.nan), ~np.isnan(p_values)
    if known.any():
        adjusted[known] = multipletests(p_values[known], method="holm")[1]
    return adjusted
