"""Mass on the plate: radii, centroid, strays, height profile, thickness."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solver.observables.packing import bulk_density, solid_fraction
from solver.observables.pile import (
    centroid_x,
    centroid_y,
    footprint_r50,
    footprint_r90,
    height_profile,
    stray_fraction,
)
from solver.observables.reading import PileReading
from solver.observables.surface import body_thickness, body_thicknesses, radius_holding
from solver.pours.record import Spheres
from tests.solver.observables.made_up import (
    SEED_AXES,
    balls,
    cone,
    empty_pile,
    joined,
    moved,
    record_of,
    seeds_in_cone,
    solid_of,
)


def test_a_uniform_disc_holds_a_share_within_its_root():
    n = 20_000
    radius = 0.05 * np.sqrt((np.arange(n) + 0.5) / n)
    golden = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(n)
    pile = balls(np.stack([radius * np.cos(golden), radius * np.sin(golden), np.full(n, 3e-3)], axis=1))
    # r(share) = R √share; the spiral's centroid is off by O(R / n).
    assert footprint_r50(PileReading(pile)).value == pytest.approx(0.05 * np.sqrt(0.5), rel=1e-4)
    assert footprint_r90(PileReading(pile)).value == pytest.approx(0.05 * np.sqrt(0.9), rel=1e-4)


def test_equal_masses_give_hazens_quantile():
    radius = np.random.default_rng(0).exponential(size=37)
    for share in (0.1, 0.5, 0.9):
        expected = np.quantile(radius, share, method="hazen")  # independent: NumPy
        assert radius_holding(share, radius, np.full(37, 0.2)) == pytest.approx(expected, rel=1e-12)


# Taichi, once started in the process, flushes subnormal numbers to zero; no pile is that small.
RADII = st.just(0.0) | st.floats(1e-9, 1)


@given(st.lists(st.tuples(RADII, st.floats(0.1, 10)), min_size=1, max_size=20))
def test_radii_grow_with_the_share_and_stay_within_the_pile(bodies):
    radius, mass = np.array(bodies).T
    found = [radius_holding(share, radius, mass) for share in (0.0, 0.1, 0.5, 0.9, 1.0)]
    assert found == sorted(found)
    assert (found[0], found[-1]) == (radius.min(), radius.max())


def test_the_centroid_is_weighted_by_mass_and_relative_to_the_axis():
    pile = balls(np.array([[0.0, 0.0, 0.003], [0.04, 0.08, 0.003]]))
    pile = type(pile)(pile.spheres, pile.position, np.array([3.0, 1.0]), pile.component, ("a",), axis=(0.01, -0.02))
    assert centroid_x(PileReading(pile)).value == pytest.approx(0.00, abs=1e-15)
    assert centroid_y(PileReading(pile)).value == pytest.approx(0.04, rel=1e-12)


def test_strays_are_what_lies_beyond_twice_r50():
    ring = np.radians(np.arange(0.0, 360.0, 36.0))
    near = balls(np.stack([0.02 * np.cos(ring), 0.02 * np.sin(ring), np.full(10, 3e-3)], axis=1))
    far = balls(np.array([[0.1, 0.0, 3e-3], [-0.1, 0.0, 3e-3]]))
    assert stray_fraction(PileReading(near)).value == 0.0
    assert stray_fraction(PileReading(joined(near, far))).value == pytest.approx(2 / 12, rel=1e-12)


def test_the_profile_of_a_cone_is_its_line():
    radius, height = height_profile(PileReading(cone(25.0)))
    # The mean distance of a ring's area is not its middle radius r but r + w²/(12 r).
    expected = 0.03 - np.tan(np.radians(25.0)) * (radius + 5e-3**2 / (12 * radius))
    inner = (radius > 0.005) & (expected > 0.003)
    # Hollows between the tiling spheres: 0.16 mm.
    np.testing.assert_allclose(height[inner], expected[inner], atol=0.2e-3)
    assert (height[radius > 0.07] == 0.0).all()


def test_the_profile_of_one_ball_holds_its_volume():
    pile = balls(np.array([[0.02, 0.01, 0.004]]), radius=0.004)
    radius, height = height_profile(PileReading(pile), ring_width=1e-3, rings=10)
    volume = (2 * np.pi * radius * 1e-3 * height).sum()
    # A cylinder of height r plus a half ball, r = 4 mm: π r³ (1 + 2/3); pixels of 1/8 mm.
    assert volume == pytest.approx(np.pi * 0.004**3 * 5 / 3, rel=0.02)


def test_the_thickness_of_seeds_is_their_shortest_axis():
    pile = seeds_in_cone(25.0, 20, np.random.default_rng(1), reach=1.0)
    assert body_thickness(pile) == pytest.approx(SEED_AXES[2], rel=1e-9)
    assert body_thickness(balls(np.eye(3) * 0.01)) == pytest.approx(6e-3, rel=1e-12)


def turned_clumps(centres, number=40, radius=1e-3):
    """Clumps of spheres at ``centres`` [radii], each turned at random, side by side."""
    turns = Rotation.random(number, random_state=3).as_matrix()
    place = np.column_stack([np.arange(number) * 0.05, np.zeros(number), np.full(number, 0.05)])
    where = (radius * np.einsum("bij,mj->bmi", turns, centres) + place[:, None]).reshape(-1, 3)
    return Spheres(where, np.full(len(where), radius), np.repeat(np.arange(number), len(centres)))


@pytest.mark.parametrize(
    ("shape", "thickness"),
    [
        ([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], 4.0),
        ([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-3, -1, 1, 3)], 4.0),
        ([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], 4.0),
        ([[-1, 0, 0], [1, 0, 0]], 2.0),
        ([[-1, -1, 0], [-1, 1, 0], [1, -1, 0], [1, 1, 0]], 2.0),
    ],
    ids=["cube", "square bar", "tetrahedron, between two edges", "dumbbell", "square plate"],
)
def test_the_thickness_of_shapes_with_equal_axes_does_not_depend_on_how_they_lie(shape, thickness):
    spheres = turned_clumps(np.array(shape, dtype=float))
    number = int(spheres.body[-1]) + 1
    pile = dataclasses.replace(balls(np.eye(3) * 0.01), spheres=spheres, mass=np.ones(number))
    assert body_thicknesses(pile) == pytest.approx(np.full(number, thickness * 1e-3), rel=1e-9)


def test_bulk_density_and_solid_fraction_of_a_block():
    # A homogeneous block 20 mm high; its columns' masses are numerically their heights [m] per 0.64 mm².
    block = solid_of(lambda x, y: np.where(np.hypot(x, y) < 0.05, 0.02, 0.0), 0.05)
    density = 1.0 / 0.8e-3**2
    # Grids of 0.8 mm (bodies) and 0.66 mm (map) over a disc of 35 mm radius, hollows of 0.16 mm in 20.
    assert bulk_density(PileReading(block)).value == pytest.approx(density, rel=0.02)
    record = record_of(block, np.array([0.0, 1.0]), np.array([0.0, 1.0]), 1.0)
    assert solid_fraction(record).value == pytest.approx(density / 500.0, rel=0.02)


def test_one_body_and_no_body():
    one = PileReading(balls(np.array([[0.01, 0.02, 0.003]])))
    assert stray_fraction(one).value == 0.0
    assert footprint_r50(one).value == pytest.approx(0.0, abs=1e-15)
    assert np.isnan(bulk_density(one).value)
    none = PileReading(empty_pile())
    for observable in (footprint_r50, footprint_r90, centroid_x, centroid_y, stray_fraction, bulk_density):
        assert np.isnan(observable(none).value)
    assert np.isnan(height_profile(none)[1]).all()
    assert np.isnan(body_thickness(empty_pile()))


def test_a_stack_has_no_surface():
    # Its radii are rounding errors; a map scaled by them would have no end.
    stack = PileReading(balls(np.array([[0.1, 0.2, z] for z in (0.003, 0.009, 0.015)])))
    assert stack.surface is None
    assert np.isnan(bulk_density(stack).value)


def test_radii_do_not_depend_on_place_and_grow_with_scale():
    pile = seeds_in_cone(25.0, 80, np.random.default_rng(2), reach=0.0)
    before = PileReading(pile)
    after = PileReading(moved(pile, 20.0, 2.0, (0.3, -0.1)))
    assert footprint_r50(after).value == pytest.approx(2 * footprint_r50(before).value, rel=1e-9)
    assert stray_fraction(after).value == pytest.approx(stray_fraction(before).value, rel=1e-12)
