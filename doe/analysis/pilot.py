"""Pilot: how noisy is one run, which observable separates changes best, and how many replicates does a study need?

sigma is the standard deviation over seeds at one setting; its interval follows from (n - 1) s^2/sigma^2 ~
chi^2(n - 1). The spread at different settings is compared by Brown and Forsythe's test. Source: Brown and
Forsythe 1974, J. Am. Stat. Assoc. 69:364; power as in `doe.analysis.power`.

d' is the number of replicate standard deviations by which a declared change shifts an observable:
d' = (mean(changed) - mean(centre))/s, with s the pooled standard deviation of both groups (Cohen's d). It is signed, so
that the interval of a change without effect includes zero; estimators are compared by the mean of |d'| over the
changes. Intervals resample whole runs, the same runs for all estimators, because all estimators read the same piles.
Source: Cohen 1988, ch. 2; Davison and Hinkley 1997, ch. 5.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.power import smallest_difference, smallest_main_effect
from doe.analysis.t_tests import Sample
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

BIAS_LIMIT_DEG = 5.0
"""An estimator whose error on synthetic piles exceeds this, however they are filled, is excluded."""
CLEARLY = 0.95
"""Share of the bootstrap samples in which another estimator must beat the default to replace it."""


@dataclass(frozen=True)
class Noise(Record):
    """Replicate standard deviation with its 95 % chi^2 interval, unit of the response."""

    mean: float
    sigma: float
    low: float
    high: float
    runs: int

    @property
    def half_width(self) -> float:
        """Return half the 95 % interval of the mean."""
        return Sample(self.mean, self.sigma, self.runs).half_width


@dataclass(frozen=True)
class EqualVariance(Record):
    """Brown–Forsythe test of equal spread over settings; f and p are NaN if no setting has any spread."""

    f: float
    p: float
    sigmas: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Resolution(Record):
    """What `replicates` runs resolve with power 0.8 at level 0.05, unit of the response.

    difference: between two means of that many runs each. main_effect: in a two-level screening with that many
    runs per row, each factor tested by itself; main_effect_bonferroni: all factors tested at once. NaN for one
    replicate.
    """

    replicates: int
    difference: float
    main_effect: float
    main_effect_bonferroni: float


@dataclass(frozen=True)
class Separation(Record):
    """Signed d' of one estimator for one declared change, with its 95 % bootstrap interval; shift in the unit of the
    estimator.
    """

    estimator: str
    change: str
    shift: float
    sigma: float
    d_prime: float
    low: float
    high: float


@dataclass(frozen=True)
class EstimatorChoice(Record):
    """The estimator that the screening reads: the default, unless another one clearly separates the changes better.

    best: the admitted estimator with the largest mean |d'|. share_better: share of bootstrap samples in which `best`
    beats `default` (1 if the default is excluded, 0 if it is itself the best). mean_d_prime: mean of |d'| per
    estimator over all changes, in the order of `estimators`. excluded: estimators whose bias on piles of known angle
    exceeds the limit however the piles are made.
    """

    chosen: str
    default: str
    best: str
    share_better: float
    estimators: tuple[str, ...]
    mean_d_prime: tuple[float, ...]
    excluded: tuple[str, ...]
    separations: tuple[Separation, ...]
    statement: str


def replicate_noise(values: npt.ArrayLike, level: float = 0.95) -> Noise:
    """Return sigma = sd of the values and its interval sqrt((n - 1) s^2/chi^2 quantile).

    NaN values are missing runs. Raises StatisticsError for fewer than two valid ones.
    """
    array = _valid("values", values)
    df, sigma = array.size - 1, float(array.std(ddof=1))
    low = sigma * math.sqrt(df / float(stats.chi2.ppf((1 + level) / 2, df)))
    high = sigma * math.sqrt(df / float(stats.chi2.ppf((1 - level) / 2, df)))
    return Noise(float(array.mean()), sigma, low, high, int(array.size))


def equal_variance(groups: Mapping[str, npt.ArrayLike]) -> EqualVariance:
    """Return the Brown–Forsythe test (Levene's with medians) over named settings.

    Raises StatisticsError for fewer than two settings or fewer than two valid runs at one.
    """
    if len(groups) < 2:
        raise StatisticsError(f"groups holds {len(groups)} setting(s); at least 2 are needed")
    samples = {name: _valid(name, values) for name, values in groups.items()}
    sigmas = tuple((name, float(values.std(ddof=1))) for name, values in samples.items())
    if all(sigma == 0 for _, sigma in sigmas):
        return EqualVariance(math.nan, math.nan, sigmas)
    f, p = stats.levene(*samples.values(), center="median")
    return EqualVariance(float(f), float(p), sigmas)


def resolution(sigma: float, replicates: int, rows: int = 28, factors: int = 24, efficiency: float = 1.0) -> Resolution:
    """Return what `replicates` runs resolve if one run has the SD `sigma` (see `power.smallest_main_effect`)."""
    return Resolution(
        replicates,
        smallest_difference(sigma, replicates),
        smallest_main_effect(sigma, replicates, rows, efficiency=efficiency),
        smallest_main_effect(sigma, replicates, rows, comparisons=factors, efficiency=efficiency),
    )


def d_prime(centre: FloatArray, changed: FloatArray) -> FloatArray:
    """Return the signed d' of samples along the last axis, shapes (..., n1) and (..., n2) -> (...).

    NaN if neither group has any spread.
    """
    n1, n2 = centre.shape[-1], changed.shape[-1]
    squares = (n1 - 1) * centre.var(axis=-1, ddof=1) + (n2 - 1) * changed.var(axis=-1, ddof=1)
    sigma = np.sqrt(squares / (n1 + n2 - 2))
    shift = changed.mean(axis=-1) - centre.mean(axis=-1)
    return np.asarray(np.divide(shift, sigma, out=np.full_like(shift, np.nan), where=sigma > 0))


def choose_estimator(
    centre: Mapping[str, npt.ArrayLike],
    changed: Mapping[str, Mapping[str, npt.ArrayLike]],
    default: str,
    bias: Mapping[str, Sequence[float]] | None = None,
    bias_limit: float = math.inf,
    samples: int = 2000,
    seed: int = 0,
) -> EstimatorChoice:
    """Keep the default estimator unless the one with the largest mean |d'| beats it in 95 % of the bootstrap samples.

    centre: estimator -> values of the runs at the centre. changed: change -> estimator -> values of the runs
    under it. Every estimator reads the same runs; a run that any of them could not read (NaN) is left out for
    all. default: the target's own estimator. bias: errors of each estimator on piles of known angle, one for each way
    to make them; an estimator is excluded only if all of its errors exceed bias_limit.

    Raises StatisticsError if the default is not an estimator, estimators or run counts differ, there are fewer than
    three runs, or no estimator is admitted.
    """
    estimators = tuple(centre)
    if not estimators or not changed:
        raise StatisticsError("centre and changed must each hold at least one entry")
    if default not in estimators:
        raise StatisticsError(f"default = '{default}' is not one of {', '.join(estimators)}")
    base = _common_runs("centre", estimators, centre)
    groups = {change: _common_runs(change, estimators, values) for change, values in changed.items()}
    errors = {e: list((bias or {}).get(e, ())) for e in estimators}
    limit_broken = tuple(e for e in estimators if errors[e] and all(abs(error) > bias_limit for error in errors[e]))
    admitted = np.array([e not in limit_broken for e in estimators])
    if not admitted.any():
        raise StatisticsError(f"bias_limit = {bias_limit:g} excludes every estimator")

    generator = np.random.default_rng(seed)
    base_draws = _resample(base, samples, generator)
    draws = {c: d_prime(base_draws, _resample(values, samples, generator)) for c, values in groups.items()}
    separations = tuple(
        _separation(name, change, base[i], groups[change][i], draws[change][i])
        for change in groups
        for i, name in enumerate(estimators)
    )
    means = np.array([np.mean([abs(s.d_prime) for s in separations if s.estimator == e]) for e in estimators])
    best = int(np.argmax(np.where(admitted, np.nan_to_num(means, nan=-np.inf), -np.inf)))
    own = estimators.index(default)
    drawn = np.nan_to_num(np.mean([np.abs(draw) for draw in draws.values()], axis=0), nan=-np.inf)
    share = float((drawn[best] > drawn[own]).mean()) if admitted[own] else 1.0
    chosen = best if share >= CLEARLY else own
    return EstimatorChoice(
        chosen=estimators[chosen],
        default=default,
        best=estimators[best],
        share_better=share,
        estimators=estimators,
        mean_d_prime=tuple(float(m) for m in means),
        excluded=limit_broken,
        separations=separations,
        statement=_statement(default, estimators[best], share, bool(admitted[own])),
    )


def _valid(name: str, values: npt.ArrayLike) -> FloatArray:
    array = np.asarray(values, dtype=np.float64).ravel()
    array = array[~np.isnan(array)]
    if array.size < 2:
        raise StatisticsError(f"{name} holds {array.size} valid run(s); at least 2 are needed")
    return array


def _statement(default: str, best: str, share: float, admitted: bool) -> str:
    if not admitted:
        return f"{default} is biased beyond the limit; of the others {best} separates the declared changes best."
    if best == default:
        return f"{default}, the target's own, separates the declared changes best."
    verdict = (
        f"{best} separates the declared changes better than {default} in {100 * share:.0f} % of the resampled pilots"
    )
    needed = f"{100 * CLEARLY:.0f} % are asked for"
    return f"{verdict} ({needed})." if share >= CLEARLY else f"{verdict}; {needed}, so {default} is kept."


def _common_runs(group: str, estimators: tuple[str, ...], values: Mapping[str, npt.ArrayLike]) -> FloatArray:
    """Return the values of the runs that every estimator could read, shape (estimators, runs)."""
    if set(values) != set(estimators):
        raise StatisticsError(f"{group} holds {sorted(values)}; allowed are the estimators {sorted(estimators)}")
    rows = [np.asarray(values[name], dtype=np.float64).ravel() for name in estimators]
    if len({row.size for row in rows}) != 1:
        raise StatisticsError(f"{group}: every estimator must read the same number of runs")
    matrix = np.stack(rows)
    matrix = matrix[:, ~np.isnan(matrix).any(axis=0)]
    if matrix.shape[1] < 3:
        raise StatisticsError(f"{group} holds {matrix.shape[1]} valid runs; at least 3 are needed")
    return matrix


def _resample(values: FloatArray, samples: int, generator: np.random.Generator) -> FloatArray:
    """Return resampled runs, shape (estimators, samples, runs), the same runs for every estimator."""
    runs = values.shape[1]
    return values[:, generator.integers(0, runs, size=(samples, runs))]


def _separation(estimator: str, change: str, centre: FloatArray, changed: FloatArray, draws: FloatArray) -> Separation:
    n1, n2 = centre.size, changed.size
    sigma = math.sqrt(((n1 - 1) * centre.var(ddof=1) + (n2 - 1) * changed.var(ddof=1)) / (n1 + n2 - 2))
    low, high = np.nanpercentile(draws, [2.5, 97.5]) if np.isfinite(draws).any() else (math.nan, math.nan)
    shift = float(changed.mean() - centre.mean())
    return Separation(estimator, change, shift, sigma, float(d_prime(centre, changed)), float(low), float(high))
