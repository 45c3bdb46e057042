"""One model of the race: the emulator's polynomial in its parameters and the amplitudes of the effects that are on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulation.terms import monomials, slopes
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


BIAS_LENGTH = 0.25
"""Share of the sampled box over which the bias of a polynomial keeps its value: what a quadratic leaves has three
changes of sign in it."""


@dataclass(frozen=True)
class Anchor:
    """Point x (q,) at which pours of the model itself hold the prediction (fresh_pours.py), and its variance there, per
    condition: shares of a pour's covariance, and bias (d_c,). spread: (d_c,) standard deviation of a pour there over
    that of the base model, at least one.
    """

    x: FloatArray
    shares: tuple[float, ...]
    bias: tuple[FloatArray, ...]
    spread: tuple[FloatArray, ...]


@dataclass(frozen=True)
class Predictor:
    """y_c(x) = terms(x) @ coefficients_c; x: (..., q) coded parameters, then coded amplitudes.

    Per condition c: coefficients (p, d_c), information_inverse (p, p), pour_covariance (d_c, d_c), lack_of_fit (d_c,),
    excess (members, d_c) with the numbers of their amplitudes (block.py). low, high: (q,) the sampled box, in which
    alone it predicts. columns: (p,) places of its terms among those of the emulator.
    """

    parameters: int
    exponents: IntArray
    coefficients: tuple[FloatArray, ...]
    information_inverse: tuple[FloatArray, ...]
    pour_covariance: tuple[FloatArray, ...]
    lack_of_fit: tuple[FloatArray, ...]
    excess: tuple[FloatArray, ...]
    amplitudes: tuple[int, ...]
    low: FloatArray
    high: FloatArray
    columns: IntArray
    anchor: Anchor | None = None

    def mean(self, x: FloatArray) -> FloatArray:
        """Return the predicted means of all conditions side by side, (..., q) -> (..., D).

        Raises StatisticsError outside the sampled box.
        """
        self.require_inside(x)
        terms = monomials(x, self.exponents)
        return np.concatenate([terms @ c for c in self.coefficients], axis=-1)

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Return d mean/d x, (q,) -> (D, q)."""
        self.require_inside(x)
        rows = slopes(x, self.exponents)
        return np.concatenate([rows @ c for c in self.coefficients], axis=-1).T

    def mean_covariance(self, x: FloatArray) -> tuple[FloatArray, ...]:
        """Return per condition the covariance of the predicted mean at x (q,): terms' (X'X)^-1 terms S + bias."""
        return tuple(
            share * noise + np.diag(bias)
            for share, noise, bias in zip(
                self.variance_shares(x), self.pour_covariance, self.bias_variance(x), strict=True
            )
        )

    def variance_shares(self, x: FloatArray) -> tuple[float, ...]:
        """Return per condition terms' (X'X)^-1 terms at x (q,): variance of the predicted mean in pours.

        With an anchor, that of the anchor and of the step from it.
        """
        step, held = self.step(x), self.anchor.shares if self.anchor else (0.0,) * len(self.information_inverse)
        return tuple(
            share + float(step @ inverse @ step) for share, inverse in zip(held, self.information_inverse, strict=True)
        )

    def step(self, x: FloatArray) -> FloatArray:
        """Return the terms at x (q,) whose coefficients the prediction there rests on, (p,): less the anchor's."""
        terms = monomials(x, self.exponents)
        return terms if self.anchor is None else terms - monomials(self.anchor.x, self.exponents)

    def bias_variance(self, x: FloatArray) -> tuple[FloatArray, ...]:
        """Return per condition the variance of what no number of runs would mend at x (q,): (d_c,)."""
        ends = np.cumsum([self.parameters, *self.amplitudes])
        squares = np.array([(part**2).sum() for part in np.split(x, ends[:-1])[1:]])
        bias = tuple(lack + squares @ excess for lack, excess in zip(self.lack_of_fit, self.excess, strict=True))
        if self.anchor is None:
            return bias
        step = (x - self.anchor.x) / (self.high - self.low)
        loose = 1.0 - np.exp(-(step**2).sum() / BIAS_LENGTH**2)
        return tuple(held + loose * far for held, far in zip(self.anchor.bias, bias, strict=True))

    @property
    def spread(self) -> tuple[FloatArray, ...]:
        """Return per condition the standard deviation of one pour over that of the base model's, (d_c,)."""
        return tuple(np.ones(len(s)) for s in self.pour_covariance) if self.anchor is None else self.anchor.spread

    def require_inside(self, x: FloatArray) -> None:
        """Raise StatisticsError unless every point lies in the sampled box (rounding aside)."""
        if (x < self.low - 1e-9).any() or (x > self.high + 1e-9).any():
            raise StatisticsError(
                f"point {np.round(np.atleast_2d(x)[0], 4).tolist()} (coded) lies outside the simulated box "
                f"{np.round(self.low, 4).tolist()} to {np.round(self.high, 4).tolist()}; allowed is inside"
            )
