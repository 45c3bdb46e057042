"""How far each effect is simulated: from zero to where it shifts the summaries clearly.

With the parameters in the middle, a range ends where the effect shifts the summaries by ``WANTED`` standard errors of a
data set of ``REPLICATES`` pours, or at the end of what the literature supports if that comes first.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from doe.diagnose.runs import Declared, Effect
from doe.diagnose.simulation.plan import scaling_points
from doe.diagnose.simulation.pours import Rows, Search

FloatArray = npt.NDArray[np.float64]
RangeSearch = Search[tuple[Effect, float]]
"""Ends with the effect over its range and the shift [σ] at its end."""

REPLICATES = 6
WANTED = 16.0
"""Shift [standard errors] at the end of a range: beyond the 10 at which an effect has to be told for certain."""
TOO_LITTLE, TOO_FAR = 12.0, 24.0
"""Shifts [standard errors] that will do; less only where the literature's bounds allow no more."""
LEAST_STEP = 0.05
"""A range shrinks by no more than this factor at once: the answer to a strong effect may saturate."""
ROUNDS = 6
UNSEEN = 3.0
"""Shift [standard errors] by the whole range below which an effect is not simulated further: the race would not admit
it (`Limits.reach`)."""
UNSEEN_BY = 8
"""Pours by which that is decided at the latest."""
CLEARLY = 1.645
"""Standard deviations of the squared shift from that of ``UNSEEN`` at which fewer pours decide: one-sided, 5 % each."""


def range_of(declared: Declared, effect: Effect, number: int, centre: Rows) -> RangeSearch:
    """The range of one effect by ``number`` pours a trial, looked at twice where all of it shifts too little."""
    found, shift = yield from scaled_range(declared, effect, number, centre)
    if shift < UNSEEN and found.high == effect.high:
        found, shift = yield from looked_twice(declared, effect, centre)
    return found, shift


def looked_twice(declared: Declared, effect: Effect, centre: Rows) -> RangeSearch:
    """``effect`` poured at its whole range until it is clear whether that shifts too little; if so, named unseen.

    Two pours may hide five standard errors; ``UNSEEN_BY`` do not hide much more than the three that could be told at
    all.
    """
    for number in range(2, UNSEEN_BY + 1):
        pours = yield scaling_points(declared.parameters, effect, number)
        square, deviation = squared_shift(declared, centre, pours)
        if abs(square - UNSEEN**2) > CLEARLY * deviation:
            break
    shift = math.sqrt(max(0.0, square))
    return (replace(effect, unseen=shift) if shift < UNSEEN else effect), shift


def scaled_range(declared: Declared, effect: Effect, number: int, centre: Rows) -> RangeSearch:
    """``effect`` with its bounds drawn in to where the summaries shift by about ``WANTED``, and the shift [σ].

    From the whole range inward; back out, halfway on a logarithmic scale, where a step inward went too far.
    """
    found, share, inside, beyond = (effect, 0.0), 1.0, 0.0, math.inf
    for _ in range(ROUNDS):
        trial = _drawn_in(effect, share)
        pours = yield scaling_points(declared.parameters, trial, number)
        shift = whitened_shift(declared, centre, pours)
        if shift > TOO_FAR:
            beyond = share
            share = max(share * max(LEAST_STEP, WANTED / shift), math.sqrt(inside * beyond))
            if inside == 0.0:
                found = _drawn_in(effect, share), shift
            continue
        inside, found = share, (trial, shift)
        if shift >= TOO_LITTLE or math.isinf(beyond):
            break
        share = math.sqrt(inside * beyond)
    return found


def _drawn_in(effect: Effect, share: float) -> Effect:
    low, high = (tuple(share * bound for bound in bounds) for bounds in (effect.low, effect.high))
    return replace(effect, low=low, high=high)


def whitened_shift(declared: Declared, centre: Rows, moved: Rows) -> float:
    """Distance of the means of two sets of pours in standard errors of ``REPLICATES`` pours, all conditions together.

    Infinite if a condition has no pour of ``moved`` left.
    """
    return math.sqrt(max(0.0, squared_shift(declared, centre, moved)[0]))


def squared_shift(declared: Declared, centre: Rows, moved: Rows) -> tuple[float, float]:
    """Square of the shift, less what noise alone adds to it on average, and its standard deviation at ``UNSEEN``.

    With R the ``REPLICATES``, d summaries that vary and v = 1/n + 1/n_centre, R z'z / (R v) of a whitened step z is a
    noncentral chi-squared: its mean is d + UNSEEN²/(R v), its variance 2 d + 4 UNSEEN²/(R v). The covariance is that of
    ``centre``, shrunk halfway to its diagonal (they are few). Pours that broke off are left out. Of several conditions
    each has an equal share of UNSEEN². Infinite, and certain, if a condition has no pour of ``moved`` left.
    """
    square = variance = 0.0
    for c in range(len(declared.conditions)):
        still = _valid(centre, c)
        there = _valid(moved, c)
        if len(there) == 0:
            return math.inf, 0.0
        spread = still.std(axis=0, ddof=1)
        varies = spread > 0.0
        covariance = np.cov(still[:, varies], rowvar=False)
        covariance = 0.5 * (np.atleast_2d(covariance) + np.diag(spread[varies] ** 2))
        step = (there.mean(axis=0) - still.mean(axis=0))[varies]
        noise = REPLICATES * (1.0 / len(there) + 1.0 / len(still))
        square += REPLICATES * float(step @ np.linalg.solve(covariance, step)) - noise * len(step)
        variance += 2.0 * noise**2 * len(step) + 4.0 * noise * UNSEEN**2 / len(declared.conditions)
    return square, math.sqrt(variance)


def _valid(pours: Rows, condition: int) -> FloatArray:
    rows = [row[condition].summaries for row in pours if row[condition].valid]
    complete = [row for row in rows if np.isfinite(row).all()]
    return np.array(complete) if complete else np.empty((0, 0))
