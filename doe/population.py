"""The distribution of an observable over seeds: all stored pours of one scene, and how a changed setting differs.

One pour is one draw. Notation: y = a single pour; m, s, n = mean, standard deviation and size of a population;
t(q, ν) = quantile of Student's t.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from scipy import stats

from doe.analysis.power import smallest_difference
from doe.analysis.t_tests import Sample, welch_test
from doe.record import Record
from doe.store import StoredRun

PLANNED = 12
"""Number of pours of each of two settings for which the detectable difference is stated."""


@dataclass(frozen=True)
class Population(Record):
    """``values`` of ``observable``, one per seed in ``seeds``; ``void``: pours without a valid value."""

    observable: str
    seeds: tuple[int, ...]
    values: tuple[float, ...]
    void: int = 0

    @staticmethod
    def of(runs: Iterable[StoredRun], observable: str) -> Population:
        """Return the population of the valid ``runs`` in which ``observable`` could be read."""
        all_runs = list(runs)
        found = {run.seed: run.observables.get(observable) for run in all_runs if run.valid}
        read = {seed: value for seed, value in found.items() if value is not None}
        return Population(observable, tuple(read), tuple(read.values()), len(all_runs) - len(read))

    @property
    def n(self) -> int:
        """Return the number of values."""
        return len(self.values)

    @property
    def sample(self) -> Sample:
        """Return mean, standard deviation and n; NaN where there are too few values."""
        return Sample.of(self.values) if self.values else Sample(math.nan, math.nan, 0)

    @property
    def interval(self) -> tuple[float, float]:
        """Return the 95 % interval of the mean, m ± t(0.975, n − 1) s/√n; NaN for fewer than two values."""
        sample = self.sample
        return sample.mean - sample.half_width, sample.mean + sample.half_width


@dataclass(frozen=True)
class Comparison(Record):
    """Difference of ``pours`` of a new setting from ``former`` pours, with the half width of its 95 % interval."""

    difference: float
    half_width: float
    pours: int
    former: int
    planned: int
    resolved: float
    """Difference that ``planned`` pours of each setting would detect with 80 % power at p < 0.05."""

    @property
    def distinguishable(self) -> bool:
        """Whether the interval excludes zero."""
        return abs(self.difference) > self.half_width


def compared(new: Population, single: float, former: Population, planned: int = PLANNED) -> Comparison | None:
    """Return how a changed setting differs from the ``former`` one; None where the scatter between seeds is unknown.

    With two or more pours of the ``new`` setting, the two means are compared by Welch's test. Otherwise the ``single``
    pour is compared with the 95 % prediction interval of one more pour of the former setting,
    m ± t(0.975, n − 1) s √(1 + 1/n) (Hahn & Meeker 1991, Statistical Intervals, section 4.7).

    ``planned`` pours of each setting resolve `doe.analysis.power.smallest_difference`:
    (shift of the noncentral t) s √(2/n).
    """
    before, after = former.sample, new.sample
    if before.n < 2 or not before.sd > 0:
        return None
    if after.n >= 2:
        test = welch_test(after, before)
        difference, half = test.difference, (test.high - test.low) / 2
        # Pooled: both samples estimate the scatter between seeds.
        freedom = before.n + after.n - 2
        sd = math.sqrt(((before.n - 1) * before.sd**2 + (after.n - 1) * after.sd**2) / freedom)
    elif math.isfinite(single):
        difference, sd = single - before.mean, before.sd
        half = float(stats.t.ppf(0.975, before.n - 1)) * sd * math.sqrt(1 + 1 / before.n)
    else:
        return None
    return Comparison(difference, half, max(1, after.n), before.n, planned, smallest_difference(sd, planned))
