"""Slopes in the upper box of a draw-down test, on made-up wedges of known angle."""

import numpy as np
import pytest

from solver.observables.draw_down import slopes_deg
from solver.observables.silhouette import PIXEL
from solver.pours.record import Spheres

BEAD = 1e-3
FLOOR = 0.2
WIDTH, SLOT = 0.3, 0.06


def wedge(angle_deg, side):
    """Beads that fill the space between shelf, wall and a slope that begins at the slot's edge, on ``side`` = ±1."""
    slope = np.tan(np.radians(angle_deg))
    x = np.arange(SLOT / 2, WIDTH / 2, 0.5 * BEAD)
    columns = []
    for place in x:
        # The bead's top touches the slope.
        top = slope * (place - SLOT / 2) - BEAD / np.cos(np.radians(angle_deg))
        z = np.append(np.arange(0.5 * BEAD, top, 1.5 * BEAD), top)
        columns.append(np.column_stack([np.full(z.size, side * place), np.zeros(z.size), z + FLOOR]))
    return np.concatenate(columns)


def spheres(*parts):
    centre = np.concatenate(parts)
    return Spheres(centre, np.full(len(centre), BEAD), np.arange(len(centre), dtype=np.int32))


@pytest.mark.parametrize(("left", "right"), [(30.0, 30.0), (25.0, 40.0)])
def test_a_wedge_has_its_angle(left, right):
    found = slopes_deg(spheres(wedge(left, -1), wedge(right, 1)), FLOOR)
    # Whole pixels over a rise of 40 mm
    assert found == pytest.approx((left, right), abs=np.degrees(PIXEL / 40e-3))


def test_what_is_not_there_is_nan():
    only_left = slopes_deg(spheres(wedge(30.0, -1)), FLOOR)
    assert only_left[0] == pytest.approx(30.0, abs=0.4)
    assert np.isnan(only_left[1])
