"""Verification: do fresh runs at the optimum agree with the measurement? Difference tests, equivalence and
error.

A difference that is not significant does not prove agreement: with few runs nothing is significant. The
equivalence test (TOST) asks the right question: is the difference shown to lie within a margin fixed
beforehand? The tests themselves are in `doe.analysis.t_tests`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy.typing as npt
from scipy import optimize, stats

from doe.analysis.t_tests import (
    DifferenceTest,
    EquivalenceTest,
    Sample,
    equivalence_test,
    one_sample_test,
    pooled_test,
    welch_test,
)
from doe.errors import StatisticsError
from doe.record import Record

Verdict = Literal["equivalent", "different", "cannot tell"]


@dataclass(frozen=True)
class Verification(Record):
    """Fresh runs against a measured mean. Tests that the data do not allow are None."""

    simulated: Sample
    target: Sample
    relative_error_percent: float
    welch: DifferenceTest | None
    pooled: DifferenceTest | None
    one_sample: DifferenceTest | None
    equivalence: EquivalenceTest | None
    verdict: Verdict
    statement: str

    @property
    def deciding(self) -> DifferenceTest | None:
        """Return the test of the difference: Welch's, or the one-sample test if the target has no spread."""
        return self.welch or self.one_sample


def relative_error_percent(simulated: float, target: float) -> float:
    """Return 100 |simulated - target|/|target|; NaN for a target of zero."""
    return 100 * abs(simulated - target) / abs(target) if target != 0 else math.nan


def verify(
    simulated: npt.ArrayLike,
    target: float,
    target_sd: float | None,
    target_n: int | None,
    margin: float = 2.0,
    alpha: float = 0.05,
) -> Verification:
    """Compare fresh runs with a measured mean.

    simulated: one value per run, NaN for a missing run. target, target_sd: unit of the response; without sd
    or n the measured mean is taken as exact, and the one-sample test decides. margin: equivalence margin,
    fixed beforehand.

    Raises StatisticsError without a valid run, for a negative sd or a margin that is not positive.
    """
    if target_sd is not None and not target_sd >= 0:
        raise StatisticsError(f"target_sd = {target_sd} must not be negative")
    sample = Sample.of(simulated)
    measured = Sample(target, math.nan if target_sd is None else target_sd, 0 if target_n is None else target_n)
    repeated = sample.n > 1
    comparable = repeated and measured.n > 1 and math.isfinite(measured.sd)
    level = 1 - alpha
    welch = welch_test(sample, measured, level) if comparable else None
    one_sample = one_sample_test(sample, target, level) if repeated else None
    deciding = welch if welch is not None else one_sample
    equivalence = equivalence_test(deciding, margin, alpha) if deciding is not None else None
    error = relative_error_percent(sample.mean, target)
    verdict, statement = _verdict(sample, target, deciding, equivalence, margin, alpha)
    return Verification(
        simulated=sample,
        target=measured,
        relative_error_percent=error,
        welch=welch,
        pooled=pooled_test(sample, measured, level) if comparable else None,
        one_sample=one_sample,
        equivalence=equivalence,
        verdict=verdict,
        statement=statement,
    )


def sd_from_pooled_p(p: float, simulated: Sequence[float], mean: float, n: int) -> float:
    """Return the standard deviation of n measurements that a printed p value of the pooled t test implies.

    Inverts p = 2 P(T > |t|), t = difference/sqrt(s_p^2 (1/n1 + 1/n)), s_p^2 = ((n1 - 1) s1^2 + (n - 1)
    sd^2)/(n1 + n - 2). Raises StatisticsError when p is outside (0, 1) or no real sd gives it.
    """
    _require_probability(p)
    sample = Sample.of(simulated)
    df = sample.n + n - 2
    t = float(stats.t.isf(p / 2, df))
    pooled_variance = ((sample.mean - mean) / t) ** 2 / (1 / sample.n + 1 / n)
    variance = (pooled_variance * df - (sample.n - 1) * sample.sd**2) / (n - 1)
    if not variance >= 0:
        raise StatisticsError(f"p = {p} follows from no standard deviation: the simulated runs alone spread more")
    return math.sqrt(variance)


def sd_from_welch_p(p: float, simulated: Sequence[float], mean: float, n: int) -> float:
    """Return the standard deviation of n measurements that a printed p value of Welch's test implies, by root
    search.

    Raises StatisticsError when p is outside (0, 1) or no sd below 1000 |difference| + 1000 sd gives it.
    """
    _require_probability(p)
    sample = Sample.of(simulated)

    def excess(sd: float) -> float:
        return welch_test(sample, Sample(mean, sd, n)).p - p

    highest = 1000 * (abs(sample.mean - mean) + sample.sd)
    if excess(0.0) > 0 or excess(highest) < 0:
        raise StatisticsError(f"p = {p} follows from no standard deviation: the simulated runs alone spread more")
    return float(optimize.brentq(excess, 0.0, highest))


def _verdict(
    sample: Sample,
    target: float,
    test: DifferenceTest | None,
    equivalence: EquivalenceTest | None,
    margin: float,
    alpha: float,
) -> tuple[Verdict, str]:
    """Return the verdict and its sentence."""
    if test is None or equivalence is None or math.isnan(test.p):
        return "cannot tell", (
            f"{sample.n} run(s) give {sample.mean:.4g} against {target:.4g}; without spread nothing can be tested."
        )
    confidence = round(100 * (1 - alpha))
    found = (
        f"The runs differ from the measurement by {test.difference:+.3g} "
        f"({confidence} % interval {test.low:+.3g} to {test.high:+.3g})"
    )
    if equivalence.equivalent:
        extra = "; the difference is significant but lies within it" if test.p < alpha else ""
        return "equivalent", f"{found}: equivalent within a margin of {margin:g}{extra}."
    if test.p < alpha:
        return "different", f"{found}: different, and not shown to lie within a margin of {margin:g}."
    return "cannot tell", (
        f"{found}: neither different nor shown to lie within a margin of {margin:g}; more runs are needed to tell."
    )


def _require_probability(p: float) -> None:
    if not 0 < p < 1:
        raise StatisticsError(f"p = {p} must lie between 0 and 1")
