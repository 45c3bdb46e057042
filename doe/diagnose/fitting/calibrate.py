"""Calibration of one model of the race against the measured means, with standard errors and edges.

    T^2(x) = r' Sigma^-1 r + sum ((theta_i - mean_i)/sd_i)^2,   r = measured mean - emulated mean
    Sigma = S/n + Cov(emulated mean) + instrument variance

Sigma is held fixed while T^2 is minimised, else the fit would be drawn to where the emulator knows least. Models are
compared by their deviance D = T^2 + ln|Sigma| - ln|Sigma_base|, which charges a model for the uncertainty it brings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.emulation.noise import VarianceComparison, compare_variances
from doe.diagnose.emulation.predictor import Predictor
from doe.diagnose.fitting.misfit import Misfit, best_start, build_misfit, minimise
from doe.diagnose.runs import Declared, Observed

FloatArray = npt.NDArray[np.float64]

STARTS = 8
"""Starting points of the parameters, the middle of the box among them."""

REWEIGHTINGS = 3
"""Times that Sigma is taken again at the last fit."""


@dataclass(frozen=True)
class Evidence:
    """The measured side of the comparison, per condition: mean (d_c,), number of pours, covariance of one measured
    pour (d_c, d_c), systematic variance (d_c,), and how the variances compare. prior_mean, prior_weight: (k,) in coded
    units, weight zero where a parameter was not measured independently.
    """

    means: tuple[FloatArray, ...]
    counts: tuple[int, ...]
    pour: tuple[FloatArray, ...]
    systematic: tuple[FloatArray, ...]
    variances: tuple[VarianceComparison, ...]
    prior_mean: FloatArray
    prior_weight: FloatArray


@dataclass(frozen=True)
class Fit:
    """A calibrated model. members: effects that are on. x: (q,) coded, `covariance` (q, q) from the Jacobian.

    sigma: per condition the covariance of the residual. residual: per condition measured - fitted. slope: (q,) half the
    gradient of T^2 at x; at_edge: (q,) -1, 0 or 1, the bound at which it is held. df: summaries + priors - variables.
    """

    members: tuple[int, ...]
    predictor: Predictor
    x: FloatArray
    covariance: FloatArray
    sigma: tuple[FloatArray, ...]
    residual: tuple[FloatArray, ...]
    t2: float
    log_determinant: float
    slope: FloatArray
    at_edge: npt.NDArray[np.int64]
    df: int

    @property
    def deviance(self) -> float:
        """Return T^2 + ln|Sigma|."""
        return self.t2 + self.log_determinant


def gather_evidence(emulator: Emulator, observed: Observed) -> Evidence:
    """Return the measured means with their noise (noise.py)."""
    total = len(emulator.declared.labels)
    replicates = [observed.complete(c) for c in range(len(emulator.blocks))]
    pours = [observed.pours(c) for c in range(len(emulator.blocks))]
    compared = [
        # About its mean, a mean of n pours scatters √n times less than a pour.
        compare_variances(block.noise, values.mean(axis=0) + np.sqrt(n) * (values - values.mean(axis=0)), total)
        for block, values, n in zip(emulator.blocks, replicates, pours, strict=True)
    ]
    mean, weight = priors(emulator.declared)
    return Evidence(
        means=tuple(values.mean(axis=0) for values in replicates),
        counts=tuple(len(values) * n for values, n in zip(replicates, pours, strict=True)),
        pour=tuple(covariance for covariance, _ in compared),
        systematic=tuple(sd**2 for sd in observed.instrument),
        variances=tuple(comparison for _, comparison in compared),
        prior_mean=mean,
        prior_weight=weight,
    )


def residual_covariance(predictor: Predictor, x: FloatArray, evidence: Evidence) -> tuple[FloatArray, ...]:
    """Return Sigma per condition at x (q,)."""
    return tuple(
        pour / count + emulated + np.diag(systematic)
        for pour, count, emulated, systematic in zip(
            measured_noise(predictor, evidence),
            evidence.counts,
            predictor.mean_covariance(x),
            evidence.systematic,
            strict=True,
        )
    )


def measured_noise(predictor: Predictor, evidence: Evidence) -> tuple[FloatArray, ...]:
    """Return the covariance of one measured pour per condition, were this model the truth.

    Where the measured replicates have their own standard deviation, that stays.
    """
    factors = (
        np.where(compared.differs, 1.0, spread)
        for spread, compared in zip(predictor.spread, evidence.variances, strict=True)
    )
    return tuple(pour * np.outer(f, f) for pour, f in zip(evidence.pour, factors, strict=True))


def calibrate(emulator: Emulator, members: tuple[int, ...], evidence: Evidence) -> Fit:
    """Return the best fit of a model, Sigma taken again at each fit.

    Sigma and fit follow each other REWEIGHTINGS times; deterministic.
    """
    predictor = emulator.predictor(members)
    sigma = residual_covariance(predictor, _first(predictor), evidence)
    for _ in range(REWEIGHTINGS):
        fit = fit_with_covariance(predictor, members, evidence, sigma)
        sigma = residual_covariance(predictor, fit.x, evidence)
    return fit_with_covariance(predictor, members, evidence, sigma)


def fit_with_covariance(
    predictor: Predictor, members: tuple[int, ...], evidence: Evidence, sigma: Sequence[FloatArray]
) -> Fit:
    """Return the best fit of a model under a given Sigma per condition, from STARTS starting points."""
    k = predictor.parameters
    inverse = [np.asarray(np.linalg.inv(block)[None], dtype=np.float64) for block in sigma]
    starts = _starts(predictor)
    misfit = build_misfit(
        predictor,
        [np.broadcast_to(mean, (len(starts), mean.size)) for mean in evidence.means],
        inverse,
        np.broadcast_to(evidence.prior_mean, (len(starts), k)),
        evidence.prior_weight,
    )
    found, values = minimise(misfit, best_start(misfit, starts))
    return _described(misfit, found[int(np.argmin(values))], members, evidence, tuple(sigma))


def _described(
    misfit: Misfit, x: FloatArray, members: tuple[int, ...], evidence: Evidence, sigma: tuple[FloatArray, ...]
) -> Fit:
    predictor = misfit.predictor
    one = misfit.of_sets(np.array([0]))
    gradient, matrix = one.half_gradient(x[None])
    width = predictor.high - predictor.low
    below, above = x <= predictor.low + 1e-6 * width, x >= predictor.high - 1e-6 * width
    edge = np.where(below, -1, np.where(above, 1, 0))
    fitted = np.split(predictor.mean(x), np.cumsum([m.size for m in evidence.means])[:-1])
    return Fit(
        members=members,
        predictor=predictor,
        x=x,
        covariance=np.linalg.pinv(matrix[0], hermitian=True),
        sigma=sigma,
        residual=tuple(mean - f for mean, f in zip(evidence.means, fitted, strict=True)),
        t2=float(one.value(x[None])[0]),
        log_determinant=float(sum(np.linalg.slogdet(block)[1] for block in sigma)),
        slope=gradient[0],
        at_edge=edge.astype(np.int64),
        df=sum(m.size for m in evidence.means) + int((evidence.prior_weight > 0).sum()) - len(x),
    )


def _starts(predictor: Predictor) -> FloatArray:
    """Return starting parameters, shape (STARTS, k): the middle and points of a Halton sequence."""
    k = predictor.parameters
    if k == 0:
        return np.zeros((1, 0))
    low, high = predictor.low[:k], predictor.high[:k]
    spread = qmc.Halton(d=k, scramble=False).random(STARTS)[1:]
    return np.concatenate([[(low + high) / 2], low + spread * (high - low)])


def _first(predictor: Predictor) -> FloatArray:
    """Return where Sigma is first taken: at the anchor, else the middle of the parameters with every effect off."""
    if predictor.anchor is not None:
        return predictor.anchor.x
    k = predictor.parameters
    x = np.zeros(len(predictor.low))
    x[:k] = (predictor.low[:k] + predictor.high[:k]) / 2
    return x


def priors(declared: Declared) -> tuple[FloatArray, FloatArray]:
    """Return coded mean (k,) and weight (k,) of the independently measured parameters; weight zero for the others."""
    mean, weight = np.zeros(len(declared.parameters)), np.zeros(len(declared.parameters))
    for i, parameter in enumerate(declared.parameters):
        if parameter.mean is not None and parameter.sd is not None:
            mean[i] = float(parameter.coded(parameter.mean))
            weight[i] = ((parameter.high - parameter.low) / 2 / parameter.sd) ** 2
    return mean, weight
