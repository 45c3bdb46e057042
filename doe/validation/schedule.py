"""Which truths a campaign asks for, by the number of the data set: rounds of the same cases, each shuffled."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Kind = Literal["null", "effect", "pair", "outside"]

STRENGTHS = (4.0, 6.0, 10.0)
"""[σ] of single effects."""
PAIR_STRENGTH = 10.0
"""[σ] of each of the two."""
NULLS, PAIRS, OUTSIDE = 50, 4, 2
"""Per round: sets without an effect, with a pair, and with each outside effect."""


@dataclass(frozen=True)
class Case:
    """Data set ``number``. ``label``: the library or outside effect; a pair is drawn with the truth.

    ``strength`` is NaN where there is none to ask for.
    """

    number: int
    kind: Kind
    label: str = ""
    strength: float = float("nan")


def cases(number: int, effects: Sequence[str], outside: Sequence[str]) -> Iterator[Case]:
    """The first ``number`` cases."""
    drawn = 0
    while drawn < number:
        one = _round(effects, outside)
        order = np.random.default_rng(drawn).permutation(len(one))
        for k in order[: number - drawn]:
            kind, label, strength = one[k]
            yield Case(drawn, kind, label, strength)
            drawn += 1


def round_length(effects: Sequence[str], outside: Sequence[str]) -> int:
    """Data sets of one round."""
    return len(_round(effects, outside))


def _round(effects: Sequence[str], outside: Sequence[str]) -> list[tuple[Kind, str, float]]:
    nan = float("nan")
    one: list[tuple[Kind, str, float]] = [("null", "", nan)] * NULLS
    one += [("effect", name, strength) for name in effects for strength in STRENGTHS]
    one += [("pair", "", PAIR_STRENGTH)] * PAIRS
    one += [("outside", name, nan) for name in outside] * OUTSIDE
    return one
