"""Elementary effects of a Morris design: which of many factors act, and which are nonlinear or interact with others?

Two consecutive runs of a trajectory that differ in one factor only, by the fraction d of its range, give its elementary
effect e = (change of the response)/d: the change of the response from low to high, extrapolated linearly. A trajectory
ends where no factor or several factors change, or one that has already changed in it. Over all trajectories, mu is the
mean of e, mu* the mean of |e| (if a factor raises the response in places and lowers it in others, mu is near 0, but not
mu*), and sigma the standard deviation of e, which is 0 for a factor that acts linearly and without interactions, apart
from the noise of the runs. Source: Morris 1991, Technometrics 33:161, doi 10.1080/00401706.1991.10484804; Campolongo,
Cariboni and Saltelli 2007, Environ. Model. Softw. 22:1509, doi 10.1016/j.envsoft.2006.10.004.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.replicates import require_matrix, row_moments
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
SAME = 1e-9
"""Coded levels that differ by less count as equal."""


@dataclass(frozen=True)
class ElementaryEffect(Record):
    """Effects of one factor, from low to high, unit of the response; all NaN without any. effects: that of each step.

    mu_star_half_width: half the 95 % t interval of mu*. p: t test that mu is zero; p_holm: for all factors at once.
    """

    factor: str
    effects: FloatArray
    mu: float
    mu_star: float
    mu_star_half_width: float
    sigma: float
    p: float
    p_holm: float


@dataclass(frozen=True)
class ElementaryEffects(Record):
    """Effects of all factors. steps: pairs of runs that differ in one factor; lost: pairs in which a run is missing."""

    effects: tuple[ElementaryEffect, ...]
    steps: int
    lost: int

    @property
    def ranked(self) -> tuple[ElementaryEffect, ...]:
        """The effects by falling mu*."""
        return tuple(sorted(self.effects, key=lambda one: -one.mu_star if math.isfinite(one.mu_star) else math.inf))


def elementary_effects(
    coded: FloatArray, responses: FloatArray, names: Sequence[str], others: FloatArray | None = None
) -> ElementaryEffects:
    """Return the effects of rows in the order of their trajectories; replicates of a row are averaged.

    coded: (rows, k), low = -1, high = +1. responses: (rows, replicates), NaN where a run is missing. others: like
    coded, for factors whose effects are not wanted, NaN where a level is unknown; they must not change in a step.
    Raises StatisticsError where no two consecutive rows differ in exactly one factor.
    """
    values = row_moments(require_matrix("responses", responses, rows=len(coded)))[0]
    moved = np.diff(coded if others is None else np.hstack([coded, others]), axis=0)
    steps = _steps(~(np.abs(moved) <= SAME))
    single, factor = np.array([step for step in steps if step[1] < len(names)], dtype=np.int64).reshape(-1, 2).T
    if not len(single):
        raise StatisticsError("coded: no two consecutive rows differ in exactly one factor, as in a Morris design")
    change = np.diff(values)[single] / (moved[single, factor] / 2)
    known = ~np.isnan(change)
    found = [_effect(name, change[known & (factor == k)]) for k, name in enumerate(names)]
    return ElementaryEffects(_corrected(found), len(single), int((~known).sum()))


def _steps(changed: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Row and factor of each step within a trajectory. changed: (rows - 1, factors), from a row to the next."""
    found, gone = [], set[int]()
    for row, factors in enumerate(changed):
        own = np.flatnonzero(factors).tolist()
        if len(own) != 1 or own[0] in gone:
            gone.clear()
        else:
            gone.add(own[0])
            found.append((row, own[0]))
    return found


def _effect(name: str, effects: FloatArray) -> ElementaryEffect:
    n = len(effects)
    if not n:
        return ElementaryEffect(name, effects, *(math.nan,) * 6)
    mu, mu_star = float(effects.mean()), float(np.abs(effects).mean())
    if n < 2:
        return ElementaryEffect(name, effects, mu, mu_star, *(math.nan,) * 4)
    dust = 1e-9 * float(np.abs(effects).max())
    # Effects that are all equal up to rounding have no scatter.
    sigma, spread = (float(one.std(ddof=1)) if np.ptp(one) > dust else 0.0 for one in (effects, np.abs(effects)))
    half = float(stats.t.ppf(0.975, n - 1)) * spread / math.sqrt(n)
    p = 2 * float(stats.t.sf(abs(mu) / (sigma / math.sqrt(n)), n - 1)) if sigma else float(mu == 0)
    return ElementaryEffect(name, effects, mu, mu_star, half, sigma, p, p)


def _corrected(found: Sequence[ElementaryEffect]) -> tuple[ElementaryEffect, ...]:
    """The same with p by Holm 1979 over all factors that have one."""
    tested = sorted((k for k, one in enumerate(found) if math.isfinite(one.p)), key=lambda k: found[k].p)
    corrected, least = [one.p for one in found], 0.0
    for place, k in enumerate(tested):
        least = max(least, min(1.0, (len(tested) - place) * found[k].p))
        corrected[k] = least
    return tuple(ElementaryEffect(**{**vars(one), "p_holm": p}) for one, p in zip(found, corrected, strict=True))
