"""How often the right effect can be named at all: the Bayes limit of data of a kind, whatever the method.

With signatures that are known exactly, the shift of a data set in whitened units is z = s u_e + N(0, I), where u_e is
the direction of the effect that acts and s its strength. All that z tells of the models is t_f = u_f·z, which is normal
with mean s C_fe and covariance C, the matrix of the signatures' cosines. The evidence for f against nothing is

    Z_f = ∫ exp(b t_f − b²/2) p(b) db,    p(b) ∝ 1/b on ``LEAST`` … ``MOST`` standard errors

and mirror images of an effect that has a direction share its prior. Whoever names the effect of the largest posterior,
if that is at least τ, names as often as can be at every risk of a wrong name: the risk–coverage curve. On average over
the prior no rule that uses the same numbers does better; one that seems to has been given more than the data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import logsumexp
from scipy.stats import norm

from doe.diagnose.levels import REPLICATES
from doe.diagnose.result import Level
from doe.record import Record
from doe.validation.reference import Sample
from doe.validation.ruler import Strength, fold_shifts, metric_of, product, strength_of

FloatArray = npt.NDArray[np.float64]

LEAST, MOST = 1.5, 20.0
"""Range of an amplitude's prior, in standard errors on the ruler (scalars, six pours)."""
NODES = 24
"""Amplitudes over which the evidence is summed."""
NOTHING = 0.5
"""Prior that nothing is missing; effects share the rest alike."""
RISKS = (0.003, 0.01, 0.03, 0.1)
"""Shares of wrong names among the sets of a strength at which a coverage is stated."""
RISK = 0.03
"""The one of them at which an effect's own share is stated."""
SETS = 4000
"""Made-up data sets of each effect and strength."""
STRENGTHS = (4.0, 6.0, 10.0)
"""Strengths [σ] for which limits are stated."""
CLASS = 0.95
"""Cosine of two signatures above which data cannot tell the effects apart."""


@dataclass(frozen=True)
class Kind(Record):
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
        Strength of each direction's stronger reference amplitude in the scalars at six pours, and in these features.
    cosines
        (k, k), of unit diagonal.
    """

    names: tuple[str, ...]
    ruler: tuple[Strength, ...]
    strength: tuple[Strength, ...]
    cosines: FloatArray


@dataclass(frozen=True)
class Reached(Record):
    """What one direction of an effect does at its reference amplitude.

    Attributes
    ----------
    kind
        The direction.
    amplitude
        Natural units.
    ruler, weak
        Strength on the ruler at that amplitude and, of an effect's first direction, at half of it.
    strength
        Strength by kind of data, six pours.
    """

    kind: Kind
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
class Row(Record):
    """The limit for one kind of data, so many pours in each condition, and one strength."""

    data: str
    replicates: int
    limit: Limit


@dataclass(frozen=True)
class LimitStudy(Record):
    """What data of each kind can tell of the effects of a declared model, at best.

    Attributes
    ----------
    pours
        Reference pours that count, by what acts, summed over the conditions.
    reached
        Directions of effects, with their strengths.
    confusable
        All pairs, by kind of data and the most alike first.
    rows
        Limits.
    """

    pours: Mapping[str, int]
    reached: tuple[Reached, ...]
    confusable: tuple[Confusable, ...]
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Limit(Record):
    """What can be reached for the effects of one strength.

    Attributes
    ----------
    strength
        On the ruler [σ].
    right
        Share of sets in which the most probable effect is the right one, given that one acts.
    named
        The risk–coverage curve: share that is named rightly where at most each of ``RISKS`` gets a wrong name.
    threshold
        Posterior probability at which ``RISK`` is kept.
    by_effect
        Share of each effect that is named rightly at that threshold.
    """

    strength: float
    right: float
    named: tuple[float, ...]
    threshold: float
    by_effect: Mapping[str, float]


def signatures_of(sample: Sample, names: Sequence[str], ruler: Sequence[Strength], replicates: int) -> Signatures:
    """Strengths and cosines of the reference amplitudes ``names`` in the features of ``sample``.

    ``ruler``: their strengths on the ruler. ``replicates``: pours of a data set in each condition.
    """
    metric = metric_of(sample, replicates)
    shifts = [fold_shifts(sample, name, metric) for name in names]
    strengths = tuple(strength_of(sample, name, metric) for name in names)
    gram = np.array([[product(a, b) for b in shifts] for a in shifts])
    size = np.sqrt(np.maximum(np.diag(gram), 1e-6))
    return Signatures(tuple(names), tuple(ruler), strengths, nearest_correlation(gram / np.outer(size, size)))


def limit_study(
    sample: Sample, levels: Sequence[Level], offered: Mapping[str, Sequence[int]], seed: int = 0
) -> LimitStudy:
    """The limit of every kind of data.

    Parameters
    ----------
    sample
        Reference pours with all features of every condition, the scalars first.
    levels
        The directions of effects that were poured, at their reference amplitudes.
    offered
        Kind of data → how many of the first features of each condition it gives; the first kind is the ruler's.
    seed
        Of the made-up data sets.

    Returns
    -------
    Strengths, the pairs that are most alike, and for each kind of data what can be named at each of ``STRENGTHS``,
    with the data's pours and with as many again.
    """
    kinds = [Kind(one.direction.effect, one.direction.name, len(one.direction.full) == 2) for one in levels]
    names = [f"{one.name} strong" for one in kinds]
    samples = {data: sample.first(numbers).varying() for data, numbers in offered.items()}
    scalars = next(iter(samples.values()))
    metric = metric_of(scalars)
    ruler = [strength_of(scalars, name, metric) for name in names]
    halves = [f"{one.name} weak" for one in kinds]
    weak = [strength_of(scalars, half, metric) if half in sample.pours else None for half in halves]
    by_data: dict[str, tuple[Strength, ...]] = {}
    confusable, rows = [], []
    for data, one in samples.items():
        for replicates in (REPLICATES, 2 * REPLICATES):
            found = signatures_of(one, names, ruler, replicates)
            if replicates == REPLICATES:
                by_data[data] = found.strength
                confusable += _most_alike(data, kinds, found)
            rng = np.random.default_rng(seed)
            rows += [Row(data, replicates, limit_of(found, kinds, strength, rng)) for strength in STRENGTHS]
    reached = tuple(
        Reached(kind, level.direction.at(level.share), ruler[k], weak[k], {d: by_data[d][k] for d in by_data})
        for k, (kind, level) in enumerate(zip(kinds, levels, strict=True))
    )
    pours = {name: sum(map(len, blocks)) for name, blocks in sample.pours.items()}
    return LimitStudy(pours, reached, tuple(confusable), tuple(rows))


def _most_alike(data: str, kinds: Sequence[Kind], found: Signatures) -> list[Confusable]:
    """Pairs of clear signatures of different effects, the most alike first."""
    clear = [k for k, one in enumerate(found.ruler) if one.value > 2.0 * one.error]
    pairs = [
        Confusable(data, kinds[i].name, kinds[j].name, float(found.cosines[i, j]))
        for i in clear
        for j in clear
        if j < i and kinds[i].effect != kinds[j].effect
    ]
    return sorted(pairs, key=lambda pair: -abs(pair.cosine))


def nearest_correlation(cosines: FloatArray) -> FloatArray:
    """A matrix of cosines without negative eigenvalues and with a unit diagonal, next to an estimated one."""
    symmetric = np.clip(0.5 * (cosines + cosines.T), -1.0, 1.0)
    np.fill_diagonal(symmetric, 1.0)
    for _ in range(20):
        values, vectors = np.linalg.eigh(symmetric)
        symmetric = (vectors * np.maximum(values, 0.0)) @ vectors.T
        size = np.sqrt(np.diag(symmetric))
        symmetric = symmetric / np.outer(size, size)
    return np.asarray(symmetric, dtype=np.float64)


def limit_of(
    found: Signatures, kinds: Sequence[Kind], strength: float, rng: np.random.Generator, sets: int = SETS
) -> Limit:
    """The limit for effects that are ``strength`` σ strong on the ruler.

    ``kinds``: what each of ``found.names`` is; only those whose strengths are known to be above zero take part.
    """
    # How much stronger than on the ruler an effect is in these features.
    gain = np.array(
        [s.value / r.value if r.value > 0.0 else 0.0 for s, r in zip(found.strength, found.ruler, strict=True)]
    )
    seen = [k for k, one in enumerate(found.ruler) if one.value > 2.0 * one.error and gain[k] > 0.0]
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
    # The last set that may still be named, at each risk.
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


def _posteriors(
    t: FloatArray,
    gain: FloatArray,
    two_sided: Sequence[bool],
    share: FloatArray,
    effects: Sequence[str],
    groups: Sequence[str],
) -> FloatArray:
    """Posterior of nothing and of each effect, (sets, 1 + groups); ``t`` (sets, k)."""
    b = np.geomspace(LEAST, MOST, NODES)[:, None] * gain  # log-uniform, so nodes weigh alike
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


def confused(cosine: float, strength: float) -> float:
    """Probability of taking one of two effects for the other by chance: Φ(−s √((1 − c)/2))."""
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
