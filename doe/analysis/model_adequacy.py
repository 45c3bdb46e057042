"""Does a fitted model disagree with single runs, and would it fit another power of the response better?

Single runs: leverage, studentised residuals, Cook's distance, DFFITS.
h_i leverage, e_i residual, s^2 = MSE, p terms: internal r_i = e_i/(s sqrt(1 - h_i)); external t_i the same with s
estimated without run i; Cook's D_i = r_i^2 h_i/((1 - h_i) p); DFFITS_i = t_i sqrt(h_i/(1 - h_i)).
Source: Cook 1977, Technometrics 19:15; Belsley, Kuh and Welsch 1980, Regression Diagnostics, ch. 2.

Power of the response: the Box–Cox profile.
z_i = (y_i^L - 1)/(L g^(L - 1)) with g the geometric mean (g ln y_i for L = 0) makes the residual sums of squares of all
powers comparable. The interval holds every L with SS(L) <= SS(best) (1 + t^2/df), with t for the level and the model's
residual degrees of freedom; for few runs it is wider than the likelihood interval.
Source: Box and Cox 1964, J. Roy. Stat. Soc. B 26:211; Montgomery 2017, Design and Analysis of Experiments, eq. 15.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.surface import Surface, least_squares
from doe.analysis.surface_anova import FULL, SurfaceAnova
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

POWERS = np.round(np.linspace(-3.0, 3.0, 121), 10)
NAMED = {-2.0: "1/y²", -1.0: "1/y", -0.5: "1/√y", 0.0: "ln y", 0.5: "√y", 1.0: "none", 2.0: "y²"}


@dataclass(frozen=True)
class Diagnostics(Record):
    """Per run of the surface, shape (runs,); NaN if a run determines its own fit (leverage one) or there is no error.

    outlier_limit: |external| at which p = 0.05 for the largest of all runs (Bonferroni). leverage_limit: 2p/n.
    outliers, leveraged, influential: positions of runs with |external| > outlier_limit, leverage > 2p/n, D > 1.
    shapiro_p: test of normality of the internal residuals (Shapiro and Wilk 1965).
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


@dataclass(frozen=True)
class BoxCox(Record):
    """Profile over `powers`, shape (powers,): ln SS(L), and its limit for the interval. best with its 95 % interval
    [low, high], both limited to the grid.

    suggestion: "none" if the interval contains 1; otherwise the named power of `NAMED` inside it that is nearest to
    the best, or the best itself. note: why there is no profile; "" where there is one.
    """

    powers: FloatArray
    log_sum_of_squares: FloatArray
    limit: float
    best: float
    low: float
    high: float
    suggestion: str
    note: str


def diagnose_fit(surface: Surface, anova: SurfaceAnova) -> Diagnostics:
    """Return the diagnostics of every run of a fitted surface."""
    model = surface.model_matrix
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
    # The test needs at least three values; equal values have no shape to test.
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


def box_cox(surface: Surface, level: float = 0.95) -> BoxCox:
    """Return the profile for the terms of the model. There is none for a response that is not positive everywhere,
    that does not vary, or that the model fits exactly.
    """
    y = surface.observed
    if y.min() <= 0:
        return _without("needs a response that is positive in every run")
    if np.ptp(y) <= 1e-12 * y.max() or surface.mse <= 1e-20 * float(y.max()) ** 2:
        return _without("needs a response that varies about the model")
    model = surface.model_matrix
    sums = np.log(residual_sums(model, y, POWERS))
    limit = float(sums.min() + np.log1p(stats.t.ppf((1 + level) / 2, surface.df_residual) ** 2 / surface.df_residual))
    # The grid is fine enough for the interval; the best is refined by the parabola through its neighbours.
    k = int(np.clip(sums.argmin(), 1, len(POWERS) - 2))
    best = _vertex(POWERS[k - 1 : k + 2], sums[k - 1 : k + 2])
    inside = POWERS[sums <= limit]
    low, high = float(inside[0]), float(inside[-1])
    return BoxCox(POWERS, sums, limit, best, low, high, _suggestion(best, low, high), "")


def residual_sums(model: FloatArray, y: FloatArray, powers: FloatArray) -> FloatArray:
    """Return SS(L) of the scaled transforms of y, shape (n,), on a model matrix (n, p), shape (powers,)."""
    scaled_y = y / math.exp(float(np.log(y).mean()))  # g = 1: powers of large numbers cannot overflow
    transformed = np.stack([np.log(scaled_y) if abs(p) < 1e-9 else (scaled_y**p - 1) / p for p in powers], axis=1)
    fitted = model @ np.linalg.lstsq(model, transformed, rcond=None)[0]
    return np.asarray(((transformed - fitted) ** 2).sum(axis=0))


def _where(found: npt.NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(found))


def _vertex(x: FloatArray, y: FloatArray) -> float:
    curve, slope, _ = np.polyfit(x, y, 2)
    return float(np.clip(-slope / (2 * curve), x[0], x[-1])) if curve > 0 else float(x[y.argmin()])


def _suggestion(best: float, low: float, high: float) -> str:
    if low <= 1 <= high:
        return NAMED[1.0]
    inside = [power for power in NAMED if low <= power <= high]
    return NAMED[min(inside, key=lambda power: abs(power - best))] if inside else f"y^{best:.2f}"


def _without(note: str) -> BoxCox:
    nothing = np.full(0, math.nan)
    return BoxCox(nothing, nothing, *(math.nan,) * 4, "none", note)
