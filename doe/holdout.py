"""Held-out conditions: prediction errors before and after, the noise floor, and whether the data contradict an answer.

Per observable, over its held-out conditions: RMSE = root mean square of (mean simulated - mean measured);
noise floor = root mean square of sqrt(s_meas^2/n_meas + s_sim^2/n_sim), the error of a perfect model;
skill = 1 - (after^2 - noise^2)/(before^2 - noise^2). For the overall errors, each observable is first divided by the
standard deviation of a pour,

    s^2 = ((n - 1) s_meas^2 + (m - 1) s_after^2)/(n + m - 2)

pooled over the n measured pours and the m simulated pours of the final model. The s_meas of a few pours alone will not
do: for some observable it is small by chance, and that observable would then dominate the sum. With n = 3, m = 8 and
eleven normal observables, a perfect model shows 1.5 times the floor (root mean square) if scaled by s_meas, 1.15 times
if scaled by s. Predictions are fresh simulations, never the emulator.

If each replicate is the mean of k pours, its variance is s^2/k, and k s_meas^2 enters s. A single measured replicate
gives no estimate of its scatter; its variance is then that of the simulated pours of the final model plus that of the
instrument, s_after^2/k + u^2 with the stated uncertainty u.

An answer is tested on the summary of the smallest p over all held-out conditions, where

    |t| = |measured − poured| / √(s² (1/(k r) + 1/m) + u²)

with r measured replicates, each the mean of k pours, and m fresh pours, s pooled over both (for a single replicate that
of the fresh pours alone) and f = r + m − 2. The degrees of freedom are f (1 + u²/(s² (1/(k r) + 1/m)))² (Welch and
Satterthwaite, doi 10.2307/3002019). As in the fit, an instrument errs equally in all replicates. Bonferroni's
p = (number of summaries) P(|t_f| ≥ |t|) tests each summary by itself, because a missing effect shows in the summaries
on which it acts, not evenly in all. It is combined with p₀, the probability that fitted data lie as far from the same
model: the held-out data contradict the answer if Fisher's P = q (1 − ln q), q = p p₀, is below ``CONTRADICTED``
(Statistical Methods for Research Workers, 1932, 21.1). A wrong model is often somewhat off in both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.errors import StatisticsError
from doe.measurement.residual_map import pooled_deviation
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

OVERALL = "overall"
CONTRADICTED = 0.01
"""Of 255 right answers, names and "nothing missing" (roots 1 to 3), none is below; of 16 names given to effects from
outside the library, six are."""
CONSTANT_FLOOR = 1e-3
"""Least standard deviation of a summary, as a share of its size."""


@dataclass(frozen=True)
class MeasuredReplicates:
    """What was measured in one condition.

    Attributes
    ----------
    condition, summaries
        Names of the condition and of its d summaries.
    values
        Replicates (r, d).
    stated
        Standard uncertainty of a replicate (d,), 0 where none is stated; of several it enters the test alone.
    mean_of
        Number of pours of which each replicate is the mean.
    """

    condition: str
    summaries: tuple[str, ...]
    values: FloatArray
    stated: FloatArray
    mean_of: int = 1

    @property
    def alone(self) -> bool:
        """Whether there is only one replicate, so that its scatter is unknown."""
        return len(self.values) == 1

    @property
    def instrument(self) -> FloatArray:
        """Uncertainty that the scatter of the replicates does not contain (d,): what is stated for a single one."""
        return self.stated if self.alone else np.zeros_like(self.stated)

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of the replicates (d,), or the stated uncertainty of a single replicate."""
        return self.stated if self.alone else np.asarray(self.values.std(axis=0, ddof=1), dtype=np.float64)

    @property
    def share(self) -> float:
        """Variance of a replicate, without that of the instrument, as a share of the variance of a pour."""
        return 1.0 / self.mean_of

    def deviation_of_a_pour(self, poured: FloatArray) -> FloatArray:
        """Standard deviation of a pour, pooled over these replicates and simulated pours (m, d); (d,)."""
        return pooled_deviation(math.sqrt(self.mean_of) * self.values, poured)


@dataclass(frozen=True)
class HoldoutCondition:
    """Measurements in one condition, with pours of the base model (m, d) and of the final model (m', d)."""

    measured: MeasuredReplicates
    before: FloatArray
    after: FloatArray


@dataclass(frozen=True)
class HoldoutError(Record):
    """Errors of one observable (in its own unit) or overall (in standard deviations of a replicate).

    skill and its 95 % bootstrap interval are NaN if the base model is already within the noise. ratio = after/noise.
    coverage_before, coverage_after: share of measured replicates inside the models' 90 % predictive intervals.
    """

    observable: str
    before: float
    after: float
    noise_floor: float
    ratio: float
    skill: float
    skill_low: float
    skill_high: float
    coverage_before: float
    coverage_after: float


def holdout_errors(
    conditions: Sequence[HoldoutCondition], samples: int = 2000, seed: int = 0
) -> tuple[HoldoutError, ...]:
    """Return the errors per observable, in order of first appearance, and overall last.

    Raises StatisticsError without a condition, without a measured replicate, or with fewer than two pours of a model.
    """
    _require(conditions)
    generator = np.random.default_rng(seed)
    entries = [_Entry.of(c, i, samples, generator) for c in conditions for i in range(len(c.measured.summaries))]
    names = list(dict.fromkeys(entry.observable for entry in entries))
    groups = [[entry for entry in entries if entry.observable == name] for name in names]
    rows = [_error(name, group, np.ones(len(group))) for name, group in zip(names, groups, strict=True)]
    return (*rows, _error(OVERALL, entries, np.array([entry.unit for entry in entries])))


@dataclass(frozen=True)
class _Entry:
    """One observable in one condition: mean errors, squared noise floor, unit, bootstrap errors (samples,),
    coverage.
    """

    observable: str
    before: float
    after: float
    noise_before: float
    noise_after: float
    unit: float
    before_draws: FloatArray
    after_draws: FloatArray
    inside_before: FloatArray
    inside_after: FloatArray

    @staticmethod
    def of(condition: HoldoutCondition, column: int, samples: int, generator: np.random.Generator) -> _Entry:
        data = condition.measured
        measured, before, after = (values[:, column] for values in (data.values, condition.before, condition.after))
        instrument = float(data.instrument[column])
        of_a_pour = float(data.deviation_of_a_pour(condition.after)[column])
        deviation = math.sqrt(data.share * of_a_pour**2 + instrument**2)
        noise = deviation**2 if data.alone else _square_error(measured)
        draws = [_drawn_means(values, samples, generator) for values in (measured, before, after)]
        if data.alone:
            draws[0] = draws[0] + deviation * generator.standard_normal(samples)
        return _Entry(
            observable=data.summaries[column],
            before=float(before.mean() - measured.mean()),
            after=float(after.mean() - measured.mean()),
            noise_before=noise + _square_error(before),
            noise_after=noise + _square_error(after),
            unit=deviation or 1.0,
            before_draws=draws[1] - draws[0],
            after_draws=draws[2] - draws[0],
            inside_before=_inside(before, measured, data.share, instrument),
            inside_after=_inside(after, measured, data.share, instrument),
        )


def _error(observable: str, entries: Sequence[_Entry], unit: FloatArray) -> HoldoutError:
    """Return the errors of some entries, each divided by its unit, shape (entries,)."""

    def mean_square(values: FloatArray) -> FloatArray:
        return np.asarray((values**2).mean(axis=0))

    def noise(values: list[float]) -> float:
        return float((np.array(values) / unit**2).mean())

    before = float(mean_square(np.array([e.before for e in entries]) / unit))
    after = float(mean_square(np.array([e.after for e in entries]) / unit))
    floor_before, floor_after = noise([e.noise_before for e in entries]), noise([e.noise_after for e in entries])
    skill = _skill(before - floor_before, after - floor_after)
    # A resample carries the noise of the data and its own, hence twice the floor.
    gained = [
        mean_square(np.stack([getattr(e, field) for e in entries]) / unit[:, None]) - 2 * floor
        for field, floor in (("before_draws", floor_before), ("after_draws", floor_after))
    ]
    skills = np.where(gained[0] > 0, 1 - gained[1] / np.where(gained[0] > 0, gained[0], 1.0), np.nan)
    usable = skills[np.isfinite(skills)] if math.isfinite(skill) else np.array([])
    low, high = np.percentile(usable, [2.5, 97.5]) if usable.size else (math.nan, math.nan)
    return HoldoutError(
        observable=observable,
        before=math.sqrt(before),
        after=math.sqrt(after),
        noise_floor=math.sqrt(floor_after),
        ratio=math.sqrt(after / floor_after) if floor_after > 0 else math.nan,
        skill=skill,
        skill_low=float(low),
        skill_high=float(high),
        coverage_before=float(np.concatenate([e.inside_before for e in entries]).mean()),
        coverage_after=float(np.concatenate([e.inside_after for e in entries]).mean()),
    )


@dataclass(frozen=True)
class HeldOut(Record):
    """Held-out data compared with fresh pours of a model: the summary that deviates most, its |t|, and Bonferroni's p.

    ``fit``: p of the fitted data under that model; 1 where the answer leaves several models.
    """

    label: str
    condition: str
    summary: str
    farthest: float
    p: float
    fit: float = 1.0

    @property
    def together(self) -> float:
        """Fisher's combined probability, P(U₁ U₂ ≤ q) = q (1 − ln q), with q the product of ``p`` and ``fit``."""
        q = self.p * self.fit
        return q * (1.0 - math.log(q)) if q > 0.0 else 0.0


def held_out(
    label: str, data: Sequence[MeasuredReplicates], poured: Sequence[FloatArray], fit: float = 1.0
) -> HeldOut | None:
    """Compare ``data`` with fresh pours (m, d) of the model ``label``; None where nothing can be compared."""
    worst: HeldOut | None = None
    asked = 0
    for one, block in zip(data, poured, strict=True):
        r, m = len(one.values), len(block)
        if r < 1 or m < 2:
            continue
        floor = CONSTANT_FLOOR * np.abs(np.concatenate([one.values, block])).max(axis=0)
        spread = np.maximum(one.deviation_of_a_pour(block), floor)
        if not (varies := spread > 0.0).any():
            continue
        asked += int(varies.sum())
        scatter = np.where(varies, spread, 1.0) ** 2 * (one.share / r + 1 / m)
        variance = scatter + one.stated**2
        off = np.where(varies, np.abs(one.values.mean(axis=0) - block.mean(axis=0)), 0.0)
        t = off / np.sqrt(variance)
        tails = stats.t.sf(t, (r + m - 2) * (variance / scatter) ** 2)
        k = int(np.lexsort((-t, tails))[0])
        if worst is None or tails[k] < worst.p:
            worst = HeldOut(label, one.condition, one.summaries[k], float(t[k]), float(tails[k]))
    return None if worst is None else replace(worst, p=min(1.0, asked * 2.0 * worst.p), fit=fit)


def _skill(before: float, after: float) -> float:
    """Return 1 - after/before of squared errors less their noise; NaN where nothing but noise is left in `before`."""
    return 1 - after / before if before > 0 else math.nan


def _drawn_means(values: FloatArray, samples: int, generator: np.random.Generator) -> FloatArray:
    """Bootstrap means (samples,); their variance is s²/n, with s² over n − 1 (Efron 1982, doi 10.1137/1.9781611970319).

    Means of plain resamples have the variance (n − 1)/n s²/n, less than the noise floor that is subtracted from them.
    """
    n = len(values)
    means = values[generator.integers(0, n, size=(samples, n))].mean(axis=1)
    return np.asarray(values.mean() + (means - values.mean()) * math.sqrt(n / max(1, n - 1)))


def _square_error(values: FloatArray) -> float:
    """Return the squared standard error of the mean."""
    return float(values.var(ddof=1) / len(values))


def _inside(
    predicted: FloatArray, measured: FloatArray, share: float, instrument: float, level: float = 0.9
) -> FloatArray:
    """Return 1 where a measured replicate lies within mean ± t sqrt(s^2 (share + 1/m) + u^2) of m simulated pours.

    The degrees of freedom of t are those of s, even where u is added.
    """
    m = len(predicted)
    variance = float(predicted.var(ddof=1)) * (share + 1 / m) + instrument**2
    half = stats.t.ppf((1 + level) / 2, m - 1) * math.sqrt(variance)
    return (np.abs(measured - predicted.mean()) <= half).astype(np.float64)


def _require(conditions: Sequence[HoldoutCondition]) -> None:
    if not conditions:
        raise StatisticsError("holdout: no condition; at least one is needed")
    for condition in conditions:
        measured, before, after = len(condition.measured.values), len(condition.before), len(condition.after)
        if measured < 1 or min(before, after) < 2:
            raise StatisticsError(
                f"{condition.measured.condition}: replicates measured {measured}, poured {before} before and {after} "
                "after; at least 1, 2 and 2 are needed"
            )
