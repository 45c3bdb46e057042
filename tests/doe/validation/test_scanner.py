"""The made-up scanner against geometry, and its files read like anybody's."""

import numpy as np
import pytest

from doe.measurement.scans import ScanSettings, read_scan
from doe.validation.scanner import Scanner, ScannerRanges, tops, write_scan
from solver import checked

BALL = (np.array([[0.004, -0.002, 0.01]]), np.array([0.01]))
STRAIGHT_DOWN = np.pi / 2 - 1e-6


def scanner(**changes):
    settings = {"grid": 1e-3, "noise": 1e-9, "axis_x": 0.0, "axis_y": 0.0, "elevation": STRAIGHT_DOWN, "azimuth": 0.0}
    return Scanner(**(settings | changes))


def test_the_top_of_a_sphere_is_its_cap():
    x = np.linspace(-0.02, 0.02, 81)
    height = tops(*BALL, x, x)
    distance = np.hypot(x[:, None] - 0.004, x[None, :] + 0.002)
    inside = distance < 0.01
    np.testing.assert_allclose(height[inside], 0.01 + np.sqrt(0.01**2 - distance[inside] ** 2), atol=1e-12)
    assert (height[distance > 0.01 + 1e-9] == 0.0).all()


def test_of_two_spheres_the_higher_is_seen():
    x = np.array([0.0, 0.05])
    assert tops(np.array([[0, 0, 0.01], [0, 0, 0.03]]), np.array([0.01, 0.01]), x, x)[0, 0] == pytest.approx(0.04)


def test_noise_is_as_large_as_it_says():
    scan = scanner(noise=2e-4).scan(*BALL, np.random.default_rng(0))
    far = np.hypot(scan["x"][:, None] - 0.004, scan["y"][None, :] + 0.002) > 0.012
    plate = scan["height"][far]
    plate = plate[np.isfinite(plate)]
    # A thousand nodes: three standard errors of a deviation.
    assert plate.std() == pytest.approx(2e-4, rel=3.0 / np.sqrt(2.0 * plate.size))


def test_a_camera_aslant_leaves_a_shadow_behind_the_pile():
    """A ball of 20 mm seen from +x at 45°: hidden is the plate on the far side, as far as the ball is high."""
    rng = np.random.default_rng(3)
    scan = scanner(elevation=np.radians(45.0)).scan(np.array([[0.0, 0.0, 0.01]]), np.array([0.01]), rng)
    missing = np.isnan(scan["height"])
    x, y = np.meshgrid(scan["x"], scan["y"], indexing="ij")
    behind = (np.abs(y) < 0.004) & (x > -0.016) & (x < -0.0115)
    before = (np.abs(y) < 0.004) & (x > 0.0115)
    assert missing[behind].mean() > 0.95
    assert missing[before].mean() < 0.3


def test_a_scanner_stays_on_the_bench_under_which_a_rig_is_turned():
    """In the turned rig's frame the pile is turned, and so are the error of the axis and the shadow."""
    one = scanner(axis_x=0.002, axis_y=-0.001, elevation=np.radians(45.0), azimuth=0.5)
    sign = np.array([-1.0, -1.0, 1.0])
    places = []
    for own, centre in ((one, BALL[0]), (one.of_turned_rig(), BALL[0] * sign)):
        scan = own.scan(centre, BALL[1], np.random.default_rng(3))
        x, y = np.meshgrid(scan["x"], scan["y"], indexing="ij")
        high = np.nan_to_num(scan["height"])
        top = np.array([(one * high).sum() / high.sum() for one in (x, y)])
        near = np.isnan(scan["height"]) & (np.hypot(x - top[0], y - top[1]) < 0.018)
        places.append((top, np.array([x[near].mean(), y[near].mean()])))
    for as_it_is, turned in zip(*places, strict=True):
        # Half a node.
        assert turned == pytest.approx(-as_it_is, abs=0.5e-3)
    assert np.hypot(*(places[0][0] - [0.006, -0.003])) < 1.5e-3


def test_scanners_differ_within_what_may_be_bought():
    drawn = [Scanner.drawn(np.random.default_rng(k)) for k in range(40)]
    ranges = ScannerRanges()
    assert {one.grid for one in drawn} == set(ranges.grid)
    assert all(ranges.noise[0] <= one.noise <= ranges.noise[1] for one in drawn)
    assert all(ranges.axis_off[0] <= np.hypot(one.axis_x, one.axis_y) <= ranges.axis_off[1] for one in drawn)
    assert Scanner.drawn(np.random.default_rng(7)) == drawn[7]


def test_its_file_is_read_like_anybodys_and_its_axis_is_off(tmp_path):
    used = scanner(axis_x=1.5e-3, axis_y=-1.0e-3)
    write_scan(tmp_path / "low_1.npz", used.scan(*BALL, np.random.default_rng(1)))
    settings = checked(ScanSettings, used.table(), "scan")
    scan = read_scan(tmp_path / "low_1.npz", settings)
    assert scan.axis is not None
    assert scan.grid == pytest.approx(1e-3)
    # The summit of the ball, displaced by what the laboratory takes for its axis; nodes are 1 mm apart.
    top = scan.points[scan.points[:, 2].argmax()]
    assert top[:2] == pytest.approx([0.0055, -0.003], abs=0.8e-3)
    assert top[2] == pytest.approx(0.02, abs=1e-4)
