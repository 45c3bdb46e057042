"""At which amplitude an effect is poured: where it shifts the summaries of a data set by about 12 standard errors.

From the end of the range inward; back out, halfway on a logarithmic scale, where a step inward went too far. Less only
where all that the literature supports does less. The pour of a trial and the covariance of the base model's alone tell
the order of a shift: once all effects have been poured, ``taught_shifts`` tells it by the covariance of all of them,
and what does too little is poured again farther out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.declared.model import Declared
from doe.declared.points import Direction, Point
from doe.declared.pours import Rows, Search
from doe.diagnose.compared_features import READABLE, usable
from doe.diagnose.emulator import Lessons, Way, emulated
from doe.diagnose.result import Level

FloatArray = npt.NDArray[np.float64]

REPLICATES = 6
"""Pours of a data set in each condition, by which shifts and strengths are stated."""
STRONG = 12.0
"""Shift [standard errors] that is wanted."""
LEAST_STEP = 0.05
"""An amplitude shrinks by no more than this factor at once: the answer to a strong effect may saturate."""


@dataclass(frozen=True)
class Trials:
    """How an amplitude is looked for: pours of each, how many are tried at most, and shifts that will do."""

    pours: int
    most: int
    enough: float
    too_much: float


def level_of(
    declared: Declared,
    direction: Direction,
    base: Rows,
    points: Callable[[float, int], Sequence[Point]],
    trials: Trials,
) -> Search[Level]:
    """The level of ``direction``; share 1 where all of the range does less. ``points(share, number)``: its pours."""
    share, below, above = 1.0, 0.0, math.inf
    level = Level(direction, 1.0, math.inf)
    for _ in range(trials.most):
        pours = yield points(share, trials.pours)
        shift = whitened_shift(declared, base, pours)
        level = Level(direction, share, shift)
        if shift > trials.too_much:
            above = share
            inward = share * max(LEAST_STEP, STRONG / shift)
            share = max(inward, math.sqrt(below * above)) if below > 0.0 else inward
        elif shift < trials.enough and share < 1.0:
            below = share
            outward = share * STRONG / max(shift, 1.0)
            share = min(1.0, outward if math.isinf(above) else min(outward, math.sqrt(below * above)))
        else:
            break
    return level


def whitened_shift(declared: Declared, base: Rows, moved: Rows) -> float:
    """Distance of the mean summaries of two sets of pours in standard errors of ``REPLICATES`` pours, all conditions.

    Less what noise alone adds to its square on average. The covariance is that of ``base``, shrunk halfway to its
    diagonal (they are few). Pours that broke off are left out, and summaries that less than ``READABLE`` of ``base``
    give. Infinite if a condition has no pour of ``moved`` left.
    """
    square = 0.0
    for c in range(len(declared.conditions)):
        given = np.isfinite([row[c].summaries for row in base if row[c].valid]).mean(axis=0) >= READABLE
        still, there = _valid(base, c, given), _valid(moved, c, given)
        if len(there) == 0:
            return math.inf
        spread = still.std(axis=0, ddof=1)
        varies = spread > 0.0
        covariance = np.cov(still[:, varies], rowvar=False)
        covariance = 0.5 * (np.atleast_2d(covariance) + np.diag(spread[varies] ** 2))
        step = (there.mean(axis=0) - still.mean(axis=0))[varies]
        noise = REPLICATES * (1.0 / len(there) + 1.0 / len(still))
        square += REPLICATES * float(step @ np.linalg.solve(covariance, step)) - noise * len(step)
    return math.sqrt(max(0.0, square))


def taught_shifts(lessons: Lessons, ways: Sequence[Way]) -> FloatArray:
    """Shift of the features of ``lessons`` by every way at its reference amplitude, (m,) [standard errors].

    By the pours there, in the covariance of all pours and with what parameters do taken out; less what noise adds.
    """
    taught, _ = usable(lessons, [np.arange(block.shape[1]) for block in lessons.blocks])
    emulator = emulated(taught, ways)
    base = emulator.at(emulator.row()[None])[0][0]
    still, shifts = int((taught.way == -1).sum()), np.zeros(len(ways))
    for way in range(len(ways)):
        there = taught.where((taught.way == way) & (taught.amplitude == 1.0))
        if len(there) > 0:
            step = emulator.seen(there.blocks) - base - emulator.moved(there.theta)[0].mean(axis=0)
            noise = len(step) * (1.0 / len(there) + 1.0 / still)
            shifts[way] = math.sqrt(REPLICATES * max(0.0, float(step @ step) - noise))
    return shifts


def _valid(pours: Rows, condition: int, given: npt.NDArray[np.bool_]) -> FloatArray:
    """The summaries ``given`` of the pours that have them all."""
    rows = [np.asarray(row[condition].summaries)[given] for row in pours if row[condition].valid]
    complete = [row for row in rows if np.isfinite(row).all()]
    return np.array(complete).reshape(len(complete), int(given.sum()))
