"""The rule of the diagnosis played on reference pours: how often it names the right effect, beside the Bayes limit.

In every split some pours teach the models and others, disjoint from them, are data: six of an effect at its reference
amplitude or at half of it, or six of the base model. Nothing is poured, so a rule can be tried in seconds. Each effect
is taught by some pours at its reference amplitude. Those that the posterior then leaves in question may be taught by
more, at the one of the two amplitudes that is nearer to their best fit, and are judged again, ``LOOKS`` times at most.
(The models are taught with the parameters at their means, and so are the data; both come from one solver.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.limit import RISKS, Kind
from doe.diagnose.posterior import Posterior, posterior
from doe.diagnose.reference import Blocks, Sample
from doe.diagnose.ruler import REPLICATES
from doe.diagnose.shared_emulator import Emulator, Group, Way, emulated
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

BASE_POURS = 24
"""Pours of the base model that teach."""
NULLS = 4
"""Data sets of the base model in a split."""
IN_QUESTION = 0.01
"""Probability of an effect from which on it is in question."""
BEHIND = 4.0
"""Log evidence by which a direction may be behind the best one of its effect and be in question with it."""
LOOKS = 2
"""Times that what is in question is taught by more pours."""
LEVELS = {"strong": 1.0, "weak": 0.5}
"""Amplitudes of reference pours, in units of the reference amplitude."""


@dataclass(frozen=True)
class Teaching(Record):
    """Pours of every direction of an effect in each condition, and more of each that is in question after a look."""

    all: int
    more: int


@dataclass(frozen=True)
class Truth(Record):
    """What acts in data: a direction at one of ``LEVELS``, so strong [σ] on the ruler."""

    kind: Kind
    level: str
    strength: float


@dataclass(frozen=True)
class Replayed(Record):
    """What the rule answers to data with an effect of a range of strengths.

    Attributes
    ----------
    data, teaching
        Kind of data, and what teaches.
    strength
        Mean of the data sets' on the ruler [σ].
    sets, nulls
        Data sets with an effect and without.
    pours
        More pours of effects in question, in each condition; mean over the sets.
    right
        Share of the sets in which the most probable effect is the right one.
    named
        Share named rightly where at most each of ``RISKS`` of the sets gets a wrong name.
    thresholds
        Probability from which on one names at each risk; above one where none may be named.
    false
        Sets without an effect in which one is named at the threshold of each risk.
    by_effect
        Share of each effect whose most probable name is right.
    """

    data: str
    teaching: Teaching
    strength: float
    sets: int
    nulls: int
    pours: float
    right: float
    named: tuple[float, ...]
    thresholds: tuple[float, ...]
    false: tuple[int, ...]
    by_effect: Mapping[str, float]


@dataclass(frozen=True)
class _Answer:
    truth: str
    found: Posterior
    pours: int


def replay(
    data: str,
    sample: Sample,
    kinds: Sequence[Kind],
    truths: Sequence[Truth],
    teaching: Teaching,
    splits: int,
    rng: np.random.Generator,
) -> Replayed:
    """Play the rule on ``splits`` splits of ``sample``.

    Parameters
    ----------
    data
        What the features of ``sample`` are called.
    sample
        Reference pours; of "base" at least ``BASE_POURS`` + 6 x ``NULLS``, of what is data enough for both.
    kinds
        The directions that teach.
    truths
        What is data.
    teaching
        Pours that teach.
    splits, rng
        How often, and the random numbers of the splits.

    Returns
    -------
    What came out.
    """
    ways = tuple(Way(kind.effect, kind.name, kind.two_sided) for kind in kinds)
    answers: list[_Answer] = []
    for _ in range(splits):
        mixed = {
            kind: tuple(block[rng.permutation(len(block))] for block in blocks) for kind, blocks in sample.pours.items()
        }
        # What never varies in the pours that teach cannot be weighed.
        keep = Sample({"base": _first(mixed["base"], BASE_POURS)}, ()).vary()
        split = _Split(Sample(mixed, sample.parameters).only(keep), ways, teaching)
        answers += [_Answer(one.kind.effect, *split.judged(split.data_of(one))) for one in truths]
        for number in range(NULLS):
            first = BASE_POURS + number * REPLICATES
            nothing = tuple(block[first : first + REPLICATES] for block in split.pours["base"])
            answers.append(_Answer("", *split.judged(nothing)))
    return _replayed(data, teaching, float(np.mean([one.strength for one in truths])), answers)


class _Split:
    """Reference pours of which the first ones of each kind teach; data are taken behind those that might."""

    def __init__(self, sample: Sample, ways: tuple[Way, ...], teaching: Teaching) -> None:
        self.pours = sample.pours
        self._ways, self._teaching = ways, teaching
        self._moved = [(self.pours[f"{name} -"], self.pours[f"{name} +"]) for name in sample.parameters]
        self._first = self._taught({(way, "strong"): teaching.all for way in range(len(ways))})

    def data_of(self, truth: Truth) -> Blocks:
        """A data set that no model has been taught by."""
        first = self._most(truth.level)
        return tuple(block[first : first + REPLICATES] for block in self.pours[f"{truth.kind.name} {truth.level}"])

    def judged(self, data: Blocks) -> tuple[Posterior, int]:
        """The posterior after all looks, and the pours that were asked for on the way."""
        counts = {(way, "strong"): self._teaching.all for way in range(len(self._ways))}
        emulator, asked = self._first, 0
        found = posterior(emulator, emulator.seen(data), REPLICATES)
        for _ in range(LOOKS if self._teaching.more else 0):
            wanted = {place: self._most(place[1]) for place in self._in_question(found)}
            new = {place: number for place, number in wanted.items() if counts.get(place, 0) < number}
            if not new:
                break
            asked += sum(number - counts.get(place, 0) for place, number in new.items())
            counts |= new
            emulator = self._taught(counts)
            found = posterior(emulator, emulator.seen(data), REPLICATES)
        return found, asked

    def _in_question(self, found: Posterior) -> list[tuple[int, str]]:
        """Directions, with the level nearer to their best fit of which there are pours."""
        best: dict[str, float] = {}
        for way in self._ways:
            best[way.effect] = max(best.get(way.effect, -np.inf), found.fits[way.name].log_evidence)
        places = []
        for number, way in enumerate(self._ways):
            fit = found.fits[way.name]
            if found.effects[way.effect] > IN_QUESTION and fit.log_evidence > best[way.effect] - BEHIND:
                levels = [level for level in LEVELS if f"{way.name} {level}" in self.pours]
                places.append((number, min(levels, key=lambda level: abs(LEVELS[level] - fit.amplitude))))
        return places

    def _most(self, level: str) -> int:
        """Pours of ``level`` that may teach."""
        return self._teaching.more + (self._teaching.all if level == "strong" else 0)

    def _taught(self, counts: Mapping[tuple[int, str], int]) -> Emulator:
        groups = [
            Group(way, LEVELS[level], _first(self.pours[f"{self._ways[way].name} {level}"], number))
            for (way, level), number in counts.items()
        ]
        return emulated(_first(self.pours["base"], BASE_POURS), self._moved, self._ways, groups)


def _first(blocks: Blocks, number: int) -> Blocks:
    return tuple(block[:number] for block in blocks)


def _replayed(data: str, teaching: Teaching, strength: float, answers: Sequence[_Answer]) -> Replayed:
    sets = [one for one in answers if one.truth]
    nulls = np.array([one.found.best[1] for one in answers if not one.truth])
    p = np.array([one.found.best[1] for one in sets])
    correct = np.array([one.found.best[0] == one.truth for one in sets])
    order = np.argsort(-p)
    wrong, coverage = np.cumsum(~correct[order]) / len(sets), np.cumsum(correct[order]) / len(sets)
    last = np.searchsorted(wrong, RISKS, side="right") - 1
    thresholds = tuple(float(p[order[k]]) if k >= 0 else 2.0 for k in last)
    truths = np.array([one.truth for one in sets])
    return Replayed(
        data=data,
        teaching=teaching,
        strength=strength,
        sets=len(sets),
        nulls=len(nulls),
        pours=float(np.mean([one.pours for one in sets])),
        right=float(correct.mean()),
        named=tuple(float(coverage[k]) if k >= 0 else 0.0 for k in last),
        thresholds=thresholds,
        false=tuple(int((nulls >= threshold).sum()) for threshold in thresholds),
        by_effect={str(name): float(correct[truths == name].mean()) for name in np.unique(truths)},
    )
