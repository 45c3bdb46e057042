"""Pseudo-measured data of a fitted model: what the same experiment would give if that model were the truth.

Each set repeats what is random in the comparison: the mean of n pours (residual vectors of the simulated runs, drawn
whole, where they are many; Gaussian otherwise), the emulator's and the instrument's error, the independently
measured parameters, and the estimate of the covariance itself (Wishart). Source: Davison and Hinkley 1997, ch. 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.emulation.noise import shrink
from doe.diagnose.fitting.calibrate import Evidence, Fit, measured_noise

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class PseudoData:
    """B sets. Per condition: means (B, d_c), weights = inverse covariance (B, d_c, d_c). prior_mean: (B, k).

    emulation: (B, d_c), the part of the means that is the emulator's error.
    """

    means: tuple[FloatArray, ...]
    emulation: tuple[FloatArray, ...]
    weights: tuple[FloatArray, ...]
    prior_mean: FloatArray


def draw_pseudo_data(emulator: Emulator, evidence: Evidence, truth: Fit, sets: int, seed: int) -> PseudoData:
    """Return `sets` pseudo-data sets with `truth` as the true model."""
    generator = np.random.default_rng(seed)
    predictor, k = truth.predictor, truth.predictor.parameters
    fitted = np.split(predictor.mean(truth.x), np.cumsum([m.size for m in evidence.means])[:-1])
    emulated, shares = predictor.mean_covariance(truth.x), predictor.variance_shares(truth.x)
    biases = predictor.bias_variance(truth.x)
    noise = measured_noise(predictor, evidence)
    means, errors, weights = [], [], []
    for c, block in enumerate(emulator.blocks):
        systematic, count, pour = np.diag(evidence.systematic[c]), evidence.counts[c], noise[c]
        simulated = block.noise.covariance
        errors.append(gaussian(emulated[c], sets, generator))
        means.append(fitted[c] + _mean_of_pours(block.noise.rows, pour, count, sets, generator) + errors[c])
        estimate = shrink(wishart(simulated, block.noise.df, sets, generator), block.noise.shrinkage)
        spread = np.sqrt(np.diag(pour) / np.diag(simulated)) * _spread_error(evidence, c, sets, generator)
        bias = np.diag(biases[c])
        covariance = (
            estimate * (spread[:, :, None] * spread[:, None, :]) / count + shares[c] * estimate + bias + systematic
        )
        weights.append(np.asarray(np.linalg.inv(covariance), dtype=np.float64))
    measured = evidence.prior_weight > 0
    sd = np.where(measured, 1 / np.sqrt(np.where(measured, evidence.prior_weight, 1.0)), 0.0)
    priors = truth.x[:k] + sd * generator.standard_normal((sets, k))
    instrument = [gaussian(np.diag(variance), sets, generator) for variance in evidence.systematic]
    means = [mean + error for mean, error in zip(means, instrument, strict=True)]
    return PseudoData(tuple(means), tuple(errors), tuple(weights), priors)


def gaussian(covariance: FloatArray, sets: int, generator: np.random.Generator) -> FloatArray:
    """Return draws from N(0, covariance), (sets, d); the covariance may be singular."""
    sd = np.sqrt(np.diag(covariance))
    # Eigenvalues of the correlations: those of the covariance lose the summaries of small unit.
    values, vectors = np.linalg.eigh(covariance / np.outer(*(np.where(sd > 0, sd, 1.0),) * 2))
    root = vectors * np.sqrt(np.maximum(values, 0.0)) * sd[:, None]
    return np.asarray(generator.standard_normal((sets, len(values))) @ root.T)


def wishart(covariance: FloatArray, df: float, sets: int, generator: np.random.Generator) -> FloatArray:
    """Return draws of an estimated covariance with mean `covariance`, (sets, d, d), by Bartlett's decomposition.

    df below d is raised to d, so that the draw is regular.
    """
    d = len(covariance)
    df = max(df, float(d))
    lower = np.tril(generator.standard_normal((sets, d, d)), -1)
    lower[:, np.arange(d), np.arange(d)] = np.sqrt(generator.chisquare(df - np.arange(d), size=(sets, d)))
    root = np.linalg.cholesky(covariance) @ lower
    return np.asarray(root @ root.transpose(0, 2, 1) / df)


def _mean_of_pours(
    rows: FloatArray, pour: FloatArray, count: int, sets: int, generator: np.random.Generator
) -> FloatArray:
    """Return the error of the mean of `count` pours, (sets, d)."""
    d = len(pour)
    if len(rows):
        drawn = rows[generator.integers(0, len(rows), size=(sets, count))].mean(axis=1)
    else:
        drawn = generator.standard_normal((sets, d)) / np.sqrt(count)
    return np.asarray(drawn @ np.linalg.cholesky(pour).T)


def _spread_error(evidence: Evidence, condition: int, sets: int, generator: np.random.Generator) -> FloatArray:
    """Return the relative error of the standard deviations taken from the replicates, (sets, d); one for the others."""
    comparison = evidence.variances[condition]
    df = max(comparison.measured_df, 1)
    drawn = np.sqrt(generator.chisquare(df, size=(sets, comparison.differs.size)) / df)
    return np.where(comparison.differs, drawn, 1.0)
