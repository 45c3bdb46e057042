"""Central composite designs: published sizes, rotatability, and the region they keep to."""

import numpy as np
import pytest

from doe.analysis.surface import second_order_terms
from doe.designs import central_composite
from doe.errors import StatisticsError


@pytest.mark.parametrize(
    "factors, corners, alpha", [(2, 4, 1.414), (3, 8, 1.682), (4, 16, 2.0), (5, 16, 2.0), (6, 32, 2.378)]
)
def test_size_and_axial_distance_are_the_published_ones(factors, corners, alpha):
    """Myers, Montgomery and Anderson-Cook 2016, table 7.5 (k = 5, 6: half fraction)."""
    design = central_composite(factors, centre=6)
    assert design.shape == (corners + 2 * factors + 6, factors)
    assert np.abs(design).max() == pytest.approx(alpha, abs=5e-4)  # printed with three decimals


@pytest.mark.parametrize("factors", [2, 3, 4, 5])
def test_rotatable_design_predicts_equally_well_in_all_directions(factors):
    model = second_order_terms(central_composite(factors, centre=4))
    inverse = np.linalg.inv(model.T @ model)
    directions = np.random.default_rng(3).standard_normal((50, factors))
    points = second_order_terms(1.3 * directions / np.linalg.norm(directions, axis=1, keepdims=True))
    variance = np.einsum("ni,ij,nj->n", points, inverse, points)
    assert np.ptp(variance) < 1e-12 * variance.max() * 100  # rounding of the inverse


def test_face_centred_and_inscribed_stay_in_the_cube():
    for alpha in ("face-centred", "inscribed"):
        design = central_composite(3, 2, alpha)
        assert np.abs(design).max() == 1
    assert np.array_equal(np.unique(central_composite(3, 2, "face-centred")), [-1, 0, 1])
    rotatable = central_composite(3, 2, "rotatable")
    assert np.allclose(central_composite(3, 2, "inscribed") * np.abs(rotatable).max(), rotatable)


@pytest.mark.parametrize(
    "factors, centre, alpha", [(1, 5, "rotatable"), (8, 5, "rotatable"), (3, 0, "rotatable"), (3, 5, "x")]
)
def test_what_it_is_not_made_for_is_refused(factors, centre, alpha):
    with pytest.raises(StatisticsError):
        central_composite(factors, centre, alpha)
