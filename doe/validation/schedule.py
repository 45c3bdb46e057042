"""Which truths a campaign asks for, by root and number of the data set: rounds of the same cases, each shuffled."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Kind = Literal["null", "effect", "pair", "outside"]

STRENGTHS = (6.0, 10.0)
"""[σ] of single effects."""
WIDE_STRENGTHS = (4.0, 6.0, 8.0, 10.0, 15.0, 25.0, 40.0)
"""[σ] of those of a development campaign, so that its rule has met whatever comes."""
PAIR_STRENGTHS = (6.0, 10.0)
"""Range [σ] of each of two."""
ROUND = {"null": 15, "effect": 12, "pair": 4, "outside": 6}
"""Sets of each kind in a round; ten rounds are a test: 150, 60 of each strength, 40 and 60."""


@dataclass(frozen=True)
class Case:
    """Data set ``number`` of the campaign of ``root``.

    ``label``: the outside effect, or "" for a library effect that is drawn with the truth. ``strength``: NaN where
    there is none to ask for.
    """

    root: int
    number: int
    kind: Kind
    label: str = ""
    strength: float = float("nan")

    @property
    def seed(self) -> tuple[int, int]:
        """Of all its random numbers."""
        return self.root, self.number


def cases(root: int, number: int, outside: Sequence[str], wide: bool = False) -> Iterator[Case]:
    """The first ``number`` cases of a campaign; ``wide``: of a development campaign."""
    drawn = 0
    strengths = WIDE_STRENGTHS if wide else STRENGTHS
    while drawn < number:
        rng = np.random.default_rng([root, drawn])
        one: list[tuple[Kind, str, float]] = [("null", "", float("nan"))] * ROUND["null"]
        # As many of each strength as a round holds, in turn over the rounds.
        first = drawn // sum(ROUND.values()) * ROUND["effect"]
        one += [("effect", "", strengths[(first + k) % len(strengths)]) for k in range(ROUND["effect"])]
        one += [("pair", "", float(rng.uniform(*PAIR_STRENGTHS))) for _ in range(ROUND["pair"])]
        begun = drawn // sum(ROUND.values()) * ROUND["outside"]
        one += [("outside", outside[(begun + k) % len(outside)], float("nan")) for k in range(ROUND["outside"])]
        for k in rng.permutation(len(one))[: number - drawn]:
            kind, label, strength = one[k]
            yield Case(root, drawn, kind, label, strength)
            drawn += 1
