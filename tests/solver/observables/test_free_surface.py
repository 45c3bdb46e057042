"""The free surface in a drum, on made-up beds whose slope is known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from solver.observables.free_surface import (
    column_places,
    dynamic_angle,
    slope,
    slope_angle_deg,
    slope_core,
    surface_heights,
    surface_profile,
    time_profile,
)
from solver.observables.silhouette import PIXEL
from solver.pours.record import FreeSurface, Spheres
from tests.solver.observables.made_up import empty_pile, record_of

RADIUS = 42e-3
BEAD = 1.2e-3


def bed(angle_deg, level=0.0, depth=10e-3, airborne=()):
    """Beads on a grid in a drum about (0, RADIUS), below the line through (0, level) that falls to the right."""
    rng = np.random.default_rng(0)
    axis = np.arange(-RADIUS, RADIUS, 0.8 * BEAD)
    x, z = (grid.ravel() for grid in np.meshgrid(axis, axis))
    # The beads' tops touch the line.
    line = level - np.tan(np.radians(angle_deg)) * x - BEAD / np.cos(np.radians(angle_deg))
    inside = (np.hypot(x, z) < RADIUS - BEAD) & (z <= line)
    on_line = np.arange(-0.9 * RADIUS, 0.9 * RADIUS, 0.1 * BEAD)
    top = level - np.tan(np.radians(angle_deg)) * on_line - BEAD / np.cos(np.radians(angle_deg))
    kept = np.hypot(on_line, top) < RADIUS - BEAD
    x = np.concatenate([x[inside], on_line[kept], [p[0] for p in airborne]])
    z = np.concatenate([z[inside], top[kept], [p[1] for p in airborne]]) + RADIUS
    y = rng.uniform(-depth / 2, depth / 2, x.size)
    return Spheres(np.column_stack([x, y, z]), np.full(x.size, BEAD), np.arange(x.size, dtype=np.int32))


def surface_of(heights, times=None):
    heights = np.atleast_2d(heights)
    times = np.arange(len(heights)) * 0.01 if times is None else times
    return FreeSurface(times, column_places(RADIUS), heights)


def record_with(surface):
    return dataclasses.replace(record_of(empty_pile(), np.array([0.0]), np.array([0.0]), 0.03), free_surface=surface)


@pytest.mark.parametrize("angle", [0.0, 20.0, 35.0, -25.0])
def test_a_sloped_bed_has_its_slope(angle):
    heights = surface_heights(bed(angle), RADIUS) - RADIUS
    x = column_places(RADIUS)
    # Whole pixels: half a pixel over a chord of 42 mm is 0.3°, and least squares over 168 columns averages it out.
    assert slope_angle_deg(x, heights, 0.5 * RADIUS) == pytest.approx(angle, abs=0.15)
    middle = np.abs(x) < 0.5 * RADIUS
    expected = -np.tan(np.radians(angle)) * x[middle]
    # Half a pixel, and the columns' width on a slope
    assert np.abs(heights[middle] - expected).max() < 1.5 * PIXEL


def test_the_place_of_a_column_is_where_the_bed_is():
    """A single sphere: its columns, and nothing but those."""
    x, radius = 7e-3, 3e-3
    sphere = Spheres(np.array([[x, 0.0, 20e-3]]), np.array([radius]), np.zeros(1, dtype=np.int32))
    heights = surface_heights(sphere, RADIUS)
    places = column_places(RADIUS)
    covered = np.isfinite(heights)
    assert np.array_equal(covered, np.abs(places - x) < radius)
    expected = 20e-3 + np.sqrt(radius**2 - (places[covered] - x) ** 2)
    assert np.abs(heights[covered] - expected).max() <= 0.51 * PIXEL


def test_bodies_in_the_air_are_no_surface():
    plain = surface_heights(bed(30.0), RADIUS)
    thrown = surface_heights(bed(30.0, airborne=((10e-3, 25e-3), (-2e-3, 30e-3))), RADIUS)
    assert np.array_equal(plain, thrown, equal_nan=True)


def test_no_bed_has_no_surface():
    nothing = Spheres(np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.int32))
    assert np.isnan(surface_heights(nothing, RADIUS)).all()
    none = record_of(empty_pile(), np.array([0.0]), np.array([0.0]), 0.03)
    assert all(np.isnan(found(none).value) for found in (dynamic_angle, slope, slope_core))
    assert surface_profile(none)[0].size == 0


def test_the_profile_is_where_the_averaged_image_is_half_grey():
    """A surface that flips between two levels: covered three times out of five, then two out of five."""
    high, low = np.full(2 * 168, 5e-3), np.full(2 * 168, -5e-3)
    assert time_profile(surface_of([high, low, high, low, high])) == pytest.approx(5e-3)
    assert time_profile(surface_of([high, low, low, low, high])) == pytest.approx(-5e-3)
    gone = np.full(2 * 168, np.nan)
    assert np.isnan(time_profile(surface_of([gone, gone, low]))).all()
    assert time_profile(surface_of([low, gone, low])) == pytest.approx(-5e-3)


def test_angles_of_an_s_shaped_surface_by_hand():
    """y = −x tan 40° within 10 mm, flatter outside: the core reads 40°, the whole chord less."""
    x = column_places(RADIUS)
    inner, outer = np.tan(np.radians(40.0)), np.tan(np.radians(20.0))
    y = np.where(np.abs(x) < 10e-3, -inner * x, -np.sign(x) * (inner * 10e-3 + outer * (np.abs(x) - 10e-3)))
    record = record_with(surface_of(np.tile(y, (10, 1))))
    assert slope_core(record).value == pytest.approx(40.0, abs=1e-9)
    assert 20.0 < slope(record).value < dynamic_angle(record).value < 40.0
    assert dynamic_angle(record).spread == pytest.approx(0.0, abs=1e-12)
    places, profile = surface_profile(record)
    assert np.abs(places).max() <= 0.6 * RADIUS
    assert profile == pytest.approx(y[np.abs(x) <= 0.6 * x.max()])


def test_the_spread_is_that_between_parts_of_the_time():
    """Five parts of two moments each, with slopes of 30, 31, … 34°: standard deviation √2.5."""
    x = column_places(RADIUS)
    heights = [-np.tan(np.radians(30.0 + k)) * x for k in range(5) for _ in range(2)]
    found = dynamic_angle(record_with(surface_of(heights)))
    assert found.value == pytest.approx(32.0, abs=1e-9)
    assert found.spread == pytest.approx(np.sqrt(2.5), abs=1e-9)
