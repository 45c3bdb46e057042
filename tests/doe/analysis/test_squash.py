"""Compression of tails: the middle stays, rare large values are drawn in."""

import numpy as np
import pytest

from doe.analysis.squash import SQUASH, Squash, squash_of


def test_a_rare_large_count_is_drawn_in():
    squash = Squash(np.zeros(1), np.ones(1))
    small, large = squash(np.array([[0.1]])), squash(np.array([[100.0]]))
    assert small[0, 0] == pytest.approx(0.1, rel=1e-3)
    assert large[0, 0] == pytest.approx(SQUASH * np.arcsinh(100.0 / SQUASH))


def test_what_is_compressed_can_be_undone():
    squash, values = Squash(np.array([1.0, -2.0]), np.array([0.5, 4.0])), np.array([[0.3, 9.0], [400.0, -2.0]])
    assert squash.undone(squash(values)) == pytest.approx(values)


def test_its_slope_is_its_derivative():
    squash = Squash(np.array([1.0, -2.0]), np.array([0.5, 4.0]))
    x, step = np.array([[0.3, 9.0], [40.0, -2.0]]), 1e-6
    assert squash.slope(x) == pytest.approx((squash(x + step) - squash(x - step)) / (2.0 * step), rel=1e-6)


def test_centre_and_deviation_are_those_of_the_pours_that_are_still():
    """Two groups at 0 and 100 that scatter by ± 1: the centre is that of the first, the deviation has neither in it."""
    values = np.array([-1.0, 1.0, -1.0, 1.0, 99.0, 101.0, 99.0, 101.0])[:, None]
    group = np.repeat([0, 1], 4)
    squash = squash_of(values, group, np.zeros((8, 0)), group == 0)
    assert squash.centre == pytest.approx([0.0])
    assert squash.deviation == pytest.approx([np.sqrt(4.0 / 3.0)])
