"""Two-level factorials and their fractions against the tables of the textbooks."""

import numpy as np
import pytest

from doe.designs.factorial import (
    STANDARD_FRACTIONS,
    alias_chains,
    defining_relation,
    factor_letters,
    factorial,
    generator_words,
    standard_generators,
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
    ],
)
def test_listed_fractions_have_the_published_resolution(factors, removed, resolution):
    """Box, Hunter and Hunter 2005, table 6.22."""
    relation = defining_relation(words(factors, standard_generators(factors, removed)))
    assert len(relation[0].factors) == resolution


@pytest.mark.parametrize(
    "generators, message",
    [
        (["D"], "form such as"),
        (["D=AX"], "no factor X"),
        (["D=AD"], "different other factors"),
        (["D=AA"], "different other factors"),
        (["D=A"], "different other factors"),
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
    with pytest.raises(StatisticsError, match=r"no listed fraction 2\^\(9-5\)"):
        standard_generators(9, 5)


def test_letters_leave_out_the_identity_and_go_on_after_z():
    letters = factor_letters(47)
    assert letters[:9] == tuple("ABCDEFGHJ")
    assert letters[24:27] == ("Z", "AA", "AB")
    assert len(set(letters)) == 47
