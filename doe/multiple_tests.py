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
    # The same numbers as statsmodels' multipletests, which collects garbage at every call: 0.2 s each, several times
    # for every look at a study that runs.
    adjusted = np.full(p_values.shape, np.nan)
    order = [int(i) for i in np.argsort(p_values) if not np.isnan(p_values[i])]
    running = 0.0
    for rank, i in enumerate(order):
        running = max(running, min(1.0, (len(order) - rank) * float(p_values[i])))
        adjusted[i] = running
    return adjusted
