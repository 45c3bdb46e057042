"""Designs against their published tables and the algebra that defines them."""

import numpy as np
import pytest

from doe.analysis.surface import second_order_terms
from doe.designs import DESIGNS, DesignOptions, box_behnken, fold_over, interaction_aliases, plackett_burman
from doe.designs.plackett_burman import MOST_NONREGULAR, interaction_overlap, nonregular_table, smallest_size
from doe.errors import StatisticsError

# Rows 1, 10, 19 and 28 as R's FrF2 prints them: [A B C], [C A B], [B C A], all minus.
PRINTED_ROWS_28 = {
    0: "+-++++----+---+--+++-+-++-+",
    9: "++-+-++-++-++++----+---+--+",
    18: "-+---+--+++-+-++-++-++++---",
    27: "---------------------------",
}


@pytest.mark.parametrize("runs", range(8, 49, 4))
def test_plackett_burman_is_orthogonal_and_balanced(runs):
    design = plackett_burman(runs)
    assert design.shape == (runs, runs - 1)
    assert np.array_equal(design.T @ design, runs * np.eye(runs - 1))
    assert not design.sum(axis=0).any()


def test_plackett_burman_28_has_the_printed_rows():
    design = plackett_burman(28)
    for row, signs in PRINTED_ROWS_28.items():
        assert "".join("+" if level > 0 else "-" for level in design[row]) == signs


def test_of_40_runs_only_the_last_column_aliases_fully():
    for factors, fully in ((38, [0] * 38), (39, [1] * 38 + [19])):
        aliases, _ = interaction_aliases(plackett_burman(40)[:, :factors])
        assert (np.abs(aliases) > 0.999).sum(axis=1).tolist() == fully


def test_plackett_burman_12_starts_with_its_generator():
    assert "".join("+" if level > 0 else "-" for level in plackett_burman(12)[0]) == "++-+++---+-"


def test_plackett_burman_28_aliases_every_column_with_all_interactions_of_the_others():
    """286 interactions at ±1/7 and 39 at ±3/7 per column, sum of squares 13 (computed from the published
    table).
    """
    aliases, pairs = interaction_aliases(plackett_burman(28))
    for column in range(27):
        own = np.array([column in pair for pair in pairs])
        assert not aliases[column, own].any()
        sizes = np.rint(7 * np.abs(aliases[column, ~own])).astype(int)
        assert np.allclose(7 * np.abs(aliases[column, ~own]), sizes)
        assert (sizes == 1).sum() == 286
        assert (sizes == 3).sum() == 39
        assert (aliases[column] ** 2).sum() == pytest.approx(13)


def test_fold_over_frees_main_effects_from_interactions():
    folded = fold_over(plackett_burman(28))
    assert folded.shape == (56, 27)
    assert not interaction_aliases(folded)[0].any()
    # Products of four different columns of a twelve-run design sum to ±4 of 12 (Draper and Smith 1998, ch. 15).
    assert interaction_overlap(fold_over(plackett_burman(12))) == pytest.approx(1 / 3)
    assert interaction_overlap(plackett_burman(12)[:, :2]) == 0.0


@pytest.mark.parametrize("runs", [8, 12, 20, 24, 44, 48])
def test_plackett_burman_generators_are_quadratic_residues(runs):
    """Paley 1933: for a prime q = runs - 1 = 3 mod 4, +1 at the squares mod q and -1 elsewhere makes such a row. The
    printed rows are that one, its shifts, or its mirror image. (The printed row of 32 is another one, an m-sequence.)
    """
    q = runs - 1
    squares = {k * k % q for k in range(1, q)}
    paley = np.array([1 if k in squares else -1 for k in range(q)])
    kinds = [sign * turn for sign in (1, -1) for turn in (paley, paley[::-1])]
    printed = plackett_burman(runs)[0]
    assert any(np.array_equal(np.roll(kind, shift), printed) for kind in kinds for shift in range(q))


def test_plackett_burman_40_is_the_20_run_table_doubled():
    half = plackett_burman(20)
    table = plackett_burman(40)
    assert np.array_equal(table[20:, :19], half)
    assert np.array_equal(table[:20, 19:38], -half)
    assert (table[-1] == -1).all()


@pytest.mark.parametrize("runs, factors, share", [(16, 14, 1 / 2), (32, 31, 1 / 4)])
def test_a_nonregular_table_is_orthogonal_and_no_main_effect_is_an_interaction(runs, factors, share):
    """The regular table of the same size holds whole interactions: shares of 0 and ±1 alone."""
    table = nonregular_table(runs)
    assert factors == MOST_NONREGULAR[runs]
    assert np.array_equal(table.T @ table, runs * np.eye(runs - 1))
    assert not table.sum(axis=0).any()
    shares, _ = interaction_aliases(table[:, :factors])
    assert set(np.unique(np.abs(shares))) == {0, share}
    regular, _ = interaction_aliases(plackett_burman(runs)[:, :factors])
    assert set(np.unique(np.abs(regular))) == {0, 1}


def test_every_three_factors_of_the_nonregular_16_are_seen_in_all_combinations():
    """Projectivity 3 (Box and Tyssedal 1996); with up to 8 factors no two interactions are the same either (as in the
    designs of Jones and Montgomery 2010).
    """
    table = nonregular_table(16)[:, :14]
    assert all(len(np.unique(table[:, [i, j, k]], axis=0)) == 8
               for i in range(14) for j in range(i) for k in range(j))  # fmt: skip
    assert interaction_overlap(table[:, :8]) < 1
    # The fifteenth column tells the halves of the doubled table apart, and is seven interactions wholly.
    shares, _ = interaction_aliases(nonregular_table(16))
    assert (np.abs(shares[14]) == 1).sum() == 7


def test_a_regular_table_says_that_it_confuses_and_names_the_better_one():
    regular = DESIGNS["plackett-burman"].points(12, DesignOptions(runs=16))
    assert "--nonregular gives as many runs in which none is" in regular.notes[0]
    better = DESIGNS["plackett-burman"].points(12, DesignOptions(nonregular=True))
    assert better.notes == ()
    assert (len(better.coded), better.unused.shape[1]) == (16, 3)
    assert "no other table of 8 runs is better" in DESIGNS["plackett-burman"].points(7, DesignOptions()).notes[0]
    assert len(DESIGNS["plackett-burman"].points(15, DesignOptions(nonregular=True)).coded) == 32
    assert DESIGNS["plackett-burman"].points(11, DesignOptions()).notes == ()


@pytest.mark.parametrize(
    "factors, runs, message",
    [
        (7, 8, "every table of 8 runs is a regular fraction; allowed: 16 and 32"),
        (7, 20, "no such table of 20 runs; allowed"),
        (15, 16, "has 14 columns for 15 factors; allowed: at least 32"),
    ],
)
def test_a_nonregular_table_that_there_is_not_is_refused(factors, runs, message):
    with pytest.raises(StatisticsError, match=message):
        DESIGNS["plackett-burman"].points(factors, DesignOptions(runs=runs, nonregular=True))


@pytest.mark.parametrize("runs", [4, 10, 27, 52])
def test_plackett_burman_names_the_sizes_it_has(runs):
    with pytest.raises(StatisticsError, match=f"runs = {runs} .* allowed are 8, 12, 16, .* 48"):
        plackett_burman(runs)


@pytest.mark.parametrize("factors, runs", [(7, 8), (8, 12), (24, 28), (28, 32), (47, 48)])
def test_smallest_table_has_a_column_for_every_factor(factors, runs):
    assert smallest_size(factors) == runs


@pytest.mark.parametrize("factors", [0, 48])
def test_more_factors_than_columns_are_refused(factors):
    with pytest.raises(StatisticsError, match="allowed in a Plackett–Burman design: 1 to 47"):
        smallest_size(factors)


def test_one_factor_has_no_interaction_to_be_confused_with():
    points = DESIGNS["plackett-burman"].points(1, DesignOptions())
    assert (points.coded.shape, points.aliases, points.notes) == ((8, 1), (), ())


def test_plackett_burman_12_leaks_a_third_of_every_interaction():
    """Montgomery 2017, section 8.6.3: every main effect is aliased with every interaction of others at ±1/3."""
    aliases, pairs = interaction_aliases(plackett_burman(12))
    for column in range(11):
        others = [column not in pair for pair in pairs]
        assert np.allclose(np.abs(aliases[column, others]), 1 / 3)


def test_box_behnken_3_is_the_17_run_design_of_the_paper():
    """Processes 2022, 10, 185, Table 8, as a set of points."""
    paper = {(-1, 0, -1), (-1, 0, 1), (1, 0, -1), (1, 0, 1), (0, -1, -1), (0, -1, 1), (0, 1, -1), (0, 1, 1)}
    paper |= {(-1, -1, 0), (1, -1, 0), (-1, 1, 0), (1, 1, 0), (0, 0, 0)}
    design = box_behnken(3, centre=5)
    assert design.shape == (17, 3)
    assert {tuple(int(level) for level in row) for row in design} == paper
    assert not design[12:].any()


@pytest.mark.parametrize("factors, runs", [(3, 17), (4, 29), (5, 45)])
def test_box_behnken_has_the_published_size_and_is_balanced(factors, runs):
    design = box_behnken(factors, centre=5)
    assert design.shape == (runs, factors)
    assert not design.sum(axis=0).any()
    assert np.array_equal(design.T @ design, np.eye(factors) * 4 * (factors - 1))


@pytest.mark.parametrize("factors, centre, runs", [(6, 6, 54), (7, 6, 62)])
def test_box_behnken_on_triples_has_the_published_size_and_blocks(factors, centre, runs):
    """Box and Behnken 1960, table 4: 48 + 6 runs for 6 factors, 56 + 6 for 7, every factor moved in 24 of them; with 7,
    two factors move together in 8 of them, whichever the two (a balanced block design).
    """
    design = box_behnken(factors, centre)
    assert design.shape == (runs, factors)
    assert len(np.unique(design, axis=0)) == runs - centre + 1
    assert np.array_equal(design.T @ design, 24 * np.eye(factors))
    together = (np.abs(design).T @ np.abs(design))[~np.eye(factors, dtype=bool)]
    assert set(together.tolist()) == ({8} if factors == 7 else {8, 16})
    assert np.linalg.matrix_rank(second_order_terms(design.astype(float))) == (factors + 1) * (factors + 2) // 2


@pytest.mark.parametrize("factors, centre", [(2, 5), (8, 5), (3, 0)])
def test_box_behnken_refuses_what_it_is_not_made_for(factors, centre):
    with pytest.raises(StatisticsError):
        box_behnken(factors, centre)
