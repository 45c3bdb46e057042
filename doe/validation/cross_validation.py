"""The rule of the diagnosis, cross-validated on reference pours: how often it names the right effect, beside the limit.

In every split some pours teach the models, and others, disjoint from them, are data: six of an effect at its reference
amplitude or at half of it, or six of the base model. Nothing is poured, so a rule can be tested in seconds. Each effect
is first taught by pours at its reference amplitude. Effects that the posterior leaves in question may be taught by more
pours, at whichever of the two amplitudes is nearer to the best fit, and are judged again, ``LOOKS`` times at most.
(Teaching pours and data both have the parameters at their means and come from one solver.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulator import Emulator, Lessons, Way, emulated
from doe.diagnose.posterior import Data, Posterior, posterior
from doe.diagnose.training_amplitudes import REPLICATES
from doe.record import Record
from doe.validation.limit import RISKS, DataKind
from doe.validation.reference import SIDE, Blocks, ReferencePours

FloatArray = npt.NDArray[np.float64]

BASE_POURS = 24
"""Teaching pours of the base model."""
NULLS = 4
"""Data sets of the base model in each split."""
IN_QUESTION = 0.01
"""Probability above which an effect is in question."""
BEHIND = 4.0
"""Log density by which a direction may fall short of its effect's best direction and still be in question."""
LOOKS = 2
"""Times that effects in question are taught by more pours, at most."""
LEVELS = {"strong": 1.0, "weak": 0.5}
"""Amplitudes of reference pours, in units of the reference amplitude."""


@dataclass(frozen=True)
class Teaching(Record):
    """Teaching pours per condition of every direction of an effect, and extra ones of each direction in question."""

    all: int
    more: int

    def most(self, level: str) -> int:
        """Largest number of pours of ``level`` that may teach."""
        return self.more + (self.all if level == "strong" else 0)


@dataclass(frozen=True)
class PlantedTruth(Record):
    """What acts in a data set: a direction at one of ``LEVELS``, and its ``strength`` on the ruler [σ]."""

    kind: DataKind
    level: str
    strength: float


@dataclass(frozen=True)
class CrossValidation(Record):
    """Answers of the rule to data with an effect, in one range of strengths.

    Attributes
    ----------
    data, teaching
        Kind of data, and teaching pours.
    strength
        Mean strength of the data sets on the ruler [σ].
    sets, nulls
        Numbers of data sets with and without an effect.
    pours
        Extra pours of effects in question, in each condition; mean over the sets.
    right
        Share of the sets in which the most probable effect is the right one.
    named
        Share named rightly when at most each of ``RISKS`` of the sets gets a wrong name.
    thresholds
        Lowest probability at which an effect is named, for each risk; above one if none may be named.
    false
        Number of sets without an effect in which one is named, at the threshold of each risk.
    by_effect
        For each effect, share of its sets in which the most probable effect is the right one.
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


def cross_validated(
    data: str,
    sample: ReferencePours,
    kinds: Sequence[DataKind],
    bands: Sequence[Sequence[PlantedTruth]],
    teaching: Teaching,
    splits: int,
    rng: np.random.Generator,
) -> list[CrossValidation]:
    """Apply the rule to ``splits`` random splits of ``sample``.

    Parameters
    ----------
    data
        Kind of data: name of the features of ``sample``.
    sample
        Reference pours; of "base" at least ``BASE_POURS`` + 6 x ``NULLS``, of every truth enough to teach and to be
        data.
    kinds
        The directions that are taught.
    bands
        Truths of the data sets, by range of strengths; all bands share the data sets without an effect.
    teaching
        Numbers of teaching pours.
    splits, rng
        Number of splits, and the generator that draws them.

    Returns
    -------
    The result of each band.
    """
    ways = tuple(Way(kind.effect, kind.name) for kind in kinds)
    answers: list[list[_Answer]] = [[] for _ in bands]
    nothing: list[_Answer] = []
    for _ in range(splits):
        mixed = {
            kind: tuple(block[rng.permutation(len(block))] for block in blocks) for kind, blocks in sample.pours.items()
        }
        # Features that are constant in the teaching pours cannot be weighed.
        keep = ReferencePours({"base": _first(mixed["base"], BASE_POURS)}, ()).vary()
        split = _Split(ReferencePours(mixed, sample.parameters).only(keep), ways, teaching)
        for own, truths in zip(answers, bands, strict=True):
            own += [_Answer(one.kind.effect, *split.judged(split.data_of(one))) for one in truths]
        for number in range(NULLS):
            first = BASE_POURS + number * REPLICATES
            pours = tuple(block[first : first + REPLICATES] for block in split.pours["base"])
            nothing.append(_Answer("", *split.judged(pours)))
    return [
        _rates(data, teaching, float(np.mean([one.strength for one in truths])), own, nothing)
        for own, truths in zip(answers, bands, strict=True)
    ]


class _Split:
    """One split: the first reference pours of each kind may teach, and data are taken from those after them."""

    def __init__(self, sample: ReferencePours, ways: tuple[Way, ...], teaching: Teaching) -> None:
        self.pours = sample.pours
        self._ways, self._teaching = ways, teaching
        k = len(sample.parameters)
        self._base = [_lesson(_first(self.pours["base"], BASE_POURS), np.zeros(k))]
        for j, name in enumerate(sample.parameters):
            for side, sign in (("-", -1.0), ("+", 1.0)):
                self._base.append(_lesson(self.pours[f"{name} {side}"], sign * SIDE * np.eye(k)[j]))
        self._first = self._taught({(way, "strong"): teaching.all for way in range(len(ways))})

    def data_of(self, truth: PlantedTruth) -> Blocks:
        """A data set of ``truth``, from pours that teach no model."""
        first = self._teaching.most(truth.level)
        return tuple(block[first : first + REPLICATES] for block in self.pours[f"{truth.kind.name} {truth.level}"])

    def judged(self, data: Blocks) -> tuple[Posterior, int]:
        """The posterior after all looks, and the number of extra pours that were asked for."""
        counts = {(way, "strong"): self._teaching.all for way in range(len(self._ways))}
        emulator, asked = self._first, 0
        found = posterior(emulator, Data(emulator.seen(data), REPLICATES), pairs=False)
        for _ in range(LOOKS if self._teaching.more else 0):
            wanted = {place: self._teaching.most(place[1]) for place in self._in_question(found)}
            new = {place: number for place, number in wanted.items() if counts.get(place, 0) < number}
            if not new:
                break
            asked += sum(number - counts.get(place, 0) for place, number in new.items())
            counts |= new
            emulator = self._taught(counts)
            found = posterior(emulator, Data(emulator.seen(data), REPLICATES), pairs=False)
        return found, asked

    def _in_question(self, found: Posterior) -> list[tuple[int, str]]:
        """Directions in question, each with the level nearest to its best fit of which there are pours."""
        best: dict[str, float] = {}
        for level in found.levels:
            effect = self._ways[level.way].effect
            best[effect] = max(best.get(effect, -np.inf), level.log_density)
        places = []
        for level in found.levels:
            way = self._ways[level.way]
            if found.effects[way.effect] > IN_QUESTION and level.log_density > best[way.effect] - BEHIND:
                levels = [name for name in LEVELS if f"{way.name} {name}" in self.pours]
                places.append((level.way, min(levels, key=lambda name: abs(LEVELS[name] - level.amplitude))))
        return places

    def _taught(self, counts: Mapping[tuple[int, str], int]) -> Emulator:
        lessons, middle = [*self._base], np.zeros(self._base[0].theta.shape[1])
        for (way, level), number in counts.items():
            pours = _first(self.pours[f"{self._ways[way].name} {level}"], number)
            lessons.append(_lesson(pours, middle, way, LEVELS[level]))
        return emulated(joined(lessons), self._ways)


def joined(lessons: Sequence[Lessons]) -> Lessons:
    """All of ``lessons``, one after the other; no pour of one is a view of a pour of another."""
    first = np.cumsum([0, *(one.pour.max(initial=-1) + 1 for one in lessons)])
    return Lessons(
        np.concatenate([one.theta for one in lessons]),
        np.concatenate([one.way for one in lessons]),
        np.concatenate([one.amplitude for one in lessons]),
        np.concatenate([one.pour + start for one, start in zip(lessons, first, strict=False)]),
        tuple(np.concatenate(blocks) for blocks in zip(*(one.blocks for one in lessons), strict=True)),
    )


def _lesson(blocks: Blocks, theta: FloatArray, way: int = -1, amplitude: float = 0.0) -> Lessons:
    """Lessons from pours with parameters ``theta`` (k,), cut to the same number in every condition."""
    n = min(map(len, blocks))
    return Lessons(
        np.tile(theta, (n, 1)), np.full(n, way), np.full(n, amplitude), np.arange(n), tuple(b[:n] for b in blocks)
    )


def _first(blocks: Blocks, number: int) -> Blocks:
    return tuple(block[:number] for block in blocks)


def _rates(
    data: str, teaching: Teaching, strength: float, sets: Sequence[_Answer], nothing: Sequence[_Answer]
) -> CrossValidation:
    nulls = np.array([one.found.best[1] for one in nothing])
    p = np.array([one.found.best[1] for one in sets])
    correct = np.array([one.found.best[0] == one.truth for one in sets])
    order = np.argsort(-p)
    wrong, coverage = np.cumsum(~correct[order]) / len(sets), np.cumsum(correct[order]) / len(sets)
    last = np.searchsorted(wrong, RISKS, side="right") - 1
    thresholds = tuple(float(p[order[k]]) if k >= 0 else 2.0 for k in last)
    truths = np.array([one.truth for one in sets])
    return CrossValidation(
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
