"""The rule of the diagnosis played on reference pours: how often it names the right effect, beside the Bayes limit.

In every split some pours teach the models and others, disjoint from them, are data: six of an effect at half its
reference amplitude, or six of the base model. Nothing is poured, so a rule can be tried in seconds. (The models are
taught with the parameters at their means, and so are the data; both come from one solver.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.limit import RISKS, Kind
from doe.diagnose.posterior import Posterior, posterior, taught_by
from doe.diagnose.reference import Sample
from doe.diagnose.ruler import REPLICATES
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

BASE_POURS = 24
"""Pours of the base model that teach."""
NULLS = 4
"""Data sets of the base model in a split."""


@dataclass(frozen=True)
class Replayed(Record):
    """What the rule answers where ``taught`` pours of every effect teach it.

    Attributes
    ----------
    data, taught
        Kind of data, and pours of each effect in each condition.
    sets, nulls
        Data sets with an effect and without.
    right
        Share of the sets in which the most probable effect is the right one.
    named
        Share named rightly where at most each of ``RISKS`` of the sets gets a wrong name.
    false
        Sets without an effect in which one is named at the threshold of each risk.
    by_effect
        Share of each effect whose most probable name is right.
    """

    data: str
    taught: int
    sets: int
    nulls: int
    right: float
    named: tuple[float, ...]
    false: tuple[int, ...]
    by_effect: Mapping[str, float]


def replay(
    data: str,
    sample: Sample,
    kinds: Sequence[Kind],
    truths: Sequence[Kind],
    taught: int,
    splits: int,
    rng: np.random.Generator,
) -> Replayed:
    """Play the rule on ``splits`` splits of ``sample``.

    Parameters
    ----------
    data
        What the features of ``sample`` are called.
    sample
        Reference pours, at least ``BASE_POURS`` + 6 of "base" and ``taught`` of every "<direction> strong".
    kinds
        The directions that teach.
    truths
        Those of them whose "<direction> weak" pours are data.
    taught
        Pours of every direction that teach.
    splits, rng
        How often, and the random numbers of the splits.

    Returns
    -------
    What came out.
    """
    answers: list[tuple[str, Posterior]] = []
    directions = [(kind.effect, f"{kind.name} strong", kind.two_sided) for kind in kinds]
    for _ in range(splits):
        first, rest = _split(sample, taught, rng)
        # What never varies in the pours that teach cannot be weighed.
        keep = first.vary()
        models, rest = taught_by(first.only(keep), directions), rest.only(keep)
        for kind in truths:
            answers.append((kind.effect, posterior(models, _data(rest.pours[f"{kind.name} weak"], rng), REPLICATES)))
        for _ in range(NULLS):
            answers.append(("", posterior(models, _data(rest.pours["base"], rng), REPLICATES)))
    return _replayed(data, taught, answers)


def _split(sample: Sample, taught: int, rng: np.random.Generator) -> tuple[Sample, Sample]:
    """Pours that teach, and the others; all of those with a parameter moved teach."""
    first: dict[str, tuple[FloatArray, ...]] = {}
    rest: dict[str, tuple[FloatArray, ...]] = {}
    for kind, blocks in sample.pours.items():
        moved = kind.removesuffix(" -").removesuffix(" +") in sample.parameters
        number = BASE_POURS if kind == "base" else taught if kind.endswith("strong") else 0
        shuffled = [block[rng.permutation(len(block))] for block in blocks]
        first[kind] = tuple(block if moved else block[:number] for block in shuffled)
        rest[kind] = tuple(block if moved else block[number:] for block in shuffled)
    return Sample(first, sample.parameters), Sample(rest, sample.parameters)


def _data(blocks: Sequence[FloatArray], rng: np.random.Generator) -> FloatArray:
    """Means of the features of a data set drawn from pours."""
    return np.concatenate([block[rng.permutation(len(block))[:REPLICATES]].mean(axis=0) for block in blocks])


def _replayed(data: str, taught: int, answers: Sequence[tuple[str, Posterior]]) -> Replayed:
    sets = [(truth, *found.best) for truth, found in answers if truth]
    nulls = np.array([found.best[1] for truth, found in answers if not truth])
    p = np.array([one[2] for one in sets])
    correct = np.array([one[0] == one[1] for one in sets])
    order = np.argsort(-p)
    wrong, coverage = np.cumsum(~correct[order]) / len(sets), np.cumsum(correct[order]) / len(sets)
    last = np.searchsorted(wrong, RISKS, side="right") - 1
    thresholds = [p[order[k]] if k >= 0 else np.inf for k in last]
    names = sorted({one[0] for one in sets})
    return Replayed(
        data,
        taught,
        len(sets),
        len(nulls),
        float(correct.mean()),
        tuple(float(coverage[k]) if k >= 0 else 0.0 for k in last),
        tuple(int((nulls >= threshold).sum()) for threshold in thresholds),
        {name: float(np.mean([one[0] == one[1] for one in sets if one[0] == name])) for name in names},
    )
