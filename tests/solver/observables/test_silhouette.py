"""Silhouettes: closed forms for one sphere, symmetries for random piles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.observables.silhouette import PIXEL, column_tops, largest_part, silhouette
from solver.pours.record import Spheres
from tests.solver.observables.made_up import balls, empty_pile, moved


def scattered(seed: int, n: int = 30) -> Spheres:
    rng = np.random.default_rng(seed)
    return balls(rng.uniform([-0.03, -0.03, 0.003], [0.03, 0.03, 0.02], (n, 3))).spheres


def test_a_sphere_is_a_disc_of_its_area():
    image = silhouette(balls(np.array([[0.01, -0.02, 0.012]]), radius=0.01).spheres, 30.0)
    # Pixel centres inside a circle miss its area by less than one pixel per pixel of the outline (here far
    # less).
    assert image.sum() * PIXEL**2 == pytest.approx(np.pi * 0.01**2, rel=2e-3)
    assert column_tops(image).max() * PIXEL == pytest.approx(0.022, abs=PIXEL)
    assert not image[: int(0.0019 / PIXEL)].any()


def test_every_pixel_obeys_the_rule():
    spheres = scattered(1, n=8)
    image = silhouette(spheres, 40.0)
    angle = np.radians(40.0)
    u = spheres.centre @ [np.cos(angle), np.sin(angle), 0.0] / PIXEL
    z, radius = spheres.centre[:, 2] / PIXEL, spheres.radius / PIXEL
    u -= np.floor((u - radius).min())
    row, column = np.indices(image.shape) + 0.5
    expected = ((row[..., None] - z) ** 2 + (column[..., None] - u) ** 2 <= radius**2).any(axis=-1)
    np.testing.assert_array_equal(image, expected)


def test_azimuth_0_has_positive_x_on_the_right_and_azimuth_90_positive_y():
    low_and_high = np.array([[0.0, 0.0, 0.003], [0.02, 0.0, 0.013]])
    tops = column_tops(silhouette(balls(low_and_high).spheres, 0.0))
    assert tops[-10] > tops[10]
    tops = column_tops(silhouette(balls(low_and_high[:, [1, 0, 2]]).spheres, 90.0))
    assert tops[-10] > tops[10]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 15.0, 90.0]))
def test_opposite_views_are_mirror_images(seed, azimuth):
    spheres = scattered(seed, n=6)
    front, back = silhouette(spheres, azimuth), silhouette(spheres, azimuth + 180.0)
    # The grids of the two views start at different fractions of a pixel, so outlines differ by up to one
    # pixel.
    assert column_tops(front).max() == pytest.approx(column_tops(back).max(), abs=1)
    assert front.sum() == pytest.approx(back.sum(), rel=0.01)


def test_scaling_pile_and_pixel_by_two_gives_the_same_image():
    pile = balls(scattered(2).centre)
    doubled = moved(pile, scale=2.0)
    np.testing.assert_array_equal(silhouette(pile.spheres, 15.0), silhouette(doubled.spheres, 15.0, pixel=2.0 * PIXEL))


def test_the_order_of_the_spheres_does_not_matter():
    spheres = scattered(3)
    order = np.random.default_rng(0).permutation(spheres.radius.size)
    shuffled = Spheres(spheres.centre[order], spheres.radius[order], spheres.body[order])
    np.testing.assert_array_equal(silhouette(spheres, 75.0), silhouette(shuffled, 75.0))


def test_what_is_below_the_plate_is_cut_off():
    whole = silhouette(balls(np.array([[0.0, 0.0, 0.0]]), radius=0.01).spheres, 0.0)
    assert whole.sum() * PIXEL**2 == pytest.approx(np.pi * 0.01**2 / 2, rel=5e-3)  # outline of pixels


def test_largest_part_keeps_the_larger_of_two_and_joins_diagonal_neighbours():
    image = np.array([[1, 0, 0, 1, 1], [0, 1, 0, 0, 0], [1, 0, 0, 1, 0]], dtype=bool)
    expected = np.array([[1, 0, 0, 0, 0], [0, 1, 0, 0, 0], [1, 0, 0, 0, 0]], dtype=bool)
    np.testing.assert_array_equal(largest_part(image), expected)


def test_column_tops_count_from_the_plate_over_gaps():
    image = np.array([[1, 0, 0], [0, 0, 1], [1, 0, 0]], dtype=bool)
    assert column_tops(image).tolist() == [3, 0, 2]


def test_nothing_gives_an_empty_image():
    image = silhouette(empty_pile().spheres, 0.0)
    assert image.shape == (0, 0)
    assert largest_part(image).shape == (0, 0)
    assert column_tops(image).size == 0
