"""Is a fitted model at odds with single runs? Leverage, studentised residuals, Cook's distance, DFFITS.

h_i leverage, e_i residual, s^2 = MSE, p terms: internal r_i = e_i/(s sqrt(1 - h_i)); external t_i the same with s
estimated without run i; Cook's D_i = r_i^2 h_i/((1 - h_i) p); DFFITS_i = t_i sqrt(h_i/(1 - h_i)).
Source: Cook 1977, Technometrics 19:15; Belsley, Kuh and Welsch 1980, Regression Diagnostics, ch. 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.record import Record
from doe.surface import Surface, least_squares, second_order_terms
from doe.surface_anova import FULL, SurfaceAnova

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Diagnostics(Record):
    """Per run of the surface, shape (runs,); NaN where a run decides its own fit (leverage one) or there is no error.

    outlier_limit: |external| at which p = 0.05 for the largest of all runs (Bonferroni). leverage_limit: 2p/n.
    outliers, leveraged, influential: positions of the runs beyond |external| > outlier_limit, leverage > 2p/n, D > 1.
    shapiro_p: of normality of the internal residuals (Shapiro and Wilk 1965).
    """

    residual: FloatArray
    leverage: FloatArray
    internal: FloatArray
    external: FloatArray
    cooks_distance: FloatArray
    dffits: FloatArray
    outlier_limit: float
    leverage_limit: float
    outliers: tuple[int, ...]
    leveraged: tuple[int, ...]
    influential: tuple[int, ...]
    shapiro_p: float


def diagnose_fit(surface: Surface, anova: SurfaceAnova) -> Diagnostics:
    """Return the diagnostics of every run of a fitted surface."""
    model = second_order_terms(surface.points)[:, surface.included]
    influence = least_squares(model, surface.observed).get_influence()
    h, (n, p) = surface.leverage, model.shape
    testable = (h < FULL) & (surface.mse > 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        internal, cooks, external = (
            np.where(testable, values, np.nan)
            for values in (
                influence.resid_studentized_internal,
                influence.cooks_distance[0],
                anova.studentized_residuals,
            )
        )
        odds = h / np.where(testable, 1 - h, np.nan)
    df = surface.df_residual - 1
    limit = float(stats.t.ppf(1 - 0.025 / n, df)) if df > 0 else math.nan
    known = internal[np.isfinite(internal)]
    # Three values are the least that the test takes; equal ones carry no shape.
    normal = known.size >= 3 and float(np.ptp(known)) > 0
    return Diagnostics(
        residual=surface.observed - surface.predicted,
        leverage=h,
        internal=internal,
        external=external,
        cooks_distance=cooks,
        dffits=external * np.sqrt(odds),
        outlier_limit=limit,
        leverage_limit=2 * p / n,
        outliers=_where(np.abs(external) > limit),
        leveraged=_where(h > 2 * p / n),
        influential=_where(cooks > 1),
        shapiro_p=float(stats.shapiro(known).pvalue) if normal else math.nan,
    )


def _where(found: npt.NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(found))
