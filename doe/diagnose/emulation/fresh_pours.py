"""Pours of a model about its own best fit, and what they say of the emulator there.

An emulator of the whole box is off wherever its polynomial cannot follow, most of all near the edges and where an
effect changes the number of bodies. Where it matters, n pours about the fitted point tell. They teach the polynomial
its slopes like any other runs; its level there is theirs alone, summary by summary, with s^2 the variance of a pour:

    mean(x)     = emulated(x) + mean over the pours of (poured - emulated)
    variance(x) = s^2/n + variance of the emulated step from their centre x0 to x + (1 - rho^2) bias(x),
    rho         = exp(-|x - x0|^2/2 L^2)

the bias of the polynomial as a Gaussian process that is known at x0 (Rasmussen and Williams 2006, ch. 2), with x in
units of the sampled box. Only simulated pours come in here.
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
    """Pours of the model with the effects ``members`` on, at parameters theta (n, k) and amplitudes (n, m), natural.

    amplitudes: those of the first member, then of the second. blocks: per condition (n, d_c), NaN for a pour that broke
    off.
    """

    members: tuple[int, ...]
    theta: FloatArray
    amplitudes: FloatArray
    blocks: tuple[FloatArray, ...]

    def coded(self, declared: Declared) -> FloatArray:
        """Return the points (n, q) as the emulator counts."""
        scale = np.concatenate([np.empty(0), *(declared.effects[e].scale for e in self.members)])
        return np.concatenate([declared.coded(self.theta), self.amplitudes / scale], axis=1)

    def joined(self, more: FreshPours) -> FreshPours:
        """Return these pours with ``more`` of the same model."""
        return FreshPours(
            self.members,
            np.vstack([self.theta, more.theta]),
            np.vstack([self.amplitudes, more.amplitudes]),
            tuple(np.vstack(pair) for pair in zip(self.blocks, more.blocks, strict=True)),
        )

    def goes_on_from(self, other: FreshPours) -> bool:
        """Return whether these are the pours of ``other`` and more."""
        n = len(other.theta)
        return self.members == other.members and all(
            len(mine) > n and np.array_equal(mine[:n], theirs)
            for mine, theirs in ((self.theta, other.theta), (self.amplitudes, other.amplitudes))
        )


def newest(fresh: Sequence[FreshPours]) -> tuple[FreshPours, ...]:
    """Return the last pours of every model: those that hold its prediction."""
    return tuple({one.members: one for one in fresh}.values())


def taught(runs: Runs, fresh: Sequence[FreshPours]) -> Runs:
    """Return the runs with the pours of every single effect; a pair has no terms of its own to be taught."""
    for one in fresh:
        if len(one.members) == 1:
            n = len(one.theta)
            runs = Runs(
                np.vstack([runs.theta, one.theta]),
                np.concatenate([runs.effect, np.full(n, one.members[0])]),
                np.vstack([runs.amplitude, np.column_stack([one.amplitudes, np.zeros(n)])[:, :2]]),
                tuple(np.vstack(pair) for pair in zip(runs.blocks, one.blocks, strict=True)),
            )
    return runs


def anchored(predictor: Predictor, points: FloatArray, blocks: Sequence[FloatArray]) -> Predictor:
    """Return the predictor that knows pours at points (n, q), per condition (n, d_c).

    A condition with fewer than two complete ones stays as it was.

    Pours may scatter more than those of the base model (piles that rolling resistance keeps steep, bodies that hang).
    Their variance is taken as that of both together, the base model's with the weight of ``BASE_DF`` degrees of
    freedom; less than the base model's is not believed. It is the noise of measured pours too, were this model true.
    """
    points = np.clip(points, predictor.low, predictor.high)
    centre = points.mean(axis=0)
    constant = int(np.flatnonzero((predictor.exponents == 0).all(axis=1))[0])
    coefficients, shares, biases, spreads = [], [], [], []
    for own, share, bias, noise, values in zip(
        predictor.coefficients,
        predictor.variance_shares(centre),
        predictor.bias_variance(centre),
        predictor.pour_covariance,
        blocks,
        strict=True,
    ):
        complete = np.isfinite(values).all(axis=1)
        n, moved, spread = int(complete.sum()), own.copy(), np.ones(len(noise))
        if n >= 2:
            off, pour = values[complete] - monomials(points[complete], predictor.exponents) @ own, np.diag(noise)
            together = (BASE_DF * pour + (n - 1) * off.var(axis=0, ddof=1)) / (BASE_DF + n - 1)
            spread = np.sqrt(np.maximum(1.0, together / pour))
            moved[constant] += off.mean(axis=0)
            share, bias = 1.0 / n, (spread**2 - 1.0) * pour / n
        coefficients.append(moved)
        shares.append(share)
        biases.append(bias)
        spreads.append(spread)
    anchor = Anchor(centre, tuple(shares), tuple(biases), tuple(spreads))
    return replace(predictor, coefficients=tuple(coefficients), anchor=anchor)
