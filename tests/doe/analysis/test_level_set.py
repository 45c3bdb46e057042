"""Extremes and nearest points of quadratics in the cube against closed forms and an independent optimiser."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import optimize

from doe.analysis.level_set import extremes, nearest_points
from doe.analysis.surface import second_order_terms

ONES = np.ones(3)


def random_models(count, seed):
    return np.random.default_rng(seed).normal(size=(count, 10))


def best_by_slsqp(coefficients, target, reference):
    """Return the least distance found by SLSQP from 27 starts."""
    lengths = []
    for start in np.stack(np.meshgrid(*[[-0.7, 0.0, 0.7]] * 3), axis=-1).reshape(-1, 3):
        result = optimize.minimize(
            lambda x: ((x - reference) ** 2).sum(),
            start,
            method="SLSQP",
            bounds=[(-1, 1)] * 3,
            constraints={"type": "eq", "fun": lambda x: second_order_terms(x) @ coefficients - target},
            options={"ftol": 1e-12},
        )
        if result.success and abs(second_order_terms(result.x) @ coefficients - target) < 1e-7:
            lengths.append(np.sqrt(result.fun))
    return min(lengths)


@given(st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_no_point_of_the_cube_lies_beyond_the_extremes(seed):
    models = random_models(5, seed)
    bounds = extremes(models, 3)
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, 11)] * 3), axis=-1).reshape(-1, 3)
    values = second_order_terms(grid) @ models.T
    assert (values >= bounds.low - 1e-9).all()
    assert (values <= bounds.high + 1e-9).all()
    assert np.einsum("mp,mp->m", second_order_terms(bounds.high_at), models) == pytest.approx(bounds.high)


def test_extremes_of_a_plane_are_corners():
    bounds = extremes(np.array([[20.0, 1, -2, 3, 0, 0, 0, 0, 0, 0]]), 3)
    assert (bounds.low[0], bounds.high[0]) == pytest.approx((14, 26))
    assert bounds.high_at[0] == pytest.approx([1, -1, 1])


def test_nearest_point_of_a_plane_is_its_foot():
    """x + 2 y + 2 z = 1.5 from the origin: foot at 1.5 (1, 2, 2)/9."""
    points, reached = nearest_points(np.array([[0.0, 1, 2, 2, 0, 0, 0, 0, 0, 0]]), 1.5, np.zeros(3), ONES)
    assert reached[0]
    assert points[0] == pytest.approx(1.5 * np.array([1, 2, 2]) / 9, abs=1e-5)


def test_nearest_point_of_a_plane_in_another_scale():
    """The foot minimises sum (x_i/s_i)^2, so it is proportional to s_i^2 n_i: here (1, 8, 2) x 1.5/21."""
    points, _ = nearest_points(
        np.array([[0.0, 1, 2, 2, 0, 0, 0, 0, 0, 0]]), 1.5, np.zeros(3), np.array([1.0, 2.0, 1.0])
    )
    assert points[0] == pytest.approx(np.array([1, 8, 2]) * 1.5 / 21, abs=1e-5)


def test_nearest_point_of_a_sphere_from_outside_the_cube():
    """|x|^2 = 0.25 seen from (3, 0, 0): (0.5, 0, 0)."""
    points, _ = nearest_points(np.array([[0.0, 0, 0, 0, 0, 0, 0, 1, 1, 1]]), 0.25, np.array([3.0, 0, 0]), ONES)
    assert points[0] == pytest.approx([0.5, 0, 0], abs=1e-5)


def test_a_surface_smaller_than_the_grid_is_found():
    """A bowl whose level set is a ball of radius 0.01 around (0.33, 0.33, 0.33), between all grid lines."""
    at = 0.33
    bowl = np.array([[3 * at**2, -2 * at, -2 * at, -2 * at, 0, 0, 0, 1, 1, 1]])
    points, reached = nearest_points(bowl, 1e-4, np.array([1.0, at, at]), ONES)
    assert reached[0]
    assert points[0] == pytest.approx([at + 0.01, at, at], abs=1e-4)


@pytest.mark.parametrize("seed", range(6))
def test_nearest_point_agrees_with_slsqp(seed):
    models = random_models(1, seed)
    reference = np.random.default_rng(100 + seed).uniform(-1.2, 1.2, 3)
    bounds = extremes(models, 3)
    target = float(0.7 * bounds.low[0] + 0.3 * bounds.high[0])
    points, reached = nearest_points(models, target, reference, ONES)
    assert reached[0]
    assert second_order_terms(points[0]) @ models[0] == pytest.approx(target, abs=1e-9)
    # The distance is flat at its minimum, so 1e-6 in the point is far less in the distance.
    assert np.linalg.norm(points[0] - reference) <= best_by_slsqp(models[0], target, reference) + 1e-6


def test_an_unreachable_target_gives_the_nearest_extreme():
    plane = np.array([[20.0, 1, -2, 3, 0, 0, 0, 0, 0, 0]])
    points, reached = nearest_points(plane, 40.0, np.zeros(3), ONES)
    assert not reached[0]
    assert points[0] == pytest.approx([1, -1, 1])
