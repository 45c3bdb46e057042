"""Marks in a photograph: from clicks to the base line and the scale of its reading."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from explorer.errors import CommandError
from explorer.laboratory.command_results import Ruler, measure_words, photograph_reading
from explorer.photograph.marks import UNMARKED, Marks, base_line_through
from explorer.viewer.laboratory.photograph_panel import NOTHING_MARKED, marks_words
from explorer.viewer.tables.marks_page import BASE, LENGTH, Clicks, shown_picture
from solver.photograph import open_picture
from tests.solver.photograph.rendered import Look, photograph, solid_cover

WIDTH = 700


def test_the_line_through_two_points_reaches_both_edges():
    assert base_line_through((100.0, 400.0), (500.0, 408.0), WIDTH) == pytest.approx((398.0, 411.98))
    assert base_line_through((500.0, 408.0), (100.0, 400.0), WIDTH) == pytest.approx((398.0, 411.98))


def test_clicks_become_marks_and_a_third_begins_anew():
    """In a picture that is shown at half its width and a quarter of its height."""
    clicks = Clicks(WIDTH, 2.0, 4.0)
    for point in ((5.0, 5.0), (50.25, 100.125), (250.25, 102.125)):
        clicks.add(BASE, *point)
    assert clicks.points[BASE] == [(500.0, 408.0)]
    clicks.add(BASE, 50.25, 100.125)
    clicks.add(LENGTH, 25.25, 5.125)
    clicks.add(LENGTH, 125.25, 5.125)
    marks = clicks.marks(100.0)
    assert marks.base_line == pytest.approx((398.0, 411.98))
    assert (marks.ends, marks.length_mm) == ((50.0, 20.0, 250.0, 20.0), 100.0)
    assert clicks.drawn().count("<circle") == 4
    assert '<line x1="250.2" y1="102.1" x2="50.2" y2="100.1"' in clicks.drawn()


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
        clicks.add(what, *point)
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


@pytest.mark.parametrize("size", [(6000, 4001), (3001, 6007), (500, 300)])
def test_a_click_is_told_in_pixels_of_the_picture_whatever_is_shown(tmp_path, size):
    """A dark block in a light picture: its corners as shown are its corners."""
    pixels = np.full(size[::-1], 200, dtype=np.uint8)
    x, y = size[0] // 2, size[1] - 60
    pixels[y:, x:] = 20
    path = tmp_path / "block.png"
    Image.fromarray(pixels).save(path)
    address, clicks = shown_picture(open_picture(path))
    with Image.open(io.BytesIO(base64.b64decode(address.partition(",")[2]))) as opened:
        shown = np.asarray(opened.convert("L"), dtype=float)
    corner = edge(shown[:, -2]), edge(shown[-2])
    clicks.add(BASE, corner[1], corner[0])
    (found,) = clicks.points[BASE]
    assert found == pytest.approx((x - 0.5, y - 0.5), abs=0.7)  # rows and columns left over where it is reduced


def edge(levels):
    """Where a row or column of pixels falls from 200 to 20, from its beginning."""
    return np.sum(levels - 20.0) / 180.0


def test_marks_are_told_in_words():
    assert marks_words(UNMARKED) == NOTHING_MARKED
    said = marks_words(Marks((398.0, 411.98), (1.0, 2.0, 3.0, 4.0), 100.0))
    assert "398.0 px" in said
    assert "412.0 px" in said
    assert "100 mm" in said
