"""How often the right effect can be named at all: the Bayes limit of a kind of data, whatever the method.

If the signatures are known exactly, the whitened shift of a data set is z = s u_e + N(0, I), where u_e is the direction
of the effect that acts and s its strength. All that z tells about the models is in t_f = u_f·z, which is normal with
mean s C_fe and covariance C, the matrix of the signatures' cosines. The evidence for f against nothing is

    Z_f = ∫ exp(b t_f − b²/2) p(b) db,    p(b) ∝ 1/b on ``LEAST`` … ``MOST`` standard errors

Mirror images of an effect that has a direction share its prior. The rule that names the effect of the largest posterior
if that is at least τ names the most effects at every risk of a wrong name: the risk–coverage curve. On average over the
prior no rule that uses the same numbers does better; a rule that seems to has been given more than the data.

**The ruler** of this project, by which an effect is said to be 6 σ strong, is the effect's shift of the means of a data
set, in standard errors and without the contribution of noise, in the scalars of the fitted conditions at ``REPLICATES``
pours each:

    d² = δᵀ M δ,    M = (Σ/n + J Jᵀ)⁻¹

δ is the shift of the features of all fitted conditions, Σ the covariance of one pour (one block per condition), n the
number of pours of a data set in each condition, and J the change by each parameter per standard deviation of its
independent measurement: a shift that recalibration can absorb counts for little. A plain d² of estimated means is too
large by their noise. Shifts of separate folds of pours have independent noise, so products between different folds are
free of that bias (crossnobis: Diedrichsen et al. 2016, arXiv 1607.01371, eq. 9):

    d² = [ (Σ_f δ_f)ᵀ M (Σ_f δ_f) − Σ_f δ_fᵀ M δ_f ] / (F (F − 1))

Its standard error adds two jackknives over the folds in quadrature: one of the shift with the metric held fixed, and
one of the metric, whose Σ and J are also estimated, with the shift held fixed (mean and covariance of normal pours are
independent). Σ is shrunk to its diagonal as far as its own scatter requires (Schäfer & Strimmer 2005, doi
10.2202/1544-6115.1175).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import block_diag
from scipy.special import logsumexp
from scipy.stats import norm

from doe.analysis.covariance import shrunk_covariance
from doe.diagnose.result import Level
from doe.diagnose.training_amplitudes import REPLICATES
from doe.errors import StatisticsError
from doe.record import Record
from doe.validation.reference import SIDE, ReferencePours

FloatArray = npt.NDArray[np.float64]

FOLDS = 8
LEAST, MOST = 1.5, 20.0
"""Range of the prior of an amplitude, in standard errors on the ruler (scalars, six pours)."""
NODES = 24
"""Number of amplitudes over which the evidence is summed."""
NOTHING = 0.5
"""Prior probability that nothing is missing; the effects share the rest equally."""
RISKS = (0.003, 0.01, 0.03, 0.1)
"""Shares of sets of a strength with a wrong name at which the coverage is stated."""
RISK = 0.03
"""The one of ``RISKS`` at which the share of each single effect is stated."""
SETS = 4000
"""Number of made-up data sets of each effect and strength."""
STRENGTHS = (4.0, 6.0, 10.0)
"""Strengths [σ] for which limits are stated."""
CLASS = 0.95
"""Cosine of two signatures above which data cannot tell the effects apart."""


@dataclass(frozen=True)
class Metric:
    """``whitening`` W (k, D) with M = Wᵀ W, so that W δ has unit noise; zero for features that do not vary."""

    whitening: FloatArray

    def white(self, shifts: FloatArray) -> FloatArray:
        """``shifts`` (..., D) in standard errors of a data set, (..., k)."""
        return np.asarray(shifts @ self.whitening.T, dtype=np.float64)


@dataclass(frozen=True)
class Ruler:
    """The ``metric`` of all reference pours, and the metrics ``without`` each of the folds, for its error."""

    metric: Metric
    without: tuple[Metric, ...]


@dataclass(frozen=True)
class Strength(Record):
    """A distance [standard errors of a data set] with its standard error."""

    value: float
    error: float


@dataclass(frozen=True)
class DataKind(Record):
    """One direction of an effect. ``two_sided``: its mirror image is possible as well."""

    effect: str
    name: str
    two_sided: bool


@dataclass(frozen=True)
class Signatures(Record):
    """Strengths and cosines of all signatures in the features of one kind of data.

    Attributes
    ----------
    names
        Directions of effects.
    ruler, strength
        Strength of each direction's stronger reference amplitude, in the scalars at six pours and in these features.
    cosines
        Cosines of all pairs of signatures, (k, k), with unit diagonal.
    """

    names: tuple[str, ...]
    ruler: tuple[Strength, ...]
    strength: tuple[Strength, ...]
    cosines: FloatArray


@dataclass(frozen=True)
class Reached(Record):
    """Strength of one direction of an effect at its reference amplitude.

    Attributes
    ----------
    kind
        The direction.
    amplitude
        The reference amplitude, natural units.
    ruler, weak
        Strength on the ruler at that amplitude and, for the first direction of an effect, at half of it.
    strength
        Strength at six pours, by kind of data.
    """

    kind: DataKind
    amplitude: tuple[float, ...]
    ruler: Strength
    weak: Strength | None
    strength: Mapping[str, Strength]


@dataclass(frozen=True)
class Confusable(Record):
    """Two directions whose signatures are alike in one kind of data."""

    data: str
    first: str
    second: str
    cosine: float


@dataclass(frozen=True)
class LimitRow(Record):
    """The limit for one kind of data, one number ``replicates`` of pours in each condition, and one strength."""

    data: str
    replicates: int
    limit: Limit


@dataclass(frozen=True)
class LimitStudy(Record):
    """The most that data of each kind can tell about the effects of a declared model.

    Attributes
    ----------
    pours
        Number of usable reference pours, by what acts in them, summed over the conditions.
    reached
        Directions of effects, with their strengths.
    confusable
        All pairs, by kind of data, the most alike first.
    rows
        Limits; none for data in which no effect can be told from zero.
    """

    pours: Mapping[str, int]
    reached: tuple[Reached, ...]
    confusable: tuple[Confusable, ...]
    rows: tuple[LimitRow, ...]


@dataclass(frozen=True)
class Limit(Record):
    """The limit for effects of one strength.

    Attributes
    ----------
    strength
        Strength on the ruler [σ].
    right
        Share of sets in which the most probable effect is the right one, given that one acts.
    named
        The risk–coverage curve: share of sets named rightly when at most each of ``RISKS`` gets a wrong name.
    threshold
        Lowest posterior probability for a name that keeps to ``RISK``.
    by_effect
        For each effect, share of its sets named rightly at that threshold.
    """

    strength: float
    right: float
    named: tuple[float, ...]
    threshold: float
    by_effect: Mapping[str, float]


def limit_study(
    sample: ReferencePours, levels: Sequence[Level], offered: Mapping[str, Sequence[int]], seed: int = 0
) -> LimitStudy:
    """The limit of every kind of data.

    Parameters
    ----------
    sample
        Reference pours with all features of every condition, the scalars first.
    levels
        The directions of effects that were poured, at their reference amplitudes.
    offered
        Kind of data → number of leading features that it gives in each condition; the first kind is the ruler's.
    seed
        Seed of the made-up data sets.

    Returns
    -------
    Strengths, the pairs that are most alike, and the limit for each kind of data at each of ``STRENGTHS``, with the
    pours of the data and with twice as many.
    """
    kinds = [DataKind(one.direction.effect, one.direction.name, len(one.direction.full) == 2) for one in levels]
    names = [f"{one.name} strong" for one in kinds]
    samples = {data: sample.first(numbers) for data, numbers in offered.items()}
    scalars = next(iter(samples.values()))
    scale = ruler_of(scalars)
    ruler = [strength_of(scalars, name, scale) for name in names]
    halves = [f"{one.name} weak" for one in kinds]
    weak = [strength_of(scalars, half, scale) if half in sample.pours else None for half in halves]
    by_data: dict[str, tuple[Strength, ...]] = {}
    confusable, rows = [], []
    for data, one in samples.items():
        for replicates in (REPLICATES, 2 * REPLICATES):
            found = signatures_of(one, names, ruler, replicates)
            if replicates == REPLICATES:
                by_data[data] = found.strength
                confusable += _most_alike(data, kinds, found)
            rng = np.random.default_rng(seed)
            limits = [limit_of(found, kinds, strength, rng) for strength in STRENGTHS]
            rows += [LimitRow(data, replicates, limit) for limit in limits if limit is not None]
    reached = tuple(
        Reached(kind, level.direction.at(level.share), ruler[k], weak[k], {d: by_data[d][k] for d in by_data})
        for k, (kind, level) in enumerate(zip(kinds, levels, strict=True))
    )
    pours = {name: sum(map(len, blocks)) for name, blocks in sample.pours.items()}
    return LimitStudy(pours, reached, tuple(confusable), tuple(rows))


def limit_of(
    found: Signatures, kinds: Sequence[DataKind], strength: float, rng: np.random.Generator, sets: int = SETS
) -> Limit | None:
    """The limit for effects that are ``strength`` σ strong on the ruler.

    ``kinds``: the direction of each of ``found.names``. Only those whose strength is known to be above zero take part;
    None if there are none.
    """
    # Ratio of an effect's strength in these features to that on the ruler.
    gain = np.array(
        [s.value / r.value if r.value > 0.0 else 0.0 for s, r in zip(found.strength, found.ruler, strict=True)]
    )
    seen = [k for k, one in enumerate(found.ruler) if one.value > 2.0 * one.error and gain[k] > 0.0]
    if not seen:
        return None
    cosines, gain = found.cosines[np.ix_(seen, seen)], gain[seen]
    effects = [kinds[k].effect for k in seen]
    groups = sorted(set(effects))
    share = np.array([1.0 / effects.count(name) for name in effects])
    values, vectors = np.linalg.eigh(cosines)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    best, probability, truth = [], [], []
    for k, name in enumerate(effects):
        t = strength * gain[k] * cosines[k] + rng.standard_normal((sets, len(seen))) @ root.T
        posterior = _posteriors(t, gain, [kinds[n].two_sided for n in seen], share, effects, groups)
        top = posterior[:, 1:].argmax(axis=1)
        best.append(top)
        probability.append(posterior[np.arange(sets), top + 1])
        truth.append(np.full(sets, groups.index(name)))
    weight = np.repeat(share, sets)
    top, p, true = np.concatenate(best), np.concatenate(probability), np.concatenate(truth)
    correct = top == true
    order = np.argsort(-p)
    wrong = np.cumsum((weight * ~correct)[order]) / weight.sum()
    coverage = np.cumsum((weight * correct)[order]) / weight.sum()
    # Index of the last set that may still be named, at each risk.
    last = np.searchsorted(wrong, RISKS, side="right") - 1
    kept = last[RISKS.index(RISK)]
    threshold = float(p[order[kept]]) if kept >= 0 else float("inf")
    named = correct & (p >= threshold)
    return Limit(
        strength=strength,
        right=float(np.average(correct, weights=weight)),
        named=tuple(float(coverage[k]) if k >= 0 else 0.0 for k in last),
        threshold=threshold,
        by_effect={
            name: float(np.average(named[true == g], weights=weight[true == g])) for g, name in enumerate(groups)
        },
    )


def signatures_of(
    sample: ReferencePours, names: Sequence[str], ruler: Sequence[Strength], replicates: int
) -> Signatures:
    """Strengths and cosines of the reference amplitudes ``names`` in the features of ``sample``.

    ``ruler``: their strengths on the ruler. ``replicates``: number of pours of a data set in each condition.
    """
    scale = ruler_of(sample, replicates)
    shifts = [scale.metric.white(fold_shifts(sample, name)) for name in names]
    strengths = tuple(strength_of(sample, name, scale) for name in names)
    gram = np.array([[product(a, b) for b in shifts] for a in shifts])
    size = np.sqrt(np.maximum(np.diag(gram), 1e-6))
    return Signatures(tuple(names), tuple(ruler), strengths, nearest_correlation(gram / np.outer(size, size)))


def ruler_of(sample: ReferencePours, replicates: int = REPLICATES) -> Ruler:
    """The ruler for data sets of ``replicates`` pours per condition; arguments as in :func:`metric_of`."""
    return Ruler(metric_of(sample, replicates), tuple(metric_of(_without(sample, f), replicates) for f in range(FOLDS)))


def metric_of(sample: ReferencePours, replicates: int = REPLICATES) -> Metric:
    """The metric for data sets of ``replicates`` pours per condition.

    Parameters
    ----------
    sample
        Reference pours; needs "base" and "<parameter> -", "<parameter> +" of every parameter.
    replicates
        n, number of pours in each condition.

    Returns
    -------
    The metric, with calibrated parameters profiled out.

    Raises
    ------
    StatisticsError
        If a condition has fewer than three pours of the base model.
    """
    for c, base in enumerate(sample.pours["base"]):
        if len(base) < 3:
            raise StatisticsError(f"base model: {len(base)} pours in condition {c + 1}; allowed: at least 3")
    varying = np.concatenate(sample.vary())
    sample = sample.varying()
    sensitivity = np.column_stack(
        [_slope(sample, name) for name in sample.parameters] or [np.zeros((_size(sample), 0))]
    )
    blocks = [shrunk_covariance(_residuals(sample, c)) for c in range(len(sample.pours["base"]))]
    covariance = block_diag(*blocks) / replicates + sensitivity @ sensitivity.T
    # In units of each feature's standard error, because these span ten orders of magnitude.
    scale = np.sqrt(np.diag(covariance))
    factor = np.linalg.cholesky(covariance / np.outer(scale, scale))
    whitening = np.zeros((len(scale), len(varying)))
    whitening[:, varying] = np.linalg.inv(factor) / scale
    return Metric(whitening)


def strength_of(sample: ReferencePours, name: str, ruler: Ruler) -> Strength:
    """Length of the shift by ``name`` with its standard error; zero if the estimate of its square is negative."""
    shifts = fold_shifts(sample, name)
    white = ruler.metric.white(shifts)
    square = product(white, white)
    value = float(np.sqrt(max(0.0, square)))
    by_shift = _jackknife([product(one, one) for one in (np.delete(white, f, axis=0) for f in range(len(white)))])
    by_metric = _jackknife([product(one, one) for one in (metric.white(shifts) for metric in ruler.without)])
    spread = float(np.hypot(by_shift, by_metric))
    # ``spread`` is the error of the square. That of its root is by the delta method, near zero the root of ``spread``.
    return Strength(value, spread / (2.0 * value) if square > spread else float(np.sqrt(spread)))


def fold_shifts(sample: ReferencePours, name: str, folds: int = FOLDS) -> FloatArray:
    """Shifts (folds, D) of ``name`` from the base model in each fold, in the units of the features.

    Raises StatisticsError if a fold would be empty.
    """
    least = min(len(block) for kind in (name, "base") for block in sample.pours[kind])
    if least < folds:
        raise StatisticsError(f"{name}: {least} valid pours in a condition; allowed: at least {folds}")
    parts = []
    for there, base in zip(sample.pours[name], sample.pours["base"], strict=True):
        parts.append(_fold_means(there, folds) - _fold_means(base, folds))
    return np.concatenate(parts, axis=1)


def product(first: FloatArray, second: FloatArray) -> float:
    """Crossnobis product of two sets of fold shifts, (folds, D) each: no fold is multiplied by itself."""
    folds = len(first)
    whole = float(first.sum(axis=0) @ second.sum(axis=0))
    return (whole - float((first * second).sum())) / (folds * (folds - 1))


def confused(cosine: float, strength: float) -> float:
    """Probability of mistaking one of two effects for the other by chance: Φ(−s √((1 − c)/2))."""
    return float(norm.cdf(-strength * np.sqrt(max(0.0, 1.0 - cosine) / 2.0)))


def alike(found: Sequence[Signatures]) -> list[tuple[str, str]]:
    """Pairs whose cosine is above ``CLASS`` in all of ``found`` (one per set-up): no set-up tells them apart."""
    names = found[0].names
    return [
        (names[i], names[j])
        for i in range(len(names))
        for j in range(i)
        if all(abs(one.cosines[i, j]) > CLASS for one in found)
    ]


def nearest_correlation(cosines: FloatArray) -> FloatArray:
    """A matrix of cosines near the estimated one, without negative eigenvalues and with a unit diagonal."""
    symmetric = np.clip(0.5 * (cosines + cosines.T), -1.0, 1.0)
    np.fill_diagonal(symmetric, 1.0)
    for _ in range(20):
        values, vectors = np.linalg.eigh(symmetric)
        symmetric = (vectors * np.maximum(values, 0.0)) @ vectors.T
        size = np.sqrt(np.diag(symmetric))
        symmetric = symmetric / np.outer(size, size)
    return np.asarray(symmetric, dtype=np.float64)


def _residuals(sample: ReferencePours, condition: int) -> FloatArray:
    """Deviations of base pours, and of pours with a parameter moved, from the means of their kinds, (n, d)."""
    kinds = ["base", *(f"{name} {side}" for name in sample.parameters for side in "-+")]
    groups = [sample.pours[kind][condition] for kind in kinds]
    # Each group's mean takes a degree of freedom.
    return np.concatenate(
        [(group - group.mean(axis=0)) * np.sqrt(len(group) / (len(group) - 1)) for group in groups if len(group) > 1]
    )


def _slope(sample: ReferencePours, parameter: str) -> FloatArray:
    """Change (D,) of the features per standard deviation of the measurement of ``parameter``."""
    low, high = sample.pours[f"{parameter} -"], sample.pours[f"{parameter} +"]
    return np.concatenate([(b.mean(axis=0) - a.mean(axis=0)) / (2.0 * SIDE) for a, b in zip(low, high, strict=True)])


def _without(sample: ReferencePours, fold: int) -> ReferencePours:
    """The reference pours that are not in ``fold``."""
    pours = {
        name: tuple(np.delete(block, np.s_[fold::FOLDS], axis=0) for block in blocks)
        for name, blocks in sample.pours.items()
    }
    return ReferencePours(pours, sample.parameters)


def _jackknife(values: Sequence[float]) -> float:
    """Jackknife standard error of an estimate, from its ``values`` without each of the folds."""
    return float(np.std(values) * np.sqrt(len(values) - 1))


def _fold_means(pours: FloatArray, folds: int) -> FloatArray:
    """Means (folds, d) over folds that each take every ``folds``-th pour."""
    return np.stack([pours[f::folds].mean(axis=0) for f in range(folds)])


def _size(sample: ReferencePours) -> int:
    return sum(block.shape[1] for block in sample.pours["base"])


def _most_alike(data: str, kinds: Sequence[DataKind], found: Signatures) -> list[Confusable]:
    """Pairs of clear signatures of different effects, the most alike first."""
    clear = [k for k, one in enumerate(found.ruler) if one.value > 2.0 * one.error]
    pairs = [
        Confusable(data, kinds[i].name, kinds[j].name, float(found.cosines[i, j]))
        for i in clear
        for j in clear
        if j < i and kinds[i].effect != kinds[j].effect
    ]
    return sorted(pairs, key=lambda pair: -abs(pair.cosine))


def _posteriors(
    t: FloatArray,
    gain: FloatArray,
    two_sided: Sequence[bool],
    share: FloatArray,
    effects: Sequence[str],
    groups: Sequence[str],
) -> FloatArray:
    """Posterior probabilities (sets, 1 + groups) of nothing and of each effect, given ``t`` (sets, k)."""
    b = np.geomspace(LEAST, MOST, NODES)[:, None] * gain  # log-uniform, so all nodes have equal weight
    logs = []
    for k, both in enumerate(two_sided):
        exponents = b[:, k, None] * t[:, k] - 0.5 * b[:, k, None] ** 2
        if both:
            mirrored = -b[:, k, None] * t[:, k] - 0.5 * b[:, k, None] ** 2
            exponents = np.concatenate([exponents, mirrored])
        logs.append(logsumexp(exponents, axis=0) - np.log(len(exponents)) + np.log(share[k]))
    prior = np.log((1.0 - NOTHING) / len(groups))
    columns = [np.full(len(t), np.log(NOTHING))]
    for name in groups:
        members = [log for log, effect in zip(logs, effects, strict=True) if effect == name]
        columns.append(logsumexp(members, axis=0) + prior)
    stacked = np.stack(columns, axis=1)
    return np.asarray(np.exp(stacked - logsumexp(stacked, axis=1, keepdims=True)))
