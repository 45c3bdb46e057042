"""Sums over cells: against the sum over every node, and the integral of a Gaussian."""

import math

import numpy as np
import pytest
from scipy.special import logsumexp

from doe.analysis.cells import CELL, NEGLIGIBLE, SMOOTH, parted_cells

NODES = 6 * CELL


def gaussian(widths, centre, correlation=0.0):
    """Log density of a Gaussian on a grid, ``widths`` in nodes, and a count of the nodes at which it was asked for."""
    inverse = np.linalg.inv([[1.0, correlation], [correlation, 1.0]])
    asked = []

    def density(i, j, size):
        asked.append(len(i))
        off = np.stack([(i - centre[0]) / widths[0], (j - centre[1]) / widths[1]])
        return -0.5 * np.einsum("an,ab,bn->n", off, inverse, off)

    return density, asked


def summed(cells):
    return float(logsumexp(cells.logs + cells.share))


@pytest.mark.parametrize("widths", [(0.6, 0.8), (0.7, 12.0), (2.0, 3.0), (15.0, 15.0)])
@pytest.mark.parametrize("correlation", [0.0, 0.8])
@pytest.mark.parametrize("centre", [(22.4, 30.9), (27.0, 27.0), (8.5, 44.3)])
def test_the_sum_is_that_over_every_node(widths, correlation, centre):
    density, asked = gaussian(widths, centre, correlation)
    changes = [np.full(NODES, 1.0 / width) for width in widths]
    everywhere = np.ones(NODES, bool)
    cells = parted_cells(density, changes, [everywhere] * 2)
    i, j = (grid.reshape(-1) for grid in np.meshgrid(np.arange(NODES), np.arange(NODES)))
    every = density(i, j, 1)
    # Cells of SMOOTH deviations are off by 0.23 along either axis at most, and wider ones are parted.
    assert summed(cells) == pytest.approx(logsumexp(every) - math.log(NODES**2), abs=0.25)
    assert np.exp(cells.share).sum() == pytest.approx(1.0)
    # The largest is found, of all nodes.
    assert cells.logs.max() == pytest.approx(every.max(), abs=1e-12)
    assert sum(asked[:-1]) < 0.5 * NODES**2


def test_a_smooth_density_is_summed_by_the_middles_of_the_first_cells():
    density, asked = gaussian((40.0, 40.0), (20.0, 30.0))
    parted_cells(density, [np.full(NODES, 1.0 / 40.0)] * 2, [np.ones(NODES, bool)] * 2)
    # One cell is parted twice, for the largest.
    assert asked == [(NODES // CELL) ** 2, 9, 9]


def test_nodes_that_do_not_count_are_left_out():
    density, _ = gaussian((0.7, 0.7), (10.0, 40.0))
    counted = [np.arange(NODES) >= 20, np.ones(NODES, bool)]
    cells = parted_cells(density, [np.full(NODES, 1.0 / 0.7)] * 2, counted)
    assert np.exp(cells.share).sum() == pytest.approx(1.0)
    assert (cells.first >= 20)[cells.logs > cells.logs.max() - NEGLIGIBLE].all()


def test_what_does_not_come_up_to_the_floor_stays_coarse():
    density, asked = gaussian((0.7, 0.7), (10.0, 40.0))
    parted_cells(density, [np.full(NODES, 1.0 / 0.7)] * 2, [np.ones(NODES, bool)] * 2, floor=500.0)
    assert asked == [(NODES // CELL) ** 2]


def test_smooth_is_what_the_summation_formula_says():
    """Σ h φ(x + k h) = 1 + 2 Σ exp(−2π² m²/h²) cos(2π m x/h) for a standard Gaussian φ and steps h."""
    k = np.arange(-50, 51)
    sums = [
        SMOOTH * np.exp(-0.5 * (x + k * SMOOTH) ** 2).sum() / math.sqrt(2.0 * math.pi)
        for x in np.linspace(0.0, SMOOTH, 30)
    ]
    assert max(abs(one - 1.0) for one in sums) == pytest.approx(2.0 * math.exp(-2.0 * math.pi**2 / SMOOTH**2), rel=0.01)
