"""d': by how many replicate standard deviations a declared change shifts an observable, and which one shows
it best.

d' = (mean(changed) - mean(centre))/s, with s the pooled standard deviation of both groups (Cohen's d). It keeps its
sign, so that the interval of a change that does nothing includes zero; estimators are compared by the mean of |d'|
over the changes. Intervals resample whole runs, and the same runs for all estimators, because one pile is read by every
estimator. Source: Cohen 1988, ch. 2; Davison and Hinkley 1997, ch. 5.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

CLEARLY = 0.95

"""Share of the bootstrap samples in which another estimator must beat the default to replace it."""


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

    best: the one of the largest mean |d'| of those admitted. share_better: share of bootstrap samples in which `best`
    beats `default` (1 where the default is excluded, 0 where it is the best itself). mean_d_prime: mean of |d'| per
    estimator over all changes, in the order of `estimators`. excluded: those whose bias on piles of known angle
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


def d_prime(centre: FloatArray, changed: FloatArray) -> FloatArray:
    """Return the signed d' of samples along the last axis, shapes (..., n1) and (..., n2) -> (...).

    NaN where neither group spreads.
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
    """Keep the default estimator unless the one of the largest mean |d'| beats it in 95 % of the bootstrap samples.

    centre: estimator -> values of the runs at the centre. changed: change -> estimator -> values of the runs
    under it. Every estimator reads the same runs; a run that any of them could not read (NaN) is left out for
    all. default: the target's own estimator. bias: errors of each estimator on piles of known answer, one for each way
    to make them; it is excluded only if every one of them exceeds bias_limit.

    Raises StatisticsError for a default that is no estimator, differing estimators or run counts, fewer than
    three runs, or when none is admitted.
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
