"""What an effect does to the summaries that recalibration cannot undo.

    z = P Sigma^-1/2 [f(theta, a) - f(theta, 0)],   P = 1 - J (J'J)^-1 J',   J = Sigma^-1/2 df/dtheta

with a row sqrt(w_i) in J for every independently measured parameter: such a parameter cannot move freely. |z| is the
shift in sigma that the data can see: the square root of the noncentrality of T^2. Source: Plumlee 2017, JASA 112:1274.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulation.emulator import Emulator
from doe.diagnose.emulation.predictor import Predictor
from doe.diagnose.emulation.terms import monomials
from doe.diagnose.fitting.calibrate import Evidence, Fit

FloatArray = npt.NDArray[np.float64]

LEVELS = (0.5, 1.0)
"""Shares of each bound at which the shift is looked at."""


@dataclass(frozen=True)
class Whitening:
    """Sigma^-1/2 per condition (inverse Cholesky factors) and the projector P, ((D + k), (D + k)), about a fit."""

    factors: tuple[FloatArray, ...]
    projector: FloatArray

    def whiten(self, shift: FloatArray) -> FloatArray:
        """Return Sigma^-1/2 shift followed by k zeros for the prior rows, (D,) -> (D + k,)."""
        parts = np.split(shift, np.cumsum([len(f) for f in self.factors])[:-1])
        whitened = [factor @ part for factor, part in zip(self.factors, parts, strict=True)]
        return np.concatenate([*whitened, np.zeros(len(self.projector) - len(shift))])


@dataclass(frozen=True)
class Reach:
    """The largest shift that an effect can cause within its bounds: in sigma, at which coded amplitude, and its z.

    The square of the shift is freed from what the uncertainty of the emulator adds to it on average.
    """

    shift: float
    amplitude: FloatArray
    signature: FloatArray


def whitening(base: Fit, evidence: Evidence) -> Whitening:
    """Return the whitening and projection about a fit of the base model."""
    return whitening_at(base.predictor, base.x, base.sigma, evidence.prior_weight)


def whitening_at(
    predictor: Predictor, x: FloatArray, sigma: Sequence[FloatArray], prior_weight: FloatArray
) -> Whitening:
    """Return the whitening by `sigma` (per condition) and the projection about parameters x (k,) of the base model."""
    factors = tuple(np.linalg.inv(np.linalg.cholesky(block)) for block in sigma)
    slopes = predictor.jacobian(x)
    parts = np.split(slopes, np.cumsum([len(f) for f in factors])[:-1])
    rows = [*(factor @ part for factor, part in zip(factors, parts, strict=True))]
    jacobian = np.concatenate([*rows, np.diag(np.sqrt(prior_weight))])
    return Whitening(factors, np.eye(len(jacobian)) - jacobian @ np.linalg.pinv(jacobian))


def projected(frame: Whitening, shift: FloatArray) -> FloatArray:
    """Return z of a shift of the summaries, (D,) -> (D + k,)."""
    return np.asarray(frame.projector @ frame.whiten(shift))


def shift_of(emulator: Emulator, effect: int, theta: FloatArray, amplitude: FloatArray) -> FloatArray:
    """Return f(theta, a) - f(theta, 0), (D,), at coded parameters (k,) and amplitudes (m,)."""
    predictor = emulator.predictor((effect,))
    points = np.stack([np.concatenate([theta, amplitude]), np.concatenate([theta, np.zeros_like(amplitude)])])
    on, off = predictor.mean(points)
    return np.asarray(on - off)


def reach(emulator: Emulator, effect: int, frame: Whitening, theta: FloatArray) -> Reach:
    """Return the largest shift within the sampled bounds of the effect, looked for at half and full bounds."""
    low, high = emulator.low[effect], emulator.high[effect]
    axes = [
        sorted({0.0, *(float(share * bound) for share in LEVELS for bound in ends)})
        for ends in zip(low, high, strict=True)
    ]
    best = Reach(0.0, np.zeros(len(low)), np.zeros(len(frame.projector)))
    for choice in product(*axes):
        amplitude = np.array(choice)
        if not amplitude.any():
            continue
        z = projected(frame, shift_of(emulator, effect, theta, amplitude))
        shift = math.sqrt(max(0.0, float(z @ z) - noise_square(emulator, effect, frame, theta, amplitude)))
        if shift > best.shift or not best.amplitude.any():
            best = Reach(shift, amplitude, z)
    return best


def cosine(one: FloatArray, other: FloatArray) -> float:
    """Return the cosine of two signatures; NaN where one is zero."""
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / size if size > 0 else float("nan")


def noise_square(emulator: Emulator, effect: int, frame: Whitening, theta: FloatArray, amplitude: FloatArray) -> float:
    """Return the mean of |z|^2 that errors of the effect's coefficients cause alone: tr(P W v S W' P)."""
    predictor = emulator.predictor((effect,))
    own = len(emulator.base_exponents)
    terms = monomials(np.concatenate([theta, amplitude]), predictor.exponents)[own:]
    size, first = len(frame.projector), 0
    covariance = np.zeros((size, size))
    for factor, inverse, pour in zip(
        frame.factors, predictor.information_inverse, predictor.pour_covariance, strict=True
    ):
        last = first + len(factor)
        covariance[first:last, first:last] = (terms @ inverse[own:, own:] @ terms) * factor @ pour @ factor.T
        first = last
    return float(np.trace(frame.projector @ covariance))
