"""Marks in a photograph: from clicks to the base line and the scale of its reading."""

import numpy as np
import pytest
from PIL import Image

from explorer.errors import CommandError
from explorer.laboratory.command_results import Ruler, measure_words, photograph_reading
from explorer.photograph.marks import UNMARKED, Marks, base_line_through
from explorer.viewer.laboratory.photograph_panel import NOTHING_MARKED, marks_words
from explorer.viewer.tables.marks_page import BASE, LENGTH, Clicks
from tests.solver.photograph.rendered import Look, photograph, solid_cover

WIDTH = 700


def test_the_line_through_two_points_reaches_both_edges():
    assert base_line_through((100.0, 400.0), (500.0, 408.0), WIDTH) == pytest.approx((398.0, 411.98))
    assert base_line_through((500.0, 408.0), (100.0, 400.0), WIDTH) == pytest.approx((398.0, 411.98))


def test_clicks_become_marks_and_a_third_begins_anew():
    clicks = Clicks(WIDTH)
    for point in ((10.0, 5.0), (100.0, 400.0), (500.0, 408.0)):
        clicks.add(BASE, point)
    assert clicks.points[BASE] == [(500.0, 408.0)]
    clicks.add(BASE, (100.0, 400.0))
    clicks.add(LENGTH, (50.0, 20.0))
    clicks.add(LENGTH, (250.0, 20.0))
    marks = clicks.marks(100.0)
    assert marks.base_line == pytest.approx((398.0, 411.98))
    assert (marks.ends, marks.length_mm) == ((50.0, 20.0, 250.0, 20.0), 100.0)
    assert clicks.drawn(0.5).count("<circle") == 4
    assert clicks.drawn(0.5).count("<line") == 2


@pytest.mark.parametrize(
    ("what", "points", "length", "words"),
    [
        (BASE, [(1.0, 2.0)], None, "base line: one point is marked; click the other one"),
        (BASE, [(1.0, 2.0), (5.0, 300.0)], None, "less than 20 px apart"),
        (LENGTH, [(1.0, 2.0), (9.0, 2.0)], 10.0, "less than 20 px apart"),
        (LENGTH, [(1.0, 2.0), (90.0, 2.0)], None, "allowed: above 0 up to 10000 mm"),
        (LENGTH, [(1.0, 2.0), (90.0, 2.0)], -1.0, "allowed: above 0 up to 10000 mm"),
        (LENGTH, [(1.0, 2.0), (90.0, 2.0)], float("nan"), "allowed: above 0 up to 10000 mm"),
    ],
)
def test_marks_that_say_nothing_are_refused(what, points, length, words):
    clicks = Clicks(WIDTH)
    for point in points:
        clicks.add(what, point)
    with pytest.raises(CommandError, match=words):
        clicks.marks(length)


def test_marks_are_what_the_reading_and_its_command_line_go_by(tmp_path):
    """A cone of 30° over a plate of which the program finds the edge: marked there it is read alike, and in millimetres
    by the marked length."""
    path = tmp_path / "cone.png"
    pixels = photograph(solid_cover(30.0, 30.0, 110), Look(width=WIDTH))
    Image.fromarray(pixels).save(path)
    found = photograph_reading(str(path), Ruler())
    y = found.measured.piles[0].origin[1]
    marks = Marks(base_line=(y, y), ends=(10.0, 10.0, 210.0, 10.0), length_mm=100.0)
    marked = photograph_reading(str(path), Ruler(scale_mm=3.0), marks=marks)
    before, after = found.measured.piles[0], marked.measured.piles[0]
    assert after.angles.mean.value_deg == pytest.approx(before.angles.mean.value_deg, abs=0.3)
    assert marked.ruler == Ruler(reference_mm=100.0)
    assert np.ptp(after.outline.u) == pytest.approx(0.5e-3 * np.ptp(before.outline.u), rel=0.02)
    words = measure_words(marked)
    assert words[words.index("--reference") + 1] == "10.0,10.0,210.0,10.0"
    assert words[words.index("--reference-length") + 1] == "100"
    assert words[words.index("--baseline") + 1] == f"{y:.1f},{y:.1f}"
    assert "--scale" not in words


def test_marks_are_told_in_words():
    assert marks_words(UNMARKED) == NOTHING_MARKED
    said = marks_words(Marks((398.0, 411.98), (1.0, 2.0, 3.0, 4.0), 100.0))
    assert "398.0 px" in said
    assert "412.0 px" in said
    assert "100 mm" in said
