"""Latin hypercube and Sobol' points by the properties that define them."""

import numpy as np
import pytest

from doe.designs import latin_hypercube, sobol
from doe.errors import StatisticsError


def test_latin_hypercube_has_one_point_in_every_slice_of_every_factor():
    design = latin_hypercube(4, 25, seed=7)
    slices = np.floor((design + 1) / 2 * 25).astype(int)
    for column in slices.T:
        assert sorted(column.tolist()) == list(range(25))


def test_sobol_points_of_a_power_of_two_are_balanced():
    """A (t, m, s)-net in base 2: every half, quarter, … of each factor holds its share."""
    design = sobol(3, 32, seed=7)
    for column in ((design + 1) / 2).T:
        for parts in (2, 4, 8, 16, 32):
            assert (np.bincount((column * parts).astype(int), minlength=parts) == 32 // parts).all()


@pytest.mark.parametrize("make", [latin_hypercube, sobol])
def test_points_repeat_by_their_seed_and_stay_in_the_cube(make):
    first, again, other = make(3, 10, 1), make(3, 10, 1), make(3, 10, 2)
    assert first.shape == (10, 3)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert (np.abs(first) <= 1).all()


@pytest.mark.parametrize("make", [latin_hypercube, sobol])
@pytest.mark.parametrize("factors, runs", [(0, 10), (3, 1)])
def test_too_few_factors_or_runs_are_refused(make, factors, runs):
    with pytest.raises(StatisticsError):
        make(factors, runs, 1)
