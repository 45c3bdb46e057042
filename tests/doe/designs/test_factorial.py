"""Two-level factorials and their fractions against the tables of the textbooks."""

from itertools import combinations
from math import comb

import numpy as np
import pytest

from doe.designs import DESIGNS, DesignOptions
from doe.designs.factorial import (
    STANDARD_FRACTIONS,
    alias_chains,
    defining_relation,
    factor_columns,
    factor_letters,
    factorial,
    generator_words,
    standard_generators,
    word_lengths,
)
from doe.errors import StatisticsError


def words(factors, generators):
    return [word for _, word in generator_words(factors, generators)]


def chains(factors, generators, order=2):
    return [
        "=".join(word.text() for word in chain) for chain in alias_chains(factors, words(factors, generators), order)
    ]


def test_full_factorial_is_in_standard_order():
    """(1), a, b, ab, c, ac, bc, abc."""
    assert factorial(3).tolist() == [
        [-1, -1, -1],
        [1, -1, -1],
        [-1, 1, -1],
        [1, 1, -1],
        [-1, -1, 1],
        [1, -1, 1],
        [-1, 1, 1],
        [1, 1, 1],
    ]


def test_half_fraction_and_its_aliases():
    """Montgomery 2017, example 8.1: 2^(4-1) with I = ABCD; [AB] = AB + CD and so on."""
    design = factorial(4, ["D=ABC"])
    assert design[:, 3].tolist() == [-1, 1, 1, -1, 1, -1, -1, 1]
    assert [word.text() for word in defining_relation(words(4, ["D=ABC"]))] == ["ABCD"]
    assert chains(4, ["D=ABC"]) == ["A", "B", "C", "D", "AB=CD", "AC=BD", "AD=BC"]
    assert "A=BCD" in chains(4, ["D=ABC"], order=3)


def test_quarter_fraction_has_the_printed_defining_relation():
    """Montgomery 2017, table 8.9: 2^(6-2), E = ABC, F = BCD: I = ABCE = BCDF = ADEF; AB = CE, AC = BE, AD = EF,
    AE = BC = DF, AF = DE, BD = CF, BF = CD.
    """
    relation = defining_relation(words(6, ["E=ABC", "F=BCD"]))
    assert {word.text() for word in relation} == {"ABCE", "BCDF", "ADEF"}
    confused = {frozenset(chain.split("=")) for chain in chains(6, ["E=ABC", "F=BCD"]) if "=" in chain}
    printed = ("AB=CE", "AC=BE", "AD=EF", "AE=BC=DF", "AF=DE", "BD=CF", "BF=CD")
    assert confused == {frozenset(chain.split("=")) for chain in printed}


def test_sign_of_a_generator_turns_its_column_and_its_aliases():
    assert np.array_equal(factorial(3, ["C=-AB"])[:, 2], -factorial(3, ["C=AB"])[:, 2])
    assert chains(3, ["C=-AB"]) == ["A=-BC", "B=-AC", "C=-AB"]


@pytest.mark.parametrize("factors, removed", STANDARD_FRACTIONS)
def test_listed_fractions_are_what_their_aliases_say(factors, removed):
    """Every chain is one column of the design, and different chains are orthogonal columns."""
    generators = standard_generators(factors, removed)
    design = factorial(factors, generators)
    assert design.shape == (2 ** (factors - removed), factors)
    columns = []
    for chain in alias_chains(factors, words(factors, generators)):
        products = [word.sign * design[:, sorted(word.factors)].prod(axis=1) for word in chain]
        assert all(np.array_equal(products[0], other) for other in products)
        columns.append(products[0])
    shared = np.array(columns) @ np.array(columns).T
    assert np.array_equal(shared, len(design) * np.eye(len(columns)))


@pytest.mark.parametrize(
    "factors, removed, resolution",
    [
        (3, 1, 3),
        (4, 1, 4),
        (5, 1, 5),
        (5, 2, 3),
        (6, 2, 4),
        (6, 3, 3),
        (7, 2, 4),
        (7, 3, 4),
        (7, 4, 3),
        (8, 2, 5),
        (8, 4, 4),
        (9, 3, 4),
        (9, 4, 4),
        (9, 5, 3),
        (10, 4, 4),
        (10, 5, 4),
        (11, 5, 4),
        (11, 6, 4),
        (15, 9, 4),
        (15, 10, 4),
        (15, 11, 3),
    ],
)
def test_listed_fractions_have_the_published_resolution(factors, removed, resolution):
    """Box, Hunter and Hunter 2005, table 6.22, up to 11 factors; NIST's handbook, section 5.3.3.4.7, the others."""
    relation = defining_relation(words(factors, standard_generators(factors, removed)))
    assert len(relation[0].factors) == resolution


@pytest.mark.parametrize(
    "runs, factors, lengths",
    [
        (16, 9, (4, 14, 8)),
        (16, 10, (8, 18, 16)),
        (16, 11, (12, 26, 28)),
        (16, 12, (16, 39, 48)),
        (16, 13, (22, 55, 72)),
        (16, 14, (28, 77, 112)),
        (16, 15, (35, 105, 168)),
        (32, 8, (0, 3, 4)),
        (32, 9, (0, 6, 8)),
        (32, 10, (0, 10, 16)),
        (32, 11, (0, 25, 0)),
        (32, 12, (0, 38, 0)),
        (32, 13, (0, 55, 0)),
        (32, 14, (0, 77, 0)),
        (32, 15, (0, 105, 0)),
        (64, 8, (0, 0, 2)),
        (64, 9, (0, 1, 4)),
        (64, 10, (0, 2, 8)),
        (64, 11, (0, 4, 14)),
        (64, 12, (0, 6, 24)),
        (64, 13, (0, 14, 28)),
        (64, 14, (0, 22, 40)),
        (64, 15, (0, 30, 60)),
    ],
)
def test_listed_fractions_have_the_catalogued_word_lengths(runs, factors, lengths):
    """Words of length 3, 4 and 5: Chen, Sun and Wu 1993, Int. Stat. Rev. 61:131."""
    generators = standard_generators(factors, factors - runs.bit_length() + 1)
    assert word_lengths(words(factors, generators), factors)[:5] == (0, 0, *lengths)


@pytest.mark.parametrize(
    "basic, factors", [(3, 5), (3, 6), (3, 7), *((4, k) for k in range(5, 16)), *((5, k) for k in range(6, 10))]
)
def test_no_other_fraction_of_the_size_has_less_aberration(basic, factors):
    """Every choice of columns, its word lengths by MacWilliams' identity from how many factors are low in each run:
    A_i is the mean over the runs of the Krawtchouk polynomial K_i.
    """
    runs = np.arange(2**basic)
    low = np.array([[(run & column).bit_count() % 2 for column in range(2**basic)] for run in runs])
    ours = list(factor_columns(factors, standard_generators(factors, factors - basic)))
    free = [column for column in range(1, 2**basic) if column.bit_count() > 1]
    own = [1 << k for k in range(basic)]
    chosen = np.array([ours, *([*own, *more] for more in combinations(free, factors - basic))])
    weights = low[:, chosen].sum(axis=2)
    krawtchouk = np.array([
        [sum((-1) ** j * comb(w, j) * comb(factors - w, i - j) for j in range(i + 1)) for w in range(factors + 1)]
        for i in range(1, factors + 1)
    ])  # fmt: skip
    lengths = krawtchouk[:, weights].sum(axis=1).T // 2**basic
    assert tuple(lengths[0]) == word_lengths(words(factors, standard_generators(factors, factors - basic)), factors)
    assert tuple(lengths[0]) == min(map(tuple, lengths))


@pytest.mark.parametrize("factors", range(10, 16))
def test_no_fraction_of_32_runs_without_words_of_three_has_fewer_of_four(factors):
    """Every choice of columns by rising number, left where it makes a word of three, or too many words of four."""
    found = word_lengths(words(factors, standard_generators(factors, factors - 5)), factors)
    free = [column for column in range(32) if column.bit_count() > 2]
    fewest = found[3] + 1

    def extend(columns, candidates, four):
        nonlocal fewest
        if len(columns) == factors:
            fewest = min(fewest, four)
        twos = {a ^ b for a, b in combinations(columns, 2)}
        threes = [a ^ b ^ c for a, b, c in combinations(columns, 3)]
        for k in range(len(candidates) - (factors - len(columns)) + 1) if len(columns) < factors else ():
            total = four + threes.count(candidates[k])
            if candidates[k] not in twos and total < fewest:
                extend([*columns, candidates[k]], candidates[k + 1 :], total)

    extend([1 << k for k in range(5)], free, 0)
    assert (found[:3], found[3]) == ((0, 0, 0), fewest)


def test_a_size_takes_the_fraction_of_least_aberration():
    factorial_design = DESIGNS["factorial"]
    points = factorial_design.points(11, DesignOptions(runs=32))
    assert (points.coded.shape, points.traits) == ((32, 11), ("2^(11−6)",))
    assert points.notes[0].startswith("Resolution IV; words of the defining relation: 25 of length 4, 27 of length 6")
    assert np.array_equal(points.coded, factorial_design.points(11, DesignOptions(fraction=6)).coded)
    assert factorial_design.points(4, DesignOptions(runs=16)).generators == ()
    # Half of any factorial: the last factor is the product of all others.
    assert factorial_design.points(10, DesignOptions(runs=512)).aliases[0] == "I = ABCDEFGHJK"
    assert factorial_design.points(15, DesignOptions(runs=16)).aliases[0].endswith("and 2016 more")


@pytest.mark.parametrize(
    "options, message",
    [
        ({"runs": 24}, "runs = 24: no listed factorial of 9 factors; allowed: 16, 32, 64, 256, 512"),
        ({"runs": 8}, "allowed: 16, 32"),
        ({"runs": 32, "fraction": 4}, "runs: given together with fraction; allowed: one of the two"),
        ({"fraction": 2}, r"no listed fraction 2\^\(9-2\); listed: 9-1 \(256 runs\), 9-3 \(64 runs\)"),
    ],
)
def test_a_size_that_is_not_listed_is_refused_with_what_is(options, message):
    with pytest.raises(StatisticsError, match=message):
        DESIGNS["factorial"].points(9, DesignOptions(**options))


@pytest.mark.parametrize(
    "generators, message",
    [
        (["D"], "allowed: the form"),
        (["D=AX"], "no factor X"),
        (["D=AD"], "two or more other factors, each once"),
        (["D=AA"], "two or more other factors, each once"),
        (["D=A"], "two or more other factors, each once"),
        (["D=ABC", "D=AB"], "must set another factor"),
        (["C=AB", "D=AC"], "must set another factor"),
    ],
)
def test_a_generator_that_makes_no_column_is_refused(generators, message):
    with pytest.raises(StatisticsError, match=message):
        factorial(4, generators)


def test_too_large_a_factorial_and_an_unlisted_fraction_are_refused():
    with pytest.raises(StatisticsError, match="allowed are 1 to 10"):
        factorial(11)
    with pytest.raises(StatisticsError, match=r"no listed fraction 2\^\(9-6\)"):
        standard_generators(9, 6)


def test_letters_leave_out_the_identity_and_go_on_after_z():
    letters = factor_letters(47)
    assert letters[:9] == tuple("ABCDEFGHJ")
    assert letters[24:27] == ("Z", "AA", "AB")
    assert len(set(letters)) == 47
