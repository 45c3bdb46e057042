"""The truth of a made-up laboratory: parameters within their measured uncertainty, and the effects the model lacks.

A truth is drawn from random numbers seeded by the root and number of its data set. A campaign consists of rounds of the
same cases, each round shuffled. Strengths are on the ruler (``limit.py``), measured once by many reference pours of the
model at an amplitude a₁ and at half of it; between and beyond these two s = s₁ (a/a₁)^p, with p from both.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from doe.declared.model import Declared
from doe.validation.limit import Reached

Kind = Literal["null", "effect", "pair", "outside"]

STRENGTHS = (6.0, 10.0)
"""Strengths of single effects [σ]."""
WIDE_STRENGTHS = (4.0, 6.0, 8.0, 10.0, 15.0, 25.0, 40.0)
"""Strengths of single effects in a development campaign [σ], so that its rule meets every strength."""
PAIR_STRENGTHS = (6.0, 10.0)
"""Range of the strength of each effect of a pair [σ]."""
ROUND = {"null": 15, "effect": 12, "pair": 4, "outside": 6}
"""Data sets of each kind in a round; a test has ten rounds: 150, 60 of each strength, 40 and 60."""
REPLICATES = 6
ROOT = 1
"""Root of the seeds of the laboratories' pours; the root of the diagnosis's pours is 0."""
DISTINCT = 0.9
"""Largest cosine of the signatures of two effects that form a pair: no data distinguish two that look alike."""
POWERS = (0.7, 2.0)
"""Range to which p is clipped: computed from two strengths with errors it may take any value."""
SEEN = 2.0
"""Standard errors by which a strength must exceed zero; otherwise the amplitude of a strength is unknown."""


@dataclass(frozen=True)
class Case:
    """Data set ``number`` of the campaign of ``root``.

    ``label``: the outside effect, or "" for a library effect that is drawn with the truth. ``strength``: [σ], NaN if
    none is asked for.
    """

    root: int
    number: int
    kind: Kind
    label: str = ""
    strength: float = float("nan")

    @property
    def seed(self) -> tuple[int, int]:
        """Seed of all its random numbers."""
        return self.root, self.number


@dataclass(frozen=True)
class Truth:
    """The truth of ``case``: ``theta`` and the amplitudes of ``effects`` in natural units.

    ``missing``: why there is no such truth (``effects`` is then empty), else "".
    """

    case: Case
    theta: tuple[float, ...]
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()
    missing: str = ""


@dataclass(frozen=True)
class Strengths:
    """Converts strengths to amplitudes.

    ``reached``: the measured directions of each effect. ``declared``: the ranges of amplitudes. ``alike``: cosines of
    the signatures of two effects in the scalars, by their names.
    """

    reached: Mapping[str, tuple[Reached, ...]]
    declared: Declared
    alike: Mapping[frozenset[str], float]

    def amplitude(self, effect: str, strength: float, rng: np.random.Generator) -> tuple[float, ...] | None:
        """Amplitude [natural units] of ``strength`` σ in a random direction; None beyond the literature's range."""
        ranges = next(one for one in self.declared.effects if one.name == effect)
        found = self.reached[effect]
        for k in rng.permutation(len(found)):
            one = found[k]
            if one.ruler.value <= SEEN * one.ruler.error:
                continue
            share = (strength / one.ruler.value) ** (1.0 / self._power(effect, one))
            size = share * float(np.linalg.norm(one.amplitude))
            amplitude: tuple[float, ...]
            if len(one.amplitude) == 2:
                # By symmetry all directions are equally strong.
                towards = rng.uniform(0.0, 2.0 * math.pi)
                amplitude = (size * math.cos(towards), size * math.sin(towards))
                limit = min(*ranges.high, *(-end for end in ranges.low))
            else:
                amplitude = (math.copysign(size, one.amplitude[0]),)
                limit = ranges.high[0] if one.amplitude[0] > 0.0 else -ranges.low[0]
            if size <= limit:
                return amplitude
        return None

    def _power(self, effect: str, one: Reached) -> float:
        for measured in (one, *self.reached[effect]):
            strong, weak = measured.ruler, measured.weak
            if weak is not None and weak.value > 0.0 and strong.value > SEEN * strong.error:
                return float(np.clip(math.log2(strong.value / weak.value), *POWERS))
        return 1.0


def cases(root: int, number: int, outside: Sequence[str], wide: bool = False) -> Iterator[Case]:
    """The first ``number`` cases of a campaign, or, if ``wide``, of a development campaign."""
    drawn = 0
    strengths = WIDE_STRENGTHS if wide else STRENGTHS
    while drawn < number:
        rng = np.random.default_rng([root, drawn])
        one: list[tuple[Kind, str, float]] = [("null", "", float("nan"))] * ROUND["null"]
        # Strengths take turns, continuing over the rounds.
        first = drawn // sum(ROUND.values()) * ROUND["effect"]
        one += [("effect", "", strengths[(first + k) % len(strengths)]) for k in range(ROUND["effect"])]
        one += [("pair", "", float(rng.uniform(*PAIR_STRENGTHS))) for _ in range(ROUND["pair"])]
        begun = drawn // sum(ROUND.values()) * ROUND["outside"]
        one += [("outside", outside[(begun + k) % len(outside)], float("nan")) for k in range(ROUND["outside"])]
        for k in rng.permutation(len(one))[: number - drawn]:
            kind, label, strength = one[k]
            yield Case(root, drawn, kind, label, strength)
            drawn += 1


def truth_of(case: Case, strengths: Strengths) -> Truth:
    """The truth of a case; with ``missing`` set if no effect's range reaches the strength."""
    rng = np.random.default_rng([ROOT, *case.seed])
    theta = drawn_theta(strengths.declared, rng)
    if case.kind in ("null", "outside"):
        return Truth(case, theta)
    wanted = 2 if case.kind == "pair" else 1
    found: list[tuple[str, tuple[float, ...]]] = []
    names = [case.label] if case.label else [effect.name for effect in strengths.declared.effects]
    for k in rng.permutation(len(names)):
        amplitude = strengths.amplitude(names[k], case.strength, rng)
        known = [frozenset((names[k], name)) for name, _ in found]
        if amplitude is not None and all(strengths.alike.get(pair, 0.0) <= DISTINCT for pair in known):
            found.append((names[k], amplitude))
        if len(found) == wanted:
            return Truth(case, theta, tuple(found))
    return Truth(case, theta, missing="bounds")


def drawn_theta(declared: Declared, rng: np.random.Generator) -> tuple[float, ...]:
    """Parameters drawn from their independent measurements or uniformly over their ranges, clipped to the ranges."""
    return tuple(
        rng.uniform(p.low, p.high) if p.mean is None or p.sd is None else p.within(float(rng.normal(p.mean, p.sd)))
        for p in declared.parameters
    )


def strengths_of(reached: Sequence[Reached], declared: Declared, cosines: Mapping[frozenset[str], float]) -> Strengths:
    """The strengths measured by the reference pours, for the declared effects."""
    names = {effect.name for effect in declared.effects}
    by_effect: dict[str, tuple[Reached, ...]] = {}
    for one in reached:
        if one.kind.effect in names:
            by_effect[one.kind.effect] = (*by_effect.get(one.kind.effect, ()), one)
    kept = tuple(effect for effect in declared.effects if effect.name in by_effect)
    return Strengths(by_effect, Declared(declared.parameters, kept, declared.conditions), cosines)
