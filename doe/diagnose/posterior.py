"""How probable is it that nothing is missing, that one effect is, or that something else is: one posterior.

The mean features z of n pours per condition are compared with what each model predicts from pours of its own. With
μ̂ the mean of n₀ pours of the base model and m̂ that of k pours of an effect at its taught amplitude,

    effect at a times that amplitude    z − μ̂ ~ t_ν( a (m̂ − μ̂),  Σ (1/n + (1 − a)²/n₀ + a²/k) + J Jᵀ )
    nothing missing                     z − μ̂ ~ t_ν( 0,            Σ (1/n + 1/n₀) + J Jᵀ )
    something outside the library       z − μ̂ ~ t_ν( 0,            Σ (1/n + 1/n₀ + s²) + J Jᵀ )

Σ is the covariance of one pour, from ν residuals, block by condition; its uncertainty is what makes the tails those of
Student's t. J is what a parameter does per standard deviation of its measurement, so parameters are integrated out.
(1 − a) μ̂ + a m̂ is the prediction, so the error that the models share by using the same base pours is in all of them.
The evidence of an effect is the mean over amplitudes, evenly over their logarithm, and over its mirror image where it
has one; that of the outside over s. Directions of one effect share its prior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.special import gammaln, logsumexp

from doe.diagnose.reference import SIDE, Sample
from doe.diagnose.ruler import shrunk_covariance
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

NOTHING, OUTSIDE = 0.5, 0.1
"""Prior probabilities that nothing is missing, for most models are not wrong, and of what no library holds; the effects
share the rest alike."""
AMPLITUDES = np.geomspace(0.15, 1.6, 10)
"""Multiples of the taught amplitude: from where an effect of 12 σ can no longer be seen to where it is extrapolated."""
SPREADS = np.geomspace(0.3, 6.0, 6)
"""Shifts by something outside [standard deviations of one pour in every feature]."""


@dataclass(frozen=True)
class Taught:
    """One direction of an effect, as far as its pours have taught it.

    Attributes
    ----------
    effect
        Its name; directions of one effect have the same.
    shift
        Mean of its pours less that of the base model, (D,), at the taught amplitude.
    pours
        In each condition.
    two_sided
        Whether its mirror image is possible as well.
    """

    effect: str
    shift: FloatArray
    pours: int
    two_sided: bool


@dataclass(frozen=True)
class Models:
    """All models of a declared scene, taught by the same pours.

    Attributes
    ----------
    base, base_pours
        Mean of the base model's pours, (D,), and how many in each condition.
    covariance, freedom
        Of one pour, (D, D), and its degrees of freedom ν.
    sensitivity
        Shift per standard deviation of each parameter's measurement, (D, k).
    effects
        Directions of effects.
    """

    base: FloatArray
    base_pours: int
    covariance: FloatArray
    freedom: int
    sensitivity: FloatArray
    effects: tuple[Taught, ...]

    @cached_property
    def scale(self) -> FloatArray:
        """Standard deviation of one pour, (D,): features span ten orders of magnitude."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @cached_property
    def whitened(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """W, the axes and the values (D,) of J Jᵀ there: W Σ Wᵀ = I and W J Jᵀ Wᵀ = diagonal."""
        factor = np.linalg.cholesky(self.covariance / np.outer(self.scale, self.scale))
        white = np.linalg.inv(factor) / self.scale
        seen = white @ self.sensitivity
        values, axes = np.linalg.eigh(seen @ seen.T)
        return axes.T @ white, axes, np.maximum(values, 0.0)


@dataclass(frozen=True)
class Posterior(Record):
    """Probabilities that add up to one. ``effects``: by name."""

    nothing: float
    outside: float
    effects: Mapping[str, float]

    @property
    def best(self) -> tuple[str, float]:
        """The most probable effect and its probability."""
        return max(self.effects.items(), key=lambda item: item[1])


def taught_by(sample: Sample, directions: Sequence[tuple[str, str, bool]]) -> Models:
    """Models of the pours in ``sample``.

    Parameters
    ----------
    sample
        Pours of "base", of "<parameter> -" and "<parameter> +", and of every direction.
    directions
        (effect, kind in ``sample``, whether its mirror image is possible).

    Returns
    -------
    The models; their covariance is of the residuals of base and effects together.

    Raises
    ------
    StatisticsError
        Where a kind has fewer than two pours in a condition.
    """
    for kind in ("base", *(kind for _, kind, _ in directions)):
        if (least := min(map(len, sample.pours[kind]))) < 2:
            raise StatisticsError(f"{kind}: {least} pours in a condition that count; allowed: at least 2")
    base = _mean(sample, "base")
    size, first, freedom = base.size, 0, 1 << 30
    covariance = np.zeros((size, size))
    for c in range(len(sample.pours["base"])):
        groups = [sample.pours["base"][c], *(sample.pours[kind][c] for _, kind, _ in directions)]
        # Each group's mean takes a degree of freedom.
        residuals = np.concatenate([(g - g.mean(axis=0)) * np.sqrt(len(g) / (len(g) - 1)) for g in groups])
        last = first + residuals.shape[1]
        covariance[first:last, first:last] = shrunk_covariance(residuals)
        first, freedom = last, min(freedom, len(residuals) - len(groups))
    slopes = [(_mean(sample, f"{name} +") - _mean(sample, f"{name} -")) / (2.0 * SIDE) for name in sample.parameters]
    return Models(
        base,
        min(map(len, sample.pours["base"])),
        covariance,
        freedom,
        np.column_stack(slopes) if slopes else np.zeros((size, 0)),
        tuple(
            Taught(effect, _mean(sample, kind) - base, min(map(len, sample.pours[kind])), two_sided)
            for effect, kind, two_sided in directions
        ),
    )


def posterior(models: Models, means: FloatArray, replicates: int) -> Posterior:
    """The posterior of data whose features have ``means`` (D,) over ``replicates`` pours in each condition."""
    white, _, parameters = models.whitened
    d = white @ (means - models.base)
    share = 1.0 / replicates
    ground = 1.0 / models.base_pours
    nothing = _log_t(d, share + ground + parameters, models.freedom)
    spread = [_log_t(d, share + ground + s**2 + parameters, models.freedom) for s in SPREADS]
    evidence: dict[str, list[float]] = {}
    for one in models.effects:
        shift = white @ one.shift
        logs = []
        for a in AMPLITUDES:
            variance = share + (1.0 - a) ** 2 * ground + a**2 / one.pours + parameters
            logs += [
                _log_t(d - sign * a * shift, variance, models.freedom) for sign in ((1, -1) if one.two_sided else (1,))
            ]
        evidence.setdefault(one.effect, []).append(float(logsumexp(logs)) - np.log(len(logs)))
    names = list(evidence)
    prior = np.log((1.0 - NOTHING - OUTSIDE) / max(1, len(names)))
    logs = [
        nothing + np.log(NOTHING),
        float(logsumexp(spread)) - np.log(len(SPREADS)) + np.log(OUTSIDE),
        *(float(logsumexp(evidence[name])) - np.log(len(evidence[name])) + prior for name in names),
    ]
    weights = np.exp(np.array(logs) - logsumexp(logs)).tolist()
    return Posterior(weights[0], weights[1], dict(zip(names, weights[2:], strict=True)))


def _log_t(d: FloatArray, variance: FloatArray, freedom: int) -> float:
    """Log density of a multivariate t of diagonal scale matrix ``variance`` (D,), but for the constant in D alone."""
    size = d.size
    square = float((d**2 / variance).sum())
    constant = gammaln(0.5 * (freedom + size)) - gammaln(0.5 * freedom) - 0.5 * size * np.log(freedom)
    return float(constant - 0.5 * np.log(variance).sum() - 0.5 * (freedom + size) * np.log1p(square / freedom))


def _mean(sample: Sample, kind: str) -> FloatArray:
    return np.concatenate([block.mean(axis=0) for block in sample.pours[kind]])
