"""Search for the amplitude at which an effect shifts the summaries of a data set by about 12 standard errors.

The search starts at the end of the range and steps inward; after a step too far it steps back out, halfway on a
logarithmic scale. The shift is smaller only if the whole range supported by the literature shifts less. A trial pour,
with the covariance of the base model's pours alone, gives only the order of a shift. Once all effects have been poured,
``taught_shifts`` uses the covariance of all pours, and an effect that shifts too little is poured again farther out.
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
"""Pours per condition of the data set for which shifts and strengths are stated."""
STRONG = 12.0
"""Target shift [standard errors]."""
LEAST_STEP = 0.05
"""Smallest factor on an amplitude in one step inward: the response to a strong effect may saturate."""


@dataclass(frozen=True)
class Trials:
    """Settings of the search: pours per trial, largest number of trials, and range of shifts that will do."""

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
    """Find the level of ``direction``; share 1 if the whole range shifts less. ``points(share, number)``: its pours."""
    share, below, above = 1.0, 0.0, math.inf
    level = ended = Level(direction, 1.0, math.inf)
    for _ in range(trials.most):
        pours = yield points(share, trials.pours)
        shift = whitened_shift(declared, base, pours)
        level = Level(direction, share, shift)
        if math.isfinite(shift) and (math.isinf(ended.shift) or share > ended.share):
            ended = level
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
    # Where nothing ended, nothing can be taught; the widest amplitude at which something did is nearest.
    return ended if math.isinf(level.shift) else level


def whitened_shift(declared: Declared, base: Rows, moved: Rows) -> float:
    """Distance of the mean summaries of two sets of pours in standard errors of ``REPLICATES`` pours, all conditions.

    The expected contribution of noise to its square is subtracted. The covariance is that of ``base``, shrunk halfway
    to its diagonal because these pours are few. Pours that broke off are left out, and so are summaries that less than
    ``READABLE`` of ``base`` give. Infinite if a condition has no pour of ``moved`` left.
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

    From the pours there, with the covariance of all pours; less the response to parameters and what noise adds.
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
    """The summaries ``given`` of the valid pours that have them all."""
    rows = [np.asarray(row[condition].summaries)[given] for row in pours if row[condition].valid]
    complete = [row for row in rows if np.isfinite(row).all()]
    return np.array(complete).reshape(len(complete), int(given.sum()))
