"""Two-level factorial designs: all combinations of k factors, or a regular fraction of them given by generators.

A generator "E=ABC" or "E=-ABC" sets the column of a factor to the (negative) product of others; factors are the letters
of `factor_letters`. Every generator gives a word that equals the identity (I = ABCE); these words and their products
are the defining relation, and the length of its shortest word is the resolution. Columns whose product is in the
defining relation are aliased: they are equal except for the sign. Of all fractions of one size, a minimum-aberration
fraction has the fewest words of length 3, among those the fewest of length 4, and so on. Source: Box and Hunter 1961,
Technometrics 3:311; Fries and Hunter 1980, Technometrics 22:601; Montgomery 2017, Design and Analysis of Experiments,
ch. 8.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
import numpy.typing as npt

from doe.designs.blocks import block_generators, spanned
from doe.designs.design import LETTERS, Design, DesignOptions, Points, factor_letters, with_centre
from doe.errors import StatisticsError
from doe.record import Record

IntArray = npt.NDArray[np.int64]
MOST_BASIC = 10
"""Largest number of basic factors; a full factorial of them has 1024 runs."""
ROMAN = ("", "I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X", "XI")
MOST_WORDS = 31
"""Words of a defining relation that are printed; of the others only the number is given."""
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

    The factors that no generator sets are the basic factors; the first of them alternates fastest.
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
            raise StatisticsError(f"generator {text!r}; allowed: the form E=ABC or E=-ABC")
        left, sign, right = match.groups()
        unknown = [letter for letter in left + right if letter not in letters]
        if unknown:
            raise StatisticsError(f"generator {text!r}: no factor {unknown[0]}; allowed are {', '.join(letters)}")
        if left in right or len(set(right)) < max(2, len(right)):
            raise StatisticsError(f"generator {text!r}: the right side must name two or more other factors, each once")
        indices = frozenset(letters.index(letter) for letter in left + right)
        found.append((letters.index(left), Word(-1 if sign in {"-", "−"} else 1, indices)))
    made = [factor for factor, _ in found]
    for factor, word in found:
        if made.count(factor) > 1 or (word.factors - {factor}) & set(made):
            raise StatisticsError(
                f"generator of {letters[factor]}: each generator must set another factor, from factors that none sets"
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

    The sign of a word is that of its column relative to the first of its group. Effects aliased with the mean, if there
    are any, form the first group, which begins with an empty word.
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


def word_lengths(words: Sequence[Word], factors: int) -> tuple[int, ...]:
    """Return the number of words of length 1, 2, … `factors` in the defining relation of the generating words."""
    lengths = [len(word.factors) for word in defining_relation(words)]
    return tuple(lengths.count(length) for length in range(1, factors + 1))


def standard_generators(factors: int, removed: int) -> tuple[str, ...]:
    """Return generators of the minimum-aberration fraction 2^(factors - removed).

    Raises StatisticsError for a fraction that is not in the list.
    """
    if removed == 1 and factors - 1 in range(2, MOST_BASIC + 1):
        letters = factor_letters(factors)
        return (f"{letters[-1]}={''.join(letters[:-1])}",)
    try:
        return STANDARD_FRACTIONS[factors, removed]
    except KeyError:
        listed = sorted({removed for k, removed in STANDARD_FRACTIONS if k == factors} | {1})
        have = ", ".join(f"{factors}-{p} ({2 ** (factors - p)} runs)" for p in listed if factors - p <= MOST_BASIC)
        raise StatisticsError(
            f"no listed fraction 2^({factors}-{removed}); listed: {have or 'none'}; others: generators such as E=ABC"
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
"""(number of factors, number of generators) → generators: up to 8 factors from table 6.22 of Box, Hunter and Hunter
2005, Statistics for Experimenters; the others from ``FURTHER_FRACTIONS``."""

FURTHER_FRACTIONS = (
    (4, range(9, 16), "ABC ABD ACD BCD ABCD AB AC AD BC BD CD"),
    (5, range(9, 11), "ABCD ABCE ABDE ACDE BCDE"),
    (5, range(11, 12), "ABC BCD CDE ACD ADE BDE"),
    (5, range(12, 16), "ABC ABD ACD BCD ABE ACE ADE BCE BDE CDE"),
    (6, range(9, 10), "ABCD ACEF CDEF"),
    (6, range(10, 11), "ABCD ABCE ADEF BDEF"),
    (6, range(11, 12), "ABCD ABCE ABDE ACDEF BCDEF"),
    (6, range(12, 13), "ABC ABD ACDE ACDF ABEF BCDEF"),
    (6, range(13, 14), "ABC ABD ABE ACDE ACF ADEF ABCDEF"),
    (6, range(14, 16), "ABC ABD ABE ACDE ABF ACDF ACEF ADEF ABCDEF"),
)
"""Basic factors, numbers of factors, and the right sides of the generators in turn, for 16, 32 and 64 runs.

Generators as listed in the library dexpy (from Design-Expert). An exhaustive search found no fraction with less
aberration (as in the catalogue of Chen, Sun and Wu 1993, Int. Stat. Rev. 61:131): the tests repeat it for 16 and 32
runs; for 64 runs it was done once."""

for _basic, _numbers, _right in FURTHER_FRACTIONS:
    for _factors in _numbers:
        _made = zip(factor_letters(_factors)[_basic:], _right.split(), strict=False)
        STANDARD_FRACTIONS[_factors, _factors - _basic] = tuple(f"{left}={right}" for left, right in _made)


@dataclass(frozen=True)
class FactorialBlocks:
    """A split into blocks: the block of every row, counted from 0; the block generators as words; the two-factor
    interactions that are confounded with blocks.
    """

    of_row: IntArray
    generators: tuple[str, ...]
    lost: tuple[str, ...]


def factor_columns(factors: int, generators: Sequence[str]) -> tuple[int, ...]:
    """Return the columns of the factors as `doe.designs.blocks` numbers them: one bit for each basic factor."""
    made = dict(generator_words(factors, generators))
    basic = [k for k in range(factors) if k not in made]
    bit = {factor: 1 << place for place, factor in enumerate(basic)}
    return tuple(bit[k] if k in bit else sum(bit[one] for one in made[k].factors - {k}) for k in range(factors))


def factorial_blocks(factors: int, generators: Sequence[str], blocks: int, clear: int = 1) -> FactorialBlocks:
    """Return the best split of `factorial(factors, generators)` into `blocks` blocks.

    Effects of up to `clear` factors are kept clear of the blocks. Raises StatisticsError if there is no such split.
    """
    columns = factor_columns(factors, generators)
    chosen = block_generators(columns, blocks, clear)
    basic = [k for k in range(factors) if columns[k].bit_count() == 1]
    words = [frozenset(k for k in basic if columns[k] & column) for column in chosen]
    design = factorial(factors, generators)
    signs = [design[:, sorted(word)].prod(axis=1) > 0 for word in words]
    contrasts = set(spanned(chosen))
    lost = [pair for pair in combinations(range(factors), 2) if columns[pair[0]] ^ columns[pair[1]] in contrasts]
    return FactorialBlocks(
        np.sum([sign.astype(np.int64) << place for place, sign in enumerate(signs)], axis=0),
        tuple(Word(1, word).text() for word in words),
        tuple(Word(1, frozenset(pair)).text() for pair in lost),
    )


class Factorial(Design):
    """All combinations of two levels, or a regular fraction."""

    name = "factorial"
    title = "two-level factorial"
    doc = "Two levels: every combination, or a fraction by size or generators; main effects and interactions."
    options = ("runs", "centre", "generators", "fraction", "blocks")

    def points(self, factors: int, options: DesignOptions) -> Points:
        """Rows in standard order, then ``options.centre`` centre runs; with blocks, this number in each block."""
        asked = [name for name in ("generators", "fraction", "runs") if getattr(options, name)]
        if len(asked) > 1:
            raise StatisticsError(f"{asked[1]}: given together with {asked[0]}; allowed: one of the two")
        removed = options.fraction if options.runs is None else _removed(factors, options.runs)
        generators = options.generators or (standard_generators(factors, removed) if removed else ())
        name = f"2^({factors}−{len(generators)})" if generators else f"2^{factors}"
        coded = factorial(factors, generators)
        aliases, notes = _aliases(factors, generators), _resolution(factors, generators)
        if options.blocks is None:
            points = Points(with_centre(coded, options.centre), traits=(name,))
        else:
            split = factorial_blocks(factors, generators, options.blocks)
            centre = np.repeat(np.arange(options.blocks), options.centre or 0)
            points = Points(
                with_centre(coded, len(centre)),
                traits=(name, f"{options.blocks} blocks by {', '.join(split.generators)}"),
                block=np.concatenate([split.of_row, centre]),
            )
            if split.lost:
                notes = (*notes, f"Interactions that cannot be told from the blocks: {', '.join(split.lost)}.")
        return replace(points, generators=tuple(generators), aliases=aliases, notes=notes)


def _removed(factors: int, runs: int) -> int:
    """P of the fraction with this number of runs."""
    sizes = [2**factors] if factors <= MOST_BASIC else []
    if 2 <= factors - 1 <= MOST_BASIC:
        sizes.append(2 ** (factors - 1))
    sizes += [2 ** (k - removed) for k, removed in STANDARD_FRACTIONS if k == factors]
    if runs not in sizes:
        allowed = ", ".join(map(str, sorted(set(sizes)))) or "none, except by generators such as E=ABC"
        raise StatisticsError(f"runs = {runs}: no listed factorial of {factors} factors; allowed: {allowed}")
    return factors - (runs.bit_length() - 1)


def _resolution(factors: int, generators: Sequence[str]) -> tuple[str, ...]:
    """A sentence on a fraction: its resolution and the number of its shortest words."""
    if not generators:
        return ()
    lengths = word_lengths([word for _, word in generator_words(factors, generators)], factors)
    counts = [(length, number) for length, number in enumerate(lengths, start=1) if number]
    listed = ", ".join(f"{number} of length {length}" for length, number in counts[:3])
    return (f"Resolution {ROMAN[counts[0][0]]}; words of the defining relation: {listed}.",)


def _aliases(factors: int, generators: Sequence[str]) -> tuple[str, ...]:
    if not generators:
        return ()
    words = [word for _, word in generator_words(factors, generators)]
    relation = [word.text() for word in defining_relation(words)]
    more = f" and {len(relation) - MOST_WORDS} more" if len(relation) > MOST_WORDS else ""
    chains = [" = ".join(word.text() or "mean" for word in chain) for chain in alias_chains(factors, words)]
    return (f"I = {' = '.join(relation[:MOST_WORDS])}{more}", *(chain for chain in chains if "=" in chain))
