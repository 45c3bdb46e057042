"""Space-filling designs: Latin hypercube and Sobol' sequence, for surrogate models and simulations.

Source: McKay, Beckman and Conover 1979, Technometrics 21:239; Sobol' 1967, scrambled after Owen 1998 (both by
scipy.stats.qmc). Random exchanges reduce the centred discrepancy of the hypercube.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from doe.designs.design import Design, DesignOptions, FloatArray, Points
from doe.errors import StatisticsError


def latin_hypercube(factors: int, runs: int, seed: int) -> FloatArray:
    """Return coded points in (-1, 1), shape (runs, factors): one point in each of `runs` slices of every factor.

    Raises StatisticsError for fewer than one factor or two runs.
    """
    _require(factors, runs)
    sampler = qmc.LatinHypercube(factors, optimization="random-cd", rng=np.random.default_rng(seed))
    return np.asarray(2 * sampler.random(runs) - 1)


def sobol(factors: int, runs: int, seed: int) -> FloatArray:
    """Return the first `runs` points of a scrambled Sobol' sequence, coded, shape (runs, factors).

    The points are balanced only if their number is a power of two. Raises StatisticsError for fewer than one factor or
    two runs.
    """
    _require(factors, runs)
    power = int(np.ceil(np.log2(runs)))
    sampler = qmc.Sobol(factors, scramble=True, rng=np.random.default_rng(seed))
    return np.asarray(2 * sampler.random_base2(power)[:runs] - 1)


def _require(factors: int, runs: int) -> None:
    if factors < 1:
        raise StatisticsError(f"factors = {factors}; at least one is needed")
    if runs < 2:
        raise StatisticsError(f"runs = {runs}; at least two are needed")


class LatinHypercube(Design):
    """Points spread over every factor's range."""

    name = "lhs"
    title = "Latin hypercube"
    doc = "Points spread over the ranges (Latin hypercube), for a surrogate model."
    options = ("runs",)

    def points(self, factors: int, options: DesignOptions) -> Points:
        """10 points per factor by default."""
        return Points(latin_hypercube(factors, options.runs or 10 * factors, options.seed))


class Sobol(Design):
    """The first points of a scrambled Sobol' sequence."""

    name = "sobol"
    title = "Sobol'"
    doc = "Points spread over the ranges (Sobol' sequence), for a surrogate model; best with 2, 4, 8, … runs."
    options = ("runs",)

    def points(self, factors: int, options: DesignOptions) -> Points:
        """By default, the smallest power of two that gives at least 10 points per factor."""
        usual = 2 ** int(np.ceil(np.log2(10 * factors)))
        return Points(sobol(factors, options.runs or usual, options.seed))
