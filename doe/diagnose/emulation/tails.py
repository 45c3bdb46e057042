"""Summaries with heavy tails, drawn in before anything is fitted: one pour that hangs would else outweigh all others.

    h(y) = c + s asinh((y - c)/s)

is the identity about the centre c of the base model's runs and logarithmic beyond the scale s = 2 robust standard
deviations. It is one function of one reading, so runs, emulator and data stay comparable; which summaries get it is
decided by the runs of the base model alone, never by the data: those whose residuals have a kurtosis beyond that of
Gaussian noise. Source: Johnson 1949, Biometrika 36:149 (S_U); the test: Anscombe and Glynn 1983, Biometrika 70:227.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.diagnose.emulation.terms import base_candidates, monomials
from doe.diagnose.runs import BASE, Declared, Observed, Runs

FloatArray = npt.NDArray[np.float64]

LEVEL = 0.01
"""Level of the tests of all summaries together."""
LEAST_RUNS = 20
"""Base runs below which the test's normal approximation is poor; nothing is drawn in then."""
SPAN = 2.0
"""Scale of h in robust standard deviations."""
NORMAL = 1.4826
"""Standard deviation of a Gaussian over its median absolute deviation."""


@dataclass(frozen=True)
class Tails:
    """Per condition centre and scale (d_c,) of h; an infinite scale leaves a summary as it is."""

    centre: tuple[FloatArray, ...]
    scale: tuple[FloatArray, ...]

    def of_runs(self, runs: Runs) -> Runs:
        """Return the runs with h of every summary."""
        return replace(runs, blocks=self.of_pours(runs.blocks))

    def of_pours(self, blocks: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
        """Return h of summaries, per condition (n, d_c)."""
        return tuple(draw_in(*one) for one in zip(blocks, self.centre, self.scale, strict=True))

    def of_observed(self, observed: Observed) -> Observed:
        """Return the measured side with h of every reading; an instrument's error shrinks by the slope of h."""
        instrument = [
            sd / np.sqrt(1.0 + ((observed.complete(c).mean(axis=0) - self.centre[c]) / self.scale[c]) ** 2)
            for c, sd in enumerate(observed.instrument)
        ]
        return Observed(self.of_pours(observed.blocks), tuple(instrument), observed.mean_of)

    def natural(self, values: FloatArray) -> FloatArray:
        """Return h^-1 of values of all summaries side by side, (n, D): as they are read."""
        return put_back(values, np.concatenate(self.centre), np.concatenate(self.scale))

    def labels(self, declared: Declared) -> tuple[str, ...]:
        """Return the summaries that are drawn in."""
        finite = np.isfinite(np.concatenate(self.scale))
        return tuple(label for label, drawn in zip(declared.labels, finite, strict=True) if drawn)


def heavy_tails(declared: Declared, runs: Runs, observed: Observed) -> Tails:
    """Return what the base model's runs ask for. Published means of several pours are left alone: h needs each pour."""
    theta = declared.coded(runs.theta)
    _, with_squares, *_ = base_candidates(theta.shape[1])
    terms = monomials(theta, with_squares)
    centres, scales = [], []
    for c, block in enumerate(runs.blocks):
        rows = (runs.effect == BASE) & runs.simulated(c)
        centre, scale = np.zeros(block.shape[1]), np.full(block.shape[1], np.inf)
        if rows.sum() >= LEAST_RUNS + terms.shape[1] and observed.pours(c) == 1:
            residual = block[rows] - terms[rows] @ np.linalg.lstsq(terms[rows], block[rows], rcond=None)[0]
            spread = NORMAL * np.median(np.abs(residual - np.median(residual, axis=0)), axis=0)
            varies = spread > 1e-9 * np.abs(block[rows]).max(axis=0)
            p = np.ones(len(scale))
            p[varies] = stats.kurtosistest(residual[:, varies], alternative="greater").pvalue
            heavy = p < LEVEL / len(declared.labels)
            centre[heavy] = np.median(block[rows], axis=0)[heavy]
            scale[heavy] = SPAN * spread[heavy]
        centres.append(centre)
        scales.append(scale)
    return Tails(tuple(centres), tuple(scales))


def draw_in(values: FloatArray, centre: FloatArray, scale: FloatArray) -> FloatArray:
    """Return h of values (n, d); NaN stays NaN."""
    finite = np.isfinite(scale)
    drawn = np.array(values, dtype=np.float64)
    drawn[:, finite] = centre[finite] + scale[finite] * np.arcsinh((values[:, finite] - centre[finite]) / scale[finite])
    return drawn


def put_back(values: FloatArray, centre: FloatArray, scale: FloatArray) -> FloatArray:
    """Return h^-1 of values (n, d)."""
    finite = np.isfinite(scale)
    read = np.array(values, dtype=np.float64)
    read[:, finite] = centre[finite] + scale[finite] * np.sinh((values[:, finite] - centre[finite]) / scale[finite])
    return read
