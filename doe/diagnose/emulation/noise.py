"""Noise of one pour: its covariance from the simulated runs, shrunk and compared with the measured replicates.

The runs give it with tens to hundreds of degrees of freedom, the measured replicates with few. So the covariance of the
measured mean is the simulated one divided by n, unless the measured variance of a summary differs (F test,
Bonferroni): then that summary takes its measured standard deviation and keeps the simulated correlations.
Source: Ledoit and Wolf 2004; Schäfer and Strimmer 2005, Stat. Appl. Genet. Mol. Biol. 4:32 (target: the diagonal).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.record import Record

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

LEAST_SHRINKAGE = 0.01
"""Correlations are always multiplied by 0.99: summaries that are almost copies of each other would otherwise turn the
smallest error of the emulator into many standard deviations of their difference."""

AMPLE_DF = 5.0
"""Degrees of freedom per summary from which the covariance is not shrunk further."""


@dataclass(frozen=True)
class PourNoise(Record):
    """Covariance of one simulated pour of a condition, (d, d), with its degrees of freedom.

    shrinkage: weight of the diagonal. rows: (N, d) standardised residuals behind it, of unit covariance, for
    resampling; empty where N < 10 d, and draws are Gaussian then. Not singular.
    """

    covariance: FloatArray
    df: float
    shrinkage: float
    rows: FloatArray


@dataclass(frozen=True)
class VarianceComparison(Record):
    """Measured against simulated variance of each summary of a condition: ratio, two-sided p of F, and the decision.

    measured_df: replicates - 1. differs: p < level/(all summaries). statement: which covariance the measured mean got.
    """

    ratio: FloatArray
    p: FloatArray
    measured_df: int
    differs: BoolArray
    statement: str


def pour_noise(residuals: FloatArray, leverage: FloatArray, floor: FloatArray) -> PourNoise:
    """Return the noise of one pour from least-squares residuals (N, d) with their leverages (N,).

    S = sum e e'/sum(1 - h). floor: (d,) least standard deviation per summary.
    """
    df = float((1 - leverage).sum())
    d = residuals.shape[1]
    scatter = residuals.T @ residuals / df
    variance = np.maximum(np.diag(scatter), floor**2)
    weight = max(LEAST_SHRINKAGE, diagonal_weight(residuals) if df < AMPLE_DF * d else 0.0)
    covariance = shrink(scatter, weight)
    np.fill_diagonal(covariance, variance)
    return PourNoise(covariance, df, weight, _standardised(residuals / np.sqrt(1 - leverage)[:, None], covariance))


def shrink(covariance: FloatArray, weight: float) -> FloatArray:
    """Return (1 - weight) S + weight diag(S), shape (..., d, d)."""
    d = covariance.shape[-1]
    return np.asarray(covariance * np.where(np.eye(d, dtype=bool), 1.0, 1 - weight))


def diagonal_weight(rows: FloatArray) -> float:
    """Return the Ledoit-Wolf weight of the diagonal: sum var(r_ij)/sum r_ij^2 over i != j, within [0, 1].

    rows: (n, d), centred at zero, standardised here; r_ij is the mean over rows of z_i z_j, and its variance is
    estimated from the scatter of those products.
    """
    n, d = rows.shape
    spread = np.sqrt((rows**2).mean(axis=0))
    z = np.divide(rows, spread, out=np.zeros_like(rows), where=spread > 0)
    correlation = z.T @ z / n
    variance = ((z**2).T @ (z**2) / n - correlation**2) / n
    off = ~np.eye(d, dtype=bool)
    total = float((correlation[off] ** 2).sum())
    return 1.0 if total == 0 else float(np.clip(variance[off].sum() / total, 0.0, 1.0))


def compare_variances(
    noise: PourNoise, replicates: FloatArray, comparisons: int, level: float = 0.01
) -> tuple[FloatArray, VarianceComparison]:
    """Return the covariance of one measured pour, (d, d), and how it was chosen.

    replicates: (r, d). comparisons: summaries of all conditions, by which the level is divided.
    """
    d = noise.covariance.shape[0]
    df = len(replicates) - 1
    if df < 1:
        nothing = np.full(d, np.nan)
        statement = "one replicate: the simulated covariance, unchecked"
        return noise.covariance, VarianceComparison(nothing, nothing, df, np.zeros(d, dtype=bool), statement)
    measured = replicates.var(axis=0, ddof=1)
    ratio = measured / np.diag(noise.covariance)
    upper = stats.f.sf(ratio, df, noise.df)
    p = np.minimum(1.0, 2 * np.minimum(upper, 1 - upper))
    # A variance of exactly zero says that the reading is coarse, not that the next one would be the same.
    differs = (p < level / comparisons) & (measured > 0)
    factor = np.where(differs, np.sqrt(ratio), 1.0)
    statement = (
        f"simulated covariance ({noise.df:.0f} df against {df} measured), {int(differs.sum())} of {d} summaries with "
        "their measured standard deviation"
    )
    return noise.covariance * np.outer(factor, factor), VarianceComparison(ratio, p, df, differs, statement)


def _standardised(rows: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return rows turned to mean zero and unit covariance, or none where too few to resample or degenerate."""
    n, d = rows.shape
    centred = rows - rows.mean(axis=0)
    if n < 10 * d or not (centred.std(axis=0) > 0).all():
        return np.empty((0, d))
    own = shrink(centred.T @ centred / n, LEAST_SHRINKAGE)
    return np.asarray(np.linalg.solve(np.linalg.cholesky(own), centred.T).T)
