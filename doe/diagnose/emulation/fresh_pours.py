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

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulation.predictor import Anchor, Predictor
from doe.diagnose.emulation.terms import monomials
from doe.diagnose.runs import Declared, Runs

FloatArray = npt.NDArray[np.float64]

BASE_DF = 5.0
"""Weight of the base model's variance in that of the fresh pours [degrees of freedom]: a few pours say little of it."""


@dataclass(frozen=True)
class FreshPours:
    """Pours of the model with the effects ``members`` on, at parameters theta (k,) and amplitudes, natural units.

    amplitudes: those of the first member, then of the second. blocks: per condition (n, d_c), NaN for a pour that broke
    off.
    """

    members: tuple[int, ...]
    theta: tuple[float, ...]
    amplitudes: tuple[float, ...]
    blocks: tuple[FloatArray, ...]

    def coded(self, declared: Declared) -> FloatArray:
        """Return the point (q,) as the emulator counts."""
        scale = np.concatenate([np.empty(0), *(declared.effects[e].scale for e in self.members)])
        return np.concatenate([declared.coded(np.array(self.theta)), np.array(self.amplitudes) / scale])


def newest(fresh: Sequence[FreshPours]) -> tuple[FreshPours, ...]:
    """Return the last pours of every model: those that hold its prediction."""
    return tuple({one.members: one for one in fresh}.values())


def taught(runs: Runs, fresh: Sequence[FreshPours]) -> Runs:
    """Return the runs with the earlier pours of every single effect: they teach the emulator like any others.

    The newest do not, for they hold a prediction already; pairs have no terms of their own.
    """
    held = newest(fresh)
    for one in fresh:
        if len(one.members) != 1 or any(one is last for last in held):
            continue
        n = len(one.blocks[0])
        amplitudes = (*one.amplitudes, 0.0)[:2]
        runs = Runs(
            np.vstack([runs.theta, np.tile(one.theta, (n, 1))]),
            np.concatenate([runs.effect, np.full(n, one.members[0])]),
            np.vstack([runs.amplitude, np.tile(amplitudes, (n, 1))]),
            tuple(np.vstack(pair) for pair in zip(runs.blocks, one.blocks, strict=True)),
        )
    return runs


def anchored(predictor: Predictor, x: FloatArray, blocks: Sequence[FloatArray]) -> Predictor:
    """Return the predictor that knows pours at x (q,), per condition (n, d_c).

    A condition with fewer than two complete ones stays as it was.

    Pours may scatter more than those of the base model (piles that rolling resistance keeps steep, bodies that hang).
    Their variance is taken as that of both together, the base model's with the weight of ``BASE_DF`` degrees of
    freedom; less than the base model's is not believed. It is the noise of measured pours too, were this model true.
    """
    x = np.clip(x, predictor.low, predictor.high)
    constant = int(np.flatnonzero((predictor.exponents == 0).all(axis=1))[0])
    terms = monomials(x, predictor.exponents)
    coefficients, shares, biases, spreads = [], [], [], []
    for own, share, bias, noise, values in zip(
        predictor.coefficients,
        predictor.variance_shares(x),
        predictor.bias_variance(x),
        predictor.pour_covariance,
        blocks,
        strict=True,
    ):
        complete, moved = values[np.isfinite(values).all(axis=1)], own.copy()
        spread = np.ones(len(noise))
        n = len(complete)
        if n >= 2:
            pour = np.diag(noise)
            own_variance = (BASE_DF * pour + (n - 1) * complete.var(axis=0, ddof=1)) / (BASE_DF + n - 1)
            spread = np.sqrt(np.maximum(1.0, own_variance / pour))
            emulated, poured = share * pour + bias, spread**2 * pour / n
            gain = emulated / (emulated + poured)
            moved[constant] += gain * (complete.mean(axis=0) - terms @ own)
            share = share / (1.0 + n * share)
            bias = np.maximum(gain * poured - share * pour, 0.0)
        coefficients.append(moved)
        shares.append(share)
        biases.append(bias)
        spreads.append(spread)
    anchor = Anchor(x, tuple(shares), tuple(biases), tuple(spreads))
    return replace(predictor, coefficients=tuple(coefficients), anchor=anchor)
