"""Features of a whole surface: made-up surfaces with known answers."""

import math

import numpy as np
import pytest

from solver import Spheres, coarsened, frame_of, height_map, profile_features, surface_features, without_holes
from solver.observables.surface import HeightMap
from solver.observables.surface_features import HISTOGRAM_NAMES, RINGS, SURFACE_NAMES, Frame

FRAME = Frame(radius=0.05, thickness=0.006)
PIXEL = 0.5e-3
SLOPE = 0.4


def made_up(height_of, frame=FRAME, pixel=PIXEL):
    """The map of heights ``height_of(x, y)``, as wide as ``frame`` asks for."""
    n = 2 * int(np.ceil(frame.half_width / pixel))
    axis = (np.arange(n) + 0.5 - n / 2) * pixel
    x, y = np.meshgrid(axis, axis, indexing="ij")
    return HeightMap(height_of(x, y), np.hypot(x, y), pixel)


def cone(x, y, centre=(0.0, 0.0), radius=0.06):
    return SLOPE * np.maximum(0.0, radius - np.hypot(x - centre[0], y - centre[1]))


def test_frame_is_a_cone_of_the_charge():
    """V = π R³ tan α / 3 at the packing: a cone of that radius holds the solid volume."""
    frame = frame_of(26e-6, 0.006)
    volume = math.pi * frame.radius**3 * math.tan(math.radians(25.0)) / 3.0
    assert volume * 0.6 == pytest.approx(26e-6)
    assert frame.places[0] == pytest.approx(0.1 * frame.radius)


def test_cone_has_its_volume_slope_and_rings():
    """Volume and mean heights of rings in closed form; the tolerances are those of square pixels in round rings."""
    found = surface_features(made_up(cone), FRAME)
    assert tuple(found) == SURFACE_NAMES
    assert found["ring_volume_m3"] == pytest.approx(math.pi * SLOPE * 0.06**3 / 3.0, rel=5e-3)
    # ∫ r (R − r) dr over ∫ r dr, r from 10 to 20 mm
    expected = SLOPE * (0.06 - (0.02**3 - 0.01**3) / 3.0 / ((0.02**2 - 0.01**2) / 2.0))
    assert found["ring_height_2_m"] == pytest.approx(expected, rel=5e-3)
    assert found["slope"] == pytest.approx(SLOPE, rel=1e-2)
    bare = 0.25 * FRAME.thickness / SLOPE
    assert found["covered_area_m2"] == pytest.approx(math.pi * (0.06 - bare) ** 2, rel=1e-2)
    # The area within r is covered to more than h = SLOPE (R − r): 10 % of it lie above the 0.9 quantile.
    radius = math.sqrt(0.1) * (0.06 - bare)
    assert found["height_q90_m"] == pytest.approx(SLOPE * (0.06 - radius), rel=1e-2)
    for name in ("skew_x_m", "skew_y_m", "inner_skew_x_m", "inner_skew_y_m"):
        assert abs(found[name]) < 1e-9


def test_a_pile_off_the_axis_is_skewed_by_its_offset():
    """Mean of x over the volume of a cone is where its axis stands."""
    found = surface_features(made_up(lambda x, y: cone(x, y, (0.006, -0.003), 0.05)), FRAME)
    assert found["skew_x_m"] == pytest.approx(0.006, rel=1e-3)
    assert found["skew_y_m"] == pytest.approx(-0.003, rel=1e-3)


def test_turning_a_surface_turns_its_skew_and_nothing_else():
    """A quarter turn moves (x, y) to (−y, x)."""
    rng = np.random.default_rng(3)
    surface = made_up(lambda x, y: cone(x, y, (0.004, 0.002)) + 1e-3 * rng.random(x.shape))
    before = surface_features(surface, FRAME)
    # Index (i, j) is (x, y): rot90 takes the value at (x, y) to (−y, x).
    after = surface_features(HeightMap(np.rot90(surface.height, -1).T[:, ::1].T, surface.radius, PIXEL), FRAME)
    turned = {"skew_x_m", "skew_y_m", "inner_skew_x_m", "inner_skew_y_m"}
    for name in SURFACE_NAMES:
        if name not in turned:
            assert after[name] == pytest.approx(before[name], rel=1e-9)
    assert math.hypot(after["skew_x_m"], after["skew_y_m"]) == pytest.approx(
        math.hypot(before["skew_x_m"], before["skew_y_m"])
    )


def test_bodies_that_lie_singly_show_their_height():
    """A layer of spheres of the thickness has all heights up to one thickness; larger ones reach beyond."""
    places = np.stack(np.meshgrid(np.arange(-4, 5), np.arange(-4, 5)), axis=-1).reshape(-1, 2) * 0.012
    radius = 0.5 * FRAME.thickness

    def shares(size):
        centre = np.column_stack([places, np.full(len(places), radius * size)])
        spheres = Spheres(centre, np.full(len(places), radius * size), np.arange(len(places)))
        found = surface_features(height_map(spheres, np.zeros(2), FRAME.half_width, PIXEL), FRAME)
        return [found[name] for name in HISTOGRAM_NAMES]

    assert sum(shares(1.0)[:2]) == pytest.approx(1.0)
    assert shares(1.2)[2] > 0.3


def test_an_empty_plate_has_zeros():
    found = surface_features(made_up(lambda x, y: 0.0 * x), FRAME)
    assert set(found.values()) == {0.0}


def test_holes_take_the_lowest_of_what_is_around_them():
    """On a cone within a pixel's slope of what stands there, and never above the highest around."""
    surface = made_up(cone)
    holed = surface.height.copy()
    holed[np.random.default_rng(0).random(holed.shape) < 0.1] = np.nan
    filled = without_holes(HeightMap(holed, surface.radius, PIXEL))
    assert np.isfinite(filled.height).all()
    # Of holes in one pixel of ten, runs of five in a row are the longest in 160 000 pixels.
    assert np.abs(filled.height - surface.height).max() < SLOPE * 6.0 * PIXEL
    assert without_holes(surface) is surface


def test_the_shadow_of_a_step_lies_on_the_plate():
    """A block 5 mm high whose shadow falls on the bare plate."""
    height = np.zeros((20, 20))
    height[5:10, 5:10] = 5e-3
    holed = height.copy()
    holed[10:14, 5:10] = np.nan
    surface = HeightMap(holed, np.zeros_like(height), PIXEL)
    assert np.array_equal(without_holes(surface).height, height)
    everything = HeightMap(np.full((4, 4), np.nan), np.zeros((4, 4)), PIXEL)
    assert (without_holes(everything).height == 0.0).all()


def test_a_table_of_heights_over_the_radius_gives_the_rings_of_a_map():
    found = surface_features(made_up(cone), FRAME)
    heights = np.array([found[f"ring_height_{k + 1}_m"] for k in range(RINGS)])
    rings = profile_features(heights, FRAME)
    assert rings == {name: found[name] for name in rings}


def test_a_coarsened_map_has_the_means_of_its_blocks_and_the_same_centre():
    """Means over 2 × 2 pixels, of what is known; a cone's volume and skew stay."""
    fine = made_up(cone)
    coarse = coarsened(fine, 2)
    assert coarse.height[0, 1] == pytest.approx(fine.height[0:2, 2:4].mean())
    assert coarse.radius.min() == pytest.approx(2.0 * fine.radius.min())
    one, other = surface_features(fine, FRAME), surface_features(coarse, FRAME)
    assert other["ring_volume_m3"] == pytest.approx(one["ring_volume_m3"], rel=5e-3)
    holed = fine.height.copy()
    holed[0, 2], holed[4:6, 4:6] = np.nan, np.nan
    found = coarsened(HeightMap(holed, fine.radius, PIXEL), 2).height
    assert found[0, 1] == pytest.approx(np.nanmean(holed[0:2, 2:4]))
    assert np.isnan(found[2, 2])
