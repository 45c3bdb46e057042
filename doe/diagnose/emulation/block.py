"""The regression of one condition: coefficients, noise of a pour, and where the polynomial or an effect's runs stray.

    excess_e: variance beyond noise with which the runs of effect e miss the polynomial at full amplitude. It grows with
              the square of the amplitude, so that an effect that is off brings none.

A summary that strays by an F test of its left-out errors (a threshold, pours that jam now and then) gets its own; the
others share their mean, for a bias that is half a pour's deviation is two standard errors of a data set and no test of
one summary sees it. An effect with a summary that strays does not teach the base: its rows weigh ``APART`` in the
coefficients that they share.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.diagnose.emulation.lack_of_fit import lack_of_fit_variance
from doe.diagnose.emulation.noise import AMPLE_DF, PourNoise, pour_noise
from doe.diagnose.runs import BASE, dust

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

LEAST_SHARE = 0.1
"""Standard deviation of a pour, as a share of that over all runs, where a summary never varies in the base runs
(nothing left in the funnel) but does with an effect: it would otherwise have no noise at all."""
APART = 1e-6
STRAY_LEVEL = 0.01
"""Level of the F tests of one condition together."""


@dataclass(frozen=True)
class Rows:
    """The complete runs of a condition. design: (n, P) terms. effect: (n,), BASE for the base model.

    level_square: (n,) squared length of the coded amplitudes. settings: (n, s), equal rows are replicates.
    values: (n, d).
    """

    design: FloatArray
    effect: IntArray
    level_square: FloatArray
    settings: FloatArray
    values: FloatArray


@dataclass(frozen=True)
class Block:
    """The fit of one condition with P terms and d summaries.

    coefficients: (P, d). information_inverse: covariance of the coefficients in units of the noise, (P, P). noise: of
    one simulated pour. lack_of_fit: (d,) variance of the emulator's bias, found from replicated points (zero without).
    straying, excess: (effects, d), see above. r2: (d,) cross-validated. standardised_error: (d,) root mean square of
    the base runs' left-out errors over their standard error (1 where both agree).
    """

    coefficients: FloatArray
    information_inverse: FloatArray
    noise: PourNoise
    lack_of_fit: FloatArray
    straying: npt.NDArray[np.bool_]
    excess: FloatArray
    r2: FloatArray
    standardised_error: FloatArray


@dataclass(frozen=True)
class _Regression:
    """Weighted least squares. left_out: (n, d) errors without the row itself. spread: (n,) variance of a left-out error
    in units of the noise. leverage: (n,), so that residuals have the variance (1 - leverage) of the noise.
    """

    coefficients: FloatArray
    information_inverse: FloatArray
    residuals: FloatArray
    left_out: FloatArray
    spread: FloatArray
    leverage: FloatArray
    noise: PourNoise


def fit_block(rows: Rows, effects: int, floor: FloatArray) -> Block:
    """Fit one condition; ``floor``: (d,), least standard deviation of one pour."""
    fit = _regression(rows, np.ones(len(rows.values)), floor)
    strays = np.flatnonzero(_straying(rows, fit, effects).any(axis=1))
    if len(strays):
        fit = _regression(rows, np.where(np.isin(rows.effect, strays), APART, 1.0), floor)
    straying = _straying(rows, fit, effects)
    scatter = ((rows.values - rows.values.mean(axis=0)) ** 2).sum(axis=0)
    base = rows.effect == BASE
    basis = _basis(rows, fit.leverage)
    return Block(
        coefficients=fit.coefficients,
        information_inverse=fit.information_inverse,
        noise=fit.noise,
        lack_of_fit=lack_of_fit_variance(
            rows.settings[basis], rows.values[basis], fit.residuals[basis], fit.leverage[basis]
        ),
        straying=straying,
        excess=_excess(rows, fit, straying),
        r2=1 - np.divide((fit.left_out**2).sum(axis=0), scatter, out=np.ones(len(scatter)), where=scatter > 0),
        standardised_error=np.sqrt(_standardised_squares(fit)[base].mean(axis=0)),
    )


def _regression(rows: Rows, weights: FloatArray, floor: FloatArray) -> _Regression:
    x, y = rows.design, rows.values
    pull = np.linalg.solve(x.T @ (weights[:, None] * x), x.T * weights)
    inverse = np.asarray(pull @ pull.T, dtype=np.float64)
    coefficients = pull @ y
    residuals = y - x @ coefficients
    own = np.minimum(np.einsum("np,pn->n", x, pull), 1 - 1e-9)
    leverage = np.minimum(2 * own - np.einsum("np,pr,nr->n", x, inverse, x), 1 - 1e-9)
    basis = _basis(rows, leverage)
    overall = np.sqrt((residuals**2).sum(axis=0) / (1 - leverage).sum())
    same = np.ptp(y[basis], axis=0) <= dust(y)
    return _Regression(
        coefficients=coefficients,
        information_inverse=inverse,
        residuals=residuals,
        left_out=residuals / (1 - own)[:, None],
        spread=(1 - leverage) / (1 - own) ** 2,
        leverage=leverage,
        noise=pour_noise(
            residuals[basis], leverage[basis], np.maximum(floor, np.where(same, LEAST_SHARE * overall, 0.0))
        ),
    )


def _basis(rows: Rows, leverage: FloatArray) -> npt.NDArray[np.bool_]:
    """Return whose residuals are noise: the base runs where they are ample, else all runs."""
    base = rows.effect == BASE
    ample = (1 - leverage[base]).sum() >= AMPLE_DF * rows.values.shape[1]
    return base if ample else np.ones(len(base), dtype=bool)


def _standardised_squares(fit: _Regression) -> FloatArray:
    """Return squared left-out errors over their variance, (n, d), one on average."""
    return np.asarray(fit.left_out**2 / np.diag(fit.noise.covariance) / fit.spread[:, None])


def _straying(rows: Rows, fit: _Regression, effects: int) -> npt.NDArray[np.bool_]:
    """Return which summaries of an effect's runs miss the polynomial by more than noise, (effects, d)."""
    d = rows.values.shape[1]
    found, standardised = np.zeros((effects, d), dtype=bool), _standardised_squares(fit)
    for e in range(effects):
        own = rows.effect == e
        if own.any():
            limit = stats.f.isf(STRAY_LEVEL / (effects * d), own.sum(), fit.noise.df)
            found[e] = standardised[own].mean(axis=0) > limit
    return found


def _excess(rows: Rows, fit: _Regression, straying: npt.NDArray[np.bool_]) -> FloatArray:
    """Return the variance beyond noise at full amplitude, (effects, d)."""
    found, variance = np.zeros(straying.shape), np.diag(fit.noise.covariance)
    # One that never varies in the base runs has a variance by agreement, and misses nothing.
    varies = (fit.residuals[rows.effect == BASE] ** 2).mean(axis=0) > 0.1 * variance
    for e, stray in enumerate(straying):
        own = rows.effect == e
        if not own.any():
            continue
        level = rows.level_square[own, None]
        beyond = fit.left_out[own] ** 2 / variance - fit.spread[own, None]
        at_full = (level * beyond).sum(axis=0) / (level**2).sum()
        together = at_full[varies & ~stray].mean() if (varies & ~stray).any() else 0.0
        found[e] = np.maximum(0.0, np.where(stray, at_full, np.where(varies, together, 0.0))) * variance
    return found
