"""Pours of a model at its own best fit, and what they say of the emulator there.

An emulator of the whole box is off wherever its polynomial cannot follow, most of all near the edges and where an
effect changes the number of bodies. Where it matters, n pours tell the mean directly. Summary by summary, with
v = share s^2 + bias, the variance of the emulated mean at the fitted point x0, and w = s^2/n, that of the poured one:

    mean(x)     = emulated(x) + g (poured mean - emulated(x0)),   g = v/(v + w)
    variance(x) = g w + variance of the emulated step from x0 to x + (1 - rho^2) bias(x),   rho = exp(-|x - x0|^2/2 L^2)

the update of a Gaussian state by an observation (Kalman 1960, J. Basic Eng. 82:35), carried into the neighbourhood over
the length L in which a bias keeps its value (Rasmussen and Williams 2006, ch. 2), with x in units of the sampled box.
Only simulated pours come in here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulation.predictor import Anchor, Predictor
from doe.diagnose.emulation.terms import monomials

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class FreshPours:
    """Pours of the model with the effects ``members`` at the coded point x (q,). blocks: per condition (n, d_c)."""

    members: tuple[int, ...]
    x: FloatArray
    blocks: tuple[FloatArray, ...]


def anchored(predictor: Predictor, fresh: FreshPours) -> Predictor:
    """Return the predictor that knows the fresh pours. A condition with fewer than two of them stays as it was.

    Pours that scatter more than those of the base model (an effect that lets bodies hang) count for as much less.
    """
    x = np.clip(fresh.x, predictor.low, predictor.high)
    constant = int(np.flatnonzero((predictor.exponents == 0).all(axis=1))[0])
    terms = monomials(x, predictor.exponents)
    coefficients, shares, biases = [], [], []
    for own, share, bias, noise, values in zip(
        predictor.coefficients,
        predictor.variance_shares(x),
        predictor.bias_variance(x),
        predictor.pour_covariance,
        fresh.blocks,
        strict=True,
    ):
        n, moved = len(values), own.copy()
        if n >= 2:
            pour = np.diag(noise)
            emulated, poured = share * pour + bias, np.maximum(pour, values.var(axis=0, ddof=1)) / n
            gain = emulated / (emulated + poured)
            moved[constant] += gain * (values.mean(axis=0) - terms @ own)
            share = share / (1.0 + n * share)
            bias = np.maximum(gain * poured - share * pour, 0.0)
        coefficients.append(moved)
        shares.append(share)
        biases.append(bias)
    return replace(predictor, coefficients=tuple(coefficients), anchor=Anchor(x, tuple(shares), tuple(biases)))
