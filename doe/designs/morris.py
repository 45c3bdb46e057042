"""Trajectories for elementary effects: many factors, few runs, no model.

A trajectory begins at a random point of a grid of 4 levels per factor and moves one factor after the other, in random
order, by 2/3 of its range up or down: k + 1 runs give one elementary effect of each of k factors (Morris 1991,
Technometrics 33:161, doi 10.1080/00401706.1991.10484804). Of many random trajectories, those furthest apart are
kept, chosen one by one (after Campolongo, Cariboni and Saltelli 2007, Environ. Model. Softw. 22:1509,
doi 10.1016/j.envsoft.2006.10.004, who compare all sets). `doe.analysis.elementary_effects` evaluates them.
"""

from __future__ import annotations

import numpy as np

from doe.designs.design import Design, DesignOptions, FloatArray, Points
from doe.errors import StatisticsError

LEVELS = 4
STEP = LEVELS / (LEVELS - 1)
"""In coded units: 2/3 of the range, so that from every level a step up or a step down leads to another level."""
TRAJECTORIES = 10
DRAWN = 20
"""Number of random trajectories for each one that is kept."""


def morris(factors: int, trajectories: int, seed: int) -> FloatArray:
    """Return coded points, shape (trajectories (factors + 1), factors), one trajectory after the other.

    Raises StatisticsError for fewer than one factor or two trajectories.
    """
    if factors < 1 or trajectories < 2:
        raise StatisticsError(
            f"{factors} factors, {trajectories} trajectories; allowed: at least 1 factor and 2 trajectories"
        )
    random = np.random.default_rng(seed)
    drawn = np.array([_trajectory(factors, random) for _ in range(DRAWN * trajectories)])
    kept = [0]
    apart = np.zeros(len(drawn))
    while len(kept) < trajectories:
        # Campolongo's distance between two trajectories is the sum over all pairs of their points.
        between = ((drawn[:, :, None] - drawn[kept[-1]][None, None]) ** 2).sum(axis=-1)
        apart += np.sqrt(between).sum(axis=(1, 2)) ** 2
        apart[kept] = -1.0
        kept.append(int(np.argmax(apart)))
    return np.concatenate(drawn[kept])


def _trajectory(factors: int, random: np.random.Generator) -> FloatArray:
    """One trajectory, shape (factors + 1, factors)."""
    up = random.integers(2, size=factors) * 2 - 1
    low_half = -1 + 2 * random.integers(LEVELS // 2, size=factors) / (LEVELS - 1)
    point = np.where(up > 0, low_half, low_half + STEP)
    path = [point]
    for factor in random.permutation(factors):
        point = point.copy()
        point[factor] += up[factor] * STEP
        path.append(point)
    return np.array(path)


class Morris(Design):
    """Trajectories that change one factor at a time."""

    name = "morris"
    title = "Morris"
    doc = "Elementary effects: trajectories that change one of many factors at a time; needs no model."
    options = ("runs",)
    main_effects_only = True

    def points(self, factors: int, options: DesignOptions) -> Points:
        """Ten trajectories by default; ``options.runs`` must be a whole number of trajectories, at least two."""
        runs = TRAJECTORIES * (factors + 1) if options.runs is None else options.runs
        trajectories, rest = divmod(runs, factors + 1)
        if rest or trajectories < 2:
            least = max(trajectories, 2) * (factors + 1)
            raise StatisticsError(
                f"runs = {runs}: each trajectory of {factors} factors has {factors + 1} runs; allowed: {least}, "
                f"{least + factors + 1}, …"
            )
        return Points(morris(factors, trajectories, options.seed), traits=(f"{trajectories} trajectories",))
