"""What a scan was seen through: shadows by geometry, and the camera found again from them."""

import math

import numpy as np
import pytest

from doe.measurement.sight import PERFECT, Sight, found_sight, hidden, seen_through
from solver import HeightMap, without_holes

PIXEL = 1e-3
N = 80


def surface(height):
    axis = (np.arange(height.shape[0]) + 0.5 - height.shape[0] / 2) * PIXEL
    return HeightMap(height, np.hypot(axis[:, None], axis[None, :]), PIXEL)


def grains(seed, number=60):
    """Balls of 3 mm on a plate."""
    rng = np.random.default_rng(seed)
    x = (np.arange(N) + 0.5 - N / 2) * PIXEL
    height = np.zeros((N, N))
    for cx, cy in rng.uniform(-0.03, 0.03, (number, 2)):
        square = 9e-6 - (x[:, None] - cx) ** 2 - (x[None, :] - cy) ** 2
        height = np.maximum(height, np.where(square > 0.0, 3e-3 + np.sqrt(np.maximum(square, 0.0)), 0.0))
    return surface(height)


def test_a_wall_hides_what_is_behind_it_as_far_as_it_is_high():
    """A wall of 10 mm, seen from +x at 45°: ten pixels on its far side are hidden, and none before it."""
    height = np.zeros((N, N))
    height[40] = 10e-3
    shadow = hidden(surface(height), Sight(0.0, math.radians(45.0)))
    assert shadow[31:40].all()
    assert not shadow[:30].any()
    assert not shadow[40:].any()


@pytest.mark.parametrize(("azimuth", "axis", "away"), [(0.0, 0, -1), (90.0, 1, -1), (180.0, 0, 1), (270.0, 1, 1)])
def test_the_shadow_falls_away_from_the_camera(azimuth, axis, away):
    """A post of one pixel, 5 mm high, at 45°: five pixels beyond it, seen from +x, +y, −x and −y; rows are x."""
    height = np.zeros((N, N))
    height[40, 40] = 5e-3
    shadow = hidden(surface(height), Sight(math.radians(azimuth), math.radians(45.0)))
    line = shadow[:, 40] if axis == 0 else shadow[40]
    near = np.flatnonzero(line) - 40
    # A place that is exactly as far as the post is high may be either.
    assert set(away * near) in ({1, 2, 3, 4}, {1, 2, 3, 4, 5})
    assert shadow.sum() == line.sum()


def test_from_right_above_nothing_is_hidden():
    assert not hidden(grains(0), PERFECT).any()
    assert seen_through(grains(0), PERFECT).height is not None


def test_noise_is_as_large_as_stated_and_the_same_every_time():
    map_ = surface(np.zeros((N, N)))
    one, other = (seen_through(map_, Sight(noise=2e-4)).height for _ in range(2))
    assert np.array_equal(one, other)
    assert one.std() == pytest.approx(2e-4, rel=0.05)


@pytest.mark.parametrize(("azimuth", "elevation"), [(30.0, 50.0), (195.0, 60.0), (300.0, 70.0)])
def test_the_camera_is_found_from_its_shadows(azimuth, elevation):
    """To the steps that are tried, beside noise and patches where nothing was seen; from high above, where shadows are
    a pixel long, to two of them.
    """
    rng = np.random.default_rng(1)
    truth = Sight(math.radians(azimuth), math.radians(elevation))
    scans = []
    for seed in range(3):
        seen = seen_through(grains(seed), truth).height + 1e-4 * rng.standard_normal((N, N))
        seen[10:14, 20:24] = np.nan
        scans.append(surface(seen))
    found = found_sight(scans, 1e-4)
    assert math.degrees(found.azimuth) == pytest.approx(azimuth, abs=15.1 if elevation < 65.0 else 30.1)
    assert math.degrees(found.elevation) == pytest.approx(elevation, abs=5.1)
    assert found.noise == 1e-4


def test_holes_at_random_are_no_shadow():
    height = grains(0).height.copy()
    height[np.random.default_rng(2).random(height.shape) < 0.05] = np.nan
    assert found_sight([surface(height)], 0.0) == PERFECT
    assert found_sight([grains(0)], 0.0) == PERFECT


def test_the_bias_of_a_sight_is_that_of_other_piles_of_the_kind():
    """What shadows do to the roughness of one dozen of maps they do to another: so it can be taken off."""
    truth = Sight(math.radians(45.0), math.radians(55.0))

    def biases(seeds):
        maps = [grains(seed) for seed in seeds]
        return np.array([without_holes(seen_through(m, truth)).height.std() - m.height.std() for m in maps])

    one, other = biases(range(12)), biases(range(12, 24))
    errors = [some.std(ddof=1) / np.sqrt(12.0) for some in (one, other)]
    assert abs(one.mean()) > 4.0 * errors[0]
    assert abs(one.mean() - other.mean()) < 4.0 * np.hypot(*errors)
