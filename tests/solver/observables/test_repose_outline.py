"""What is drawn is what is measured: outline and flank lines against hand computations and the angles."""

import numpy as np
import pytest

from solver.observables.reading import PileReading
from solver.observables.repose import flank_angles_deg, flank_lines, outline
from solver.observables.silhouette import PIXEL
from solver.pours.record import Spheres
from tests.solver.observables.made_up import cone, moved, oblique_cone


def image(*tops):
    return np.arange(max(tops))[:, None] < np.array(tops)[None, :]


def test_a_flank_line_ends_over_the_columns_of_its_window():
    # Tops 8, 1, 2 in columns 1, 2, 3 (see test_repose): mean 11/3, slope 3, so 11/3 ± 3 at the middles of 1 and 3.
    _, right = flank_lines(image(10, 8, 1, 2, 1), pixel=1.0)
    assert right.u == (1.5, 3.5)
    assert right.z == pytest.approx((11 / 3 + 3, 11 / 3 - 3), rel=1e-12)
    left, _ = flank_lines(image(1, 2, 1, 8, 10), pixel=1.0)
    assert left.u == (3.5, 1.5)
    assert left.z == right.z


def test_the_angles_are_those_of_the_lines():
    tops = (1, 2, 5, 9, 10, 7, 3, 3, 2)
    assert [line.angle_deg for line in flank_lines(image(*tops), 1.0)] == list(flank_angles_deg(image(*tops), 1.0))


def test_the_outline_of_one_ball_is_where_the_ball_is():
    ball = Spheres(np.array([[0.03, 0.01, 0.005]]), np.array([0.004]), np.zeros(1, dtype=np.int32))
    for azimuth, middle in ((0.0, 0.03), (90.0, 0.01)):
        seen = outline(ball, azimuth)
        covered = seen.u[seen.top > 0]
        # Within a pixel: its grid is fixed in space.
        assert covered.mean() == pytest.approx(middle, abs=PIXEL)
        assert covered[-1] - covered[0] == pytest.approx(0.008, abs=2 * PIXEL)
        assert seen.top.max() == pytest.approx(0.009, abs=PIXEL)


def test_the_lines_of_the_front_view_lie_on_the_cone():
    seen = PileReading(moved(cone(25.0), shift=(0.02, 0.0))).front
    left, right = seen.flanks
    slope, apex = np.tan(np.radians(25.0)), seen.top.max()
    for line, sign in ((left, -1), (right, 1)):
        # Hollows between the tiles and pixels: see TILING in test_repose; here as a length.
        heights = apex - sign * slope * (np.array(line.u) - 0.02)
        assert line.z == pytest.approx(heights, abs=3 * PIXEL)


def test_the_front_view_is_the_one_of_the_left_and_the_right_angle():
    reading = PileReading(oblique_cone(0.05, 0.02, 0.02))
    assert [line.angle_deg for line in reading.front.flanks] == reading.flanks_deg[0].tolist()
    assert reading.front.flanks[0].angle_deg < reading.front.flanks[1].angle_deg
