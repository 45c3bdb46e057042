"""How probable is it that nothing is missing, that one effect is, or that something else is: one posterior.

The mean z of n pours per condition, whitened by the covariance Σ of one pour, is compared with what each model gives by
the emulator that they share (``shared_emulator.py``), of mean m(e, a) and variance u(e, a) feature by feature:

    effect e at amplitude a             z ~ t_ν( m(e, a),  diag(u(e, a) + 1/n) + J Jᵀ )
    nothing missing                     z ~ t_ν( m₀,       diag(u₀ + 1/n) + J Jᵀ )
    something outside the library       z ~ t_ν( m₀,       diag(u₀ + 1/n + s²) + J Jᵀ )

ν are the degrees of freedom of Σ; its uncertainty is what makes the tails those of Student's t. J is what a parameter
does per standard deviation of its measurement, so parameters are integrated out. The evidence of an effect is the mean
over amplitudes, evenly over their logarithm, and over its mirror image where it has one; that of the outside over s.
Directions of one effect share its prior.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import gammaln, logsumexp

from doe.diagnose.shared_emulator import Emulator
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

NOTHING, OUTSIDE = 0.5, 0.1
"""Prior probabilities that nothing is missing, for most models are not wrong, and of what no library holds; the effects
share the rest alike."""
AMPLITUDES = np.geomspace(0.12, 1.6, 12)
"""Multiples of the reference amplitude: from where an effect of 12 σ can no longer be seen to where it is
extrapolated."""
SPREADS = np.geomspace(0.3, 6.0, 6)
"""Shifts by something outside [standard deviations of one pour in every feature]."""


@dataclass(frozen=True)
class Fit(Record):
    """The best amplitude of a direction of an effect, and the logarithm of its evidence there."""

    amplitude: float
    log_evidence: float


@dataclass(frozen=True)
class Posterior(Record):
    """Probabilities that add up to one. ``effects``: by name. ``fits``: of every direction, by its name."""

    nothing: float
    outside: float
    effects: Mapping[str, float]
    fits: Mapping[str, Fit]

    @property
    def best(self) -> tuple[str, float]:
        """The most probable effect and its probability."""
        return max(self.effects.items(), key=lambda item: item[1])


def posterior(emulator: Emulator, z: FloatArray, replicates: int) -> Posterior:
    """The posterior of a data set.

    Parameters
    ----------
    emulator
        Taught by pours of the base model and of every effect.
    z
        Mean of the data's features, whitened, (D,), as ``emulator.seen`` gives it.
    replicates
        n, pours of the data in each condition.

    Returns
    -------
    Probabilities of nothing, of every effect and of something outside, and each direction's best fit.
    """
    share = 1.0 / replicates

    def log_t(mean: FloatArray, variance: FloatArray) -> FloatArray:
        return _log_t(z - mean, variance + share, emulator.parameters, emulator.freedom)

    mean, variance = (one[None] for one in emulator.base())
    spread = log_t(mean, variance + SPREADS[:, None] ** 2)
    evidence: dict[str, list[float]] = {}
    fits = {}
    for number, way in enumerate(emulator.ways):
        amplitudes = np.concatenate([AMPLITUDES, -AMPLITUDES]) if way.two_sided else AMPLITUDES
        logs = log_t(*emulator.at(number, amplitudes))
        evidence.setdefault(way.effect, []).append(float(logsumexp(logs)) - np.log(logs.size))
        fits[way.name] = Fit(float(abs(amplitudes[logs.argmax()])), float(logs.max()))
    prior = np.log((1.0 - NOTHING - OUTSIDE) / max(1, len(evidence)))
    weighed = [
        float(log_t(mean, variance)[0]) + np.log(NOTHING),
        float(logsumexp(spread)) - np.log(len(SPREADS)) + np.log(OUTSIDE),
        *(float(logsumexp(found)) - np.log(len(found)) + prior for found in evidence.values()),
    ]
    weights = np.exp(np.array(weighed) - logsumexp(weighed)).tolist()
    return Posterior(weights[0], weights[1], dict(zip(evidence, weights[2:], strict=True)), fits)


def _log_t(d: FloatArray, variance: FloatArray, loadings: FloatArray, freedom: int) -> FloatArray:
    """Log densities (n,) at ``d`` (n, D) of multivariate t of scale diag(``variance``, (n, D)) + L Lᵀ, L = ``loadings``
    (D, k), but for the constant in D alone; by the Woodbury identity.
    """
    size = d.shape[-1]
    inner = np.eye(loadings.shape[1]) + np.einsum("dk,nd,dl->nkl", loadings, 1.0 / variance, loadings, optimize=True)
    seen = (d / variance) @ loadings
    square = (d**2 / variance).sum(axis=1) - (seen * np.linalg.solve(inner, seen[..., None])[..., 0]).sum(axis=1)
    determinant = np.log(variance).sum(axis=1) + np.linalg.slogdet(inner)[1]
    constant = gammaln(0.5 * (freedom + size)) - gammaln(0.5 * freedom) - 0.5 * size * np.log(freedom)
    return np.asarray(constant - 0.5 * determinant - 0.5 * (freedom + size) * np.log1p(square / freedom))
