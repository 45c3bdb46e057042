"""Designs against their published tables and the algebra that defines them."""

import numpy as np
import pytest

from doe.designs import box_behnken, fold_over, interaction_aliases, plackett_burman
from doe.errors import StatisticsError

# Rows 1, 10, 19 and 28 as R's FrF2 prints them: [A B C], [C A B], [B C A], all minus.
PRINTED_ROWS_28 = {
    0: "+-++++----+---+--+++-+-++-+",
    9: "++-+-++-++-++++----+---+--+",
    18: "-+---+--+++-+-++-++-++++---",
    27: "---------------------------",
}


@pytest.mark.parametrize("runs", [12, 28])
def test_plackett_burman_is_orthogonal_and_balanced(runs):
    design = plackett_burman(runs)
    assert design.shape == (runs, runs - 1)
    assert np.array_equal(design.T @ design, runs * np.eye(runs - 1))
    assert not design.sum(axis=0).any()


def test_plackett_burman_28_has_the_printed_rows():
    design = plackett_burman(28)
    for row, signs in PRINTED_ROWS_28.items():
        assert "".join("+" if level > 0 else "-" for level in design[row]) == signs


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


@pytest.mark.parametrize("runs", [8, 24, 27])
def test_plackett_burman_names_the_sizes_it_has(runs):
    with pytest.raises(StatisticsError, match=f"runs = {runs} .* allowed are 12 and 28"):
        plackett_burman(runs)


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


@pytest.mark.parametrize("factors, centre", [(2, 5), (6, 5), (3, 0)])
def test_box_behnken_refuses_what_it_is_not_made_for(factors, centre):
    with pytest.raises(StatisticsError):
        box_behnken(factors, centre)
