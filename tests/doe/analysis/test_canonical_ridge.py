"""Ridge analysis against brute force on the sphere, closed forms, and the singular case."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from doe.analysis.canonical import highest_on_sphere, ridge_analysis
from doe.analysis.surface import fit_surface
from tests.doe.analysis.textbook import YIELD, YIELD_POINTS, YIELD_REGION

ANGLES = np.linspace(0, 2 * np.pi, 20001)


def value(b, matrix, x):
    return x @ b + np.einsum("...i,ij,...j->...", x, matrix, x)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(st.floats(-3, 3).map(lambda v: round(v, 3)), min_size=5, max_size=5), st.floats(0.1, 3))
def test_highest_point_is_that_of_a_search_around_the_circle(numbers, radius):
    b = np.array(numbers[:2])
    matrix = np.array([[numbers[2], numbers[3]], [numbers[3], numbers[4]]])
    x = highest_on_sphere(b, matrix, radius)
    circle = radius * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
    best = value(b, matrix, circle).max()
    assert np.linalg.norm(x) == pytest.approx(radius, rel=1e-9)
    # The search misses the top by its step: curvature × (step/2)², below 1e-6 of the size of the terms.
    assert value(b, matrix, x) >= best - 1e-9 * (1 + abs(best))
    assert value(b, matrix, x) <= best + 1e-6 * (1 + np.abs(b).sum() * radius + np.abs(matrix).sum() * radius**2)


def test_first_order_model_goes_along_its_gradient():
    x = highest_on_sphere(np.array([3.0, -4.0]), np.zeros((2, 2)), 2.0)
    assert x == pytest.approx([1.2, -1.6], abs=1e-12)


def test_without_a_pull_along_the_steepest_axis_the_path_turns_into_it():
    """y = x1 + 2 x2²: to |x1| = 1/4 along x1 (μ = 2), then along ±x2."""
    b, matrix = np.array([1.0, 0.0]), np.diag([0.0, 2.0])
    x = highest_on_sphere(b, matrix, 1.0)
    assert x[0] == pytest.approx(0.25, abs=1e-9)
    assert abs(x[1]) == pytest.approx(np.sqrt(1 - 0.0625), abs=1e-9)


def test_path_leaves_the_centre_and_passes_the_stationary_maximum():
    """Montgomery 2017, section 11.2: maximum 80.21 at (0.389, 0.306), 0.495 from the centre."""
    surface = fit_surface(YIELD_POINTS, YIELD, YIELD_REGION)
    highest, lowest = ridge_analysis(surface, furthest=0.4949)
    assert not highest.coded[0].any()
    assert highest.coded[-1] == pytest.approx([0.389, 0.306], abs=2e-3)
    assert highest.predicted[-1] == pytest.approx(80.21, abs=5e-3)
    assert (np.diff(highest.predicted) > 0).all()
    assert (np.diff(lowest.predicted) < 0).all()
    assert highest.natural[0] == pytest.approx([85, 175])


def test_path_ends_at_the_furthest_run():
    highest, _ = ridge_analysis(fit_surface(YIELD_POINTS, YIELD, YIELD_REGION))
    assert highest.radius[-1] == pytest.approx(np.sqrt(2), abs=1e-3)
