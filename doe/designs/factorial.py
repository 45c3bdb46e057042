"""Two-level factorial designs: all combinations of k factors, or a regular fraction of them by generators.

A generator "E=ABC" or "E=-ABC" sets the column of a factor to the (negative) product of others; factors are the letters
of `factor_letters`. Every generator is a word that equals the identity (I = ABCE); the products of those words are the
defining relation, its shortest word the resolution. Columns whose product is in the defining relation are one column:
that is the alias structure. Source: Box and Hunter 1961, Technometrics 3:311; Montgomery 2017, Design and Analysis of
Experiments, ch. 8.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np
import numpy.typing as npt

from doe.designs.design import LETTERS, Design, DesignOptions, Points, factor_letters, with_centre
from doe.errors import StatisticsError
from doe.record import Record

IntArray = npt.NDArray[np.int64]
MOST_BASIC = 10
"""Factors of a full factorial, 1024 runs."""
GENERATOR = re.compile(r"^\s*([A-Z])\s*=\s*([+\-−]?)\s*([A-Z]+)\s*$")


@dataclass(frozen=True)
class Word(Record):
    """A product of factor columns that equals +I or -I: sign, and the indices of the factors."""

    sign: int
    factors: frozenset[int]

    def text(self) -> str:
        """Return the word in letters, such as "-ABD"."""
        letters = factor_letters(max(self.factors, default=0) + 1)
        return ("-" if self.sign < 0 else "") + "".join(letters[k] for k in sorted(self.factors))

    def times(self, other: Word) -> Word:
        """Return the product; equal factors cancel."""
        return Word(self.sign * other.sign, self.factors ^ other.factors)


def factorial(factors: int, generators: Sequence[str] = ()) -> IntArray:
    """Return the 2^(factors - generators) design as levels -1, +1, shape (runs, factors), in standard order.

    The factors that no generator sets are the basic ones; the first of them alternates fastest.
    Raises StatisticsError for generators that are not of the form "E=ABC", or more than 10 basic factors.
    """
    words = generator_words(factors, generators)
    made = dict(words)
    basic = [k for k in range(factors) if k not in made]
    if not 1 <= len(basic) <= MOST_BASIC:
        raise StatisticsError(
            f"{factors} factors with {len(made)} generators: {len(basic)} basic factors; allowed are 1 to {MOST_BASIC}"
        )
    design = np.zeros((2 ** len(basic), factors), dtype=np.int64)
    design[:, basic] = [row[::-1] for row in product((-1, 1), repeat=len(basic))]
    for factor, word in made.items():
        design[:, factor] = word.sign * design[:, sorted(word.factors - {factor})].prod(axis=1)
    return design


def generator_words(factors: int, generators: Sequence[str]) -> list[tuple[int, Word]]:
    """Return, per generator, the index of the factor that it sets and its word."""
    letters = factor_letters(factors)[: len(LETTERS)]
    found: list[tuple[int, Word]] = []
    for text in generators:
        match = GENERATOR.match(text.upper())
        if match is None:
            raise StatisticsError(f"generator {text!r}: allowed is a form such as E=ABC or E=-ABC")
        left, sign, right = match.groups()
        unknown = [letter for letter in left + right if letter not in letters]
        if unknown:
            raise StatisticsError(f"generator {text!r}: no factor {unknown[0]}; allowed are {', '.join(letters)}")
        if left in right or len(set(right)) < max(2, len(right)):
            raise StatisticsError(f"generator {text!r}: the right side must be two or more different other factors")
        indices = frozenset(letters.index(letter) for letter in left + right)
        found.append((letters.index(left), Word(-1 if sign in {"-", "−"} else 1, indices)))
    made = [factor for factor, _ in found]
    for factor, word in found:
        if made.count(factor) > 1 or (word.factors - {factor}) & set(made):
            raise StatisticsError(
                f"generator of {letters[factor]}: every generator must set another factor, from factors that none sets"
            )
    return found


def defining_relation(words: Sequence[Word]) -> tuple[Word, ...]:
    """Return every product of the generating words, shortest first; empty for a full factorial."""
    relation: list[Word] = []
    for word in words:
        relation += [word, *(one.times(word) for one in relation)]
    return tuple(sorted(relation, key=lambda word: (len(word.factors), sorted(word.factors))))


def alias_chains(factors: int, words: Sequence[Word], order: int = 2) -> list[tuple[Word, ...]]:
    """Return the effects up to `order` factors in groups that share one column, each group's simplest effect first.

    The sign of a word is that of its column relative to the first of its group. Effects that equal the mean stand in
    the first group with an empty word, where there are any.
    """
    relation = defining_relation(words)
    effects = [Word(1, frozenset(c)) for size in range(1, order + 1) for c in combinations(range(factors), size)]
    wanted = {effect.factors for effect in effects}
    chains: list[tuple[Word, ...]] = []
    seen: set[frozenset[int]] = set()
    for effect in [Word(1, frozenset()), *effects]:
        if effect.factors in seen:
            continue
        others = [effect.times(word) for word in relation]
        chain = (effect, *sorted((o for o in others if o.factors in wanted), key=lambda o: (len(o.factors), o.text())))
        seen |= {one.factors for one in chain}
        if effect.factors or len(chain) > 1:
            chains.append(chain)
    return chains


def standard_generators(factors: int, removed: int) -> tuple[str, ...]:
    """Return generators of highest resolution for the fractions that are used most, 2^(factors - removed).

    Source: Box, Hunter and Hunter 2005, Statistics for Experimenters, table 6.22.
    Raises StatisticsError for a fraction that is not in the list.
    """
    try:
        return STANDARD_FRACTIONS[factors, removed]
    except KeyError:
        listed = ", ".join(f"{k}-{p}" for k, p in STANDARD_FRACTIONS)
        raise StatisticsError(
            f"no listed fraction 2^({factors}-{removed}); listed: {listed}; others by generators such as E=ABC"
        ) from None


STANDARD_FRACTIONS: dict[tuple[int, int], tuple[str, ...]] = {
    (3, 1): ("C=AB",),
    (4, 1): ("D=ABC",),
    (5, 1): ("E=ABCD",),
    (5, 2): ("D=AB", "E=AC"),
    (6, 1): ("F=ABCDE",),
    (6, 2): ("E=ABC", "F=BCD"),
    (6, 3): ("D=AB", "E=AC", "F=BC"),
    (7, 1): ("G=ABCDEF",),
    (7, 2): ("F=ABCD", "G=ABDE"),
    (7, 3): ("E=ABC", "F=BCD", "G=ACD"),
    (7, 4): ("D=AB", "E=AC", "F=BC", "G=ABC"),
    (8, 2): ("G=ABCD", "H=ABEF"),
    (8, 3): ("F=ABC", "G=ABD", "H=BCDE"),
    (8, 4): ("E=BCD", "F=ACD", "G=ABC", "H=ABD"),
}
"""(factors, generators) → generators."""


class Factorial(Design):
    """All combinations of two levels, or a regular fraction."""

    name = "factorial"
    title = "two-level factorial"
    doc = "Two levels: every combination, or a fraction by generators; main effects and interactions."
    options = ("centre", "generators", "fraction")

    def points(self, factors: int, options: DesignOptions) -> Points:
        """In standard order; centre runs only where they are asked for."""
        if options.generators and options.fraction:
            raise StatisticsError("fraction: has generators of its own; allowed: a fraction or generators")
        generators = options.generators or (standard_generators(factors, options.fraction) if options.fraction else ())
        name = f"2^({factors}−{len(generators)})" if generators else f"2^{factors}"
        coded = with_centre(factorial(factors, generators), options.centre)
        return Points(coded, traits=(name,), generators=tuple(generators), aliases=_aliases(factors, generators))


def _aliases(factors: int, generators: Sequence[str]) -> tuple[str, ...]:
    if not generators:
        return ()
    words = [word for _, word in generator_words(factors, generators)]
    relation = " = ".join(word.text() for word in defining_relation(words))
    chains = [" = ".join(word.text() or "mean" for word in chain) for chain in alias_chains(factors, words)]
    return (f"I = {relation}", *(chain for chain in chains if "=" in chain))
