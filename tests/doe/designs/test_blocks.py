"""Blocks against their closed form: what differs between blocks has no projection on the effects of the model."""

from itertools import combinations

import numpy as np
import pytest

from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import Blocks, block_columns, fit_surface, second_order_terms
from doe.designs import DESIGNS, DesignOptions, factor_letters
from doe.designs.blocks import block_generators, spanned
from doe.designs.central_composite import central_composite_blocks
from doe.designs.factorial import factorial, factorial_blocks, standard_generators
from doe.errors import StatisticsError

SECOND_ORDER = [("central-composite", k, blocks) for k, blocks in
                ((2, 2), (3, 2), (3, 3), (4, 3), (5, 2), (6, 2), (6, 3), (7, 2), (7, 5), (7, 9))]  # fmt: skip
SECOND_ORDER += [("box-behnken", 4, 3), ("box-behnken", 5, 2), ("box-behnken", 6, 2), ("box-behnken", 7, 2)]


def projections(terms, block):
    """Means of the terms in each block, less their means over all runs: zero where the two are orthogonal."""
    return np.array([terms[block == one].mean(axis=0) for one in range(block.max() + 1)]) - terms.mean(axis=0)


def pairs(levels):
    return list(combinations(range(levels.shape[1]), 2))


@pytest.mark.parametrize("removed", [0, 1, 2])
@pytest.mark.parametrize("blocks", [2, 4, 8])
def test_blocks_of_a_factorial_take_nothing_but_the_interactions_that_are_named(removed, blocks):
    generators = standard_generators(6, removed) if removed else ()
    levels = factorial(6, generators)
    split = factorial_blocks(6, generators, blocks)
    assert set(np.bincount(split.of_row)) == {len(levels) // blocks}
    assert not projections(levels, split.of_row).any()
    letters = factor_letters(6)
    for i, j in pairs(levels):
        share = projections((levels[:, i] * levels[:, j])[:, None], split.of_row)
        assert (np.abs(share) == 1).all() if letters[i] + letters[j] in split.lost else not share.any()


@pytest.mark.parametrize(
    "factors, blocks, lost",
    [(3, 4, 3), (4, 2, 0), (4, 4, 1), (4, 8, 6), (5, 4, 0), (5, 8, 2), (5, 16, 10), (6, 8, 0), (6, 16, 3), (6, 32, 15)],
)
def test_a_full_factorial_loses_the_published_number_of_interactions(factors, blocks, lost):
    """Montgomery 2017, table 7.9: 2^4 in four blocks by ABD, ACD loses BC; 2^5 in eight by ABE, BCE, CDE AC and BD."""
    assert len(factorial_blocks(factors, (), blocks).lost) == lost


@pytest.mark.parametrize("factors, q", [(3, 1), (3, 2), (4, 1), (4, 2), (4, 3)])
def test_no_other_generators_lose_fewer_interactions(factors, q):
    columns = [1 << k for k in range(factors)]

    def lost(generators):
        weights = [column.bit_count() for column in spanned(generators)]
        full = len(set(spanned(generators))) == 2**q - 1 and 0 not in spanned(generators)
        return [weights.count(size) for size in (1, 2, 3, 4)] if full and 1 not in weights else [99]

    best = min(lost(generators) for generators in combinations(range(1, 2**factors), q))
    assert lost(block_generators(columns, 2**q)) == best


def test_more_blocks_than_products_are_refused_with_what_there_is():
    with pytest.raises(StatisticsError, match=r"blocks = 3: would be aliased with main effects .* allowed: 2, 4, 8"):
        factorial_blocks(4, (), 3)
    with pytest.raises(StatisticsError, match="allowed: no blocks"):
        factorial_blocks(7, standard_generators(7, 4), 2)


@pytest.mark.parametrize("name, factors, blocks", SECOND_ORDER)
def test_blocks_of_a_second_order_design_are_orthogonal_to_every_term(name, factors, blocks):
    points = DESIGNS[name].points(factors, DesignOptions(blocks=blocks))
    assert len(np.unique(points.block)) == blocks
    assert np.abs(projections(second_order_terms(points.coded), points.block)).max() < 1e-12
    with_blocks = np.column_stack([second_order_terms(points.coded), block_columns(points.block, blocks)])
    assert np.linalg.matrix_rank(with_blocks) == with_blocks.shape[1]


@pytest.mark.parametrize(
    "factors, blocks, runs, alpha",
    [(2, 2, 14, 1.414), (3, 3, 20, 1.633), (4, 3, 30, 2.0), (5, 2, 33, 2.0), (6, 3, 54, 2.366), (7, 9, 90, 2.828)],
)
def test_a_blocked_central_composite_has_the_alpha_of_its_closed_form(factors, blocks, runs, alpha):
    """Box and Hunter 1957: alpha² = F (2 k + n_A)/(2 (F + n_F)); of 3 factors also Minitab's 20 runs."""
    design, block = central_composite_blocks(factors, blocks)
    assert len(design) == runs
    assert np.abs(design).max() == pytest.approx(alpha, abs=5e-4)
    axial = np.bincount(block)[-1]
    squares = design[:, 0] ** 2
    in_axial = squares[block == blocks - 1].sum()
    assert (len(design) - axial) / axial == pytest.approx((squares.sum() - in_axial) / in_axial)


def test_centre_runs_of_a_block_move_alpha_and_inscribed_stays_in_the_cube():
    design, block = central_composite_blocks(3, 2, centre=1)
    assert np.bincount(block).tolist() == [9, 7]
    assert np.abs(design).max() == pytest.approx((8 * 7 / (2 * 9)) ** 0.5)
    inscribed, _ = central_composite_blocks(3, 2, centre=1, alpha="inscribed")
    assert np.allclose(inscribed * np.abs(design).max(), design)


@pytest.mark.parametrize("name, factors, blocks", [("central-composite", 3, 3), ("box-behnken", 4, 3)])
def test_a_shift_of_a_whole_block_moves_no_coefficient(name, factors, blocks):
    """y with and without a day's shift: the same model, and the sums of squares of blocks and model add up."""
    points = DESIGNS[name].points(factors, DesignOptions(blocks=blocks))
    region = Region(factor_letters(factors), np.zeros(factors), np.ones(factors), ())
    terms = second_order_terms(points.coded)
    random = np.random.default_rng(4)
    values = terms @ random.normal(size=terms.shape[1]) + random.normal(size=len(terms))
    shift = np.array([5.0, -3.0, 11.0])[points.block]
    plain = fit_surface(points.coded, values[:, None], region)
    days = Blocks(tuple("123"), points.block[:, None])
    blocked = fit_surface(points.coded, (values + shift)[:, None], region, blocks=days)
    assert np.allclose(blocked.coefficients[1:], plain.coefficients[1:])
    inverse = np.linalg.inv(blocked.model_matrix.T @ blocked.model_matrix)
    assert np.abs(inverse[1 : terms.shape[1], terms.shape[1] :]).max() < 1e-12


@pytest.mark.parametrize(
    "name, factors, options, message",
    [
        (
            "box-behnken",
            3,
            {"blocks": 2},
            "allowed: none, as no number of blocks is orthogonal for a Box–Behnken design of 3 factors",
        ),
        ("box-behnken", 4, {"blocks": 2}, "allowed: 3 for a Box–Behnken design of 4 factors"),
        ("central-composite", 3, {"blocks": 4}, r"design of 3 factors: 2, 3 \(the last block"),
        ("central-composite", 7, {"blocks": 4}, "design of 7 factors: 2, 3, 5, 9"),
        ("central-composite", 3, {"blocks": 2, "alpha": "face-centred"}, "blocks set the axial distance"),
        ("central-composite", 3, {"blocks": 2, "centre": 0}, "at least one centre run"),
        ("central-composite", 9, {"blocks": 2}, "made for 2 to 7 factors"),
    ],
)
def test_blocks_that_are_not_orthogonal_are_refused_by_name(name, factors, options, message):
    with pytest.raises(StatisticsError, match=message):
        DESIGNS[name].points(factors, DesignOptions(**options))
