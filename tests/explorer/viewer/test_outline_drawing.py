"""The pile from the side: what is drawn in the panel and in 3-D, and measured data over it."""

import re
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from doe.measurement.load import load_measurement
from explorer.errors import CommandError
from explorer.files.measured_curves import MeasuredCurve, measured_curves
from explorer.viewer.actions import Actions, BackgroundWork
from explorer.viewer.panel import Now
from explorer.viewer.pour.outline_drawing import (
    WAITING,
    corners_of,
    flank_segments,
    in_world,
    measured_segments,
    outline_html,
    outline_svg,
)
from explorer.viewer.pour.outline_panel import NONE, OWN, OutlinePanel
from solver.assets import measurement_folder
from solver.observables.reading import PileReading
from tests.explorer.files.test_uploads import archive, drum_files
from tests.explorer.viewer.page_session import finished, page_context
from tests.explorer.viewer.person import Person
from tests.explorer.viewer.test_texts import STATUS
from tests.solver.observables.made_up import cone, joined, moved

FRONT = PileReading(cone(25.0)).front


def test_the_lines_that_are_drawn_have_the_angles_that_are_told():
    drawn = [
        float(number)
        for number in re.findall(r"-?\d+\.\d+", "".join(re.findall(r"<line[^>]*0\.9'", outline_svg(FRONT, None))))
    ]
    for line, ends in zip(FRONT.flanks, np.array(drawn).reshape(-1, 4 + 1)[:, :4], strict=True):
        x0, y0, x1, y1 = ends
        # Two decimals of a millimetre over some 20 mm.
        assert np.degrees(np.arctan(abs((y1 - y0) / (x1 - x0)))) == pytest.approx(line.angle_deg, abs=0.1)
    left, right = FRONT.flanks
    assert f"left {left.angle_deg:.1f}°, right {right.angle_deg:.1f}°" in outline_html(FRONT, None)


def test_leaving_out_level_columns_keeps_the_line():
    u, top = FRONT.u, FRONT.top
    corners = corners_of(u, top)
    assert len(corners[0]) < len(u)
    assert np.interp(u, *corners) == pytest.approx(top, abs=1e-15)


def test_a_stray_far_away_does_not_make_the_pile_small():
    with_stray = PileReading(joined(cone(25.0), moved(cone(25.0), scale=0.1, shift=(1.0, 0.0)))).front
    assert len(with_stray.u) > 2 * len(FRONT.u)
    assert (
        re.search("viewBox='(.*?)'", outline_svg(with_stray, None))[1]
        == re.search("viewBox='(.*?)'", outline_svg(FRONT, None))[1]
    )


def test_before_there_is_a_pile_words_say_what_is_missing():
    assert outline_html(None, None).count("<svg") == 0
    assert WAITING in outline_html(None, None)


def test_names_of_measured_curves_are_escaped():
    curve = MeasuredCurve("<img src=x>", FRONT.u, FRONT.top, FRONT.flanks)
    assert "<img" not in outline_html(FRONT, curve)


def test_lines_in_the_scene_lie_in_the_plane_of_the_view():
    ends = flank_segments(FRONT)
    assert ends.shape == (2, 2, 3)
    assert (ends[..., 1] == 0).all()
    assert ends[1, :, 0] == pytest.approx(FRONT.flanks[1].u)
    assert ends[1, :, 2] == pytest.approx(FRONT.flanks[1].z)
    # Azimuth 90 looks along −x with +y on its right.
    assert in_world(np.array([0.1]), np.array([0.02]), 90.0)[0] == pytest.approx([0.0, 0.1, 0.02])
    curve = MeasuredCurve("scan", FRONT.u, FRONT.top)
    segments = measured_segments(curve)
    np.testing.assert_array_equal(segments[1:, 0], segments[:-1, 1])
    assert segments[..., 2].max() == FRONT.top.max()


def test_a_scan_is_drawn_with_the_angles_that_its_data_set_has():
    curves = measured_curves("trefoil_1")
    fit = load_measurement(measurement_folder("trefoil_1")).fit[0]
    for side, name in ((0, "left"), (1, "right")):
        angles = fit.offered[f"angle_of_repose_{name}_deg"].values
        assert [curves[f"fit: scan {k}"].flanks[side].angle_deg for k in range(1, 7)] == angles.tolist()
    profile = curves["fit: mean height profile"]
    assert (profile.z == profile.z[::-1]).all()


def test_a_free_surface_is_drawn_about_the_axis_of_its_drum():
    surface = measured_curves("granudrum_mcc")["drum_15rpm: free surface"]
    observed = load_measurement(measurement_folder("granudrum_mcc")).fit[0]
    assert surface.z - observed.scene.rig.radius == pytest.approx(observed.offered["surface_profile_m"].values[0])


class Bench:
    """The panel with a person at it."""

    def __init__(self, server, data):
        actions = Actions()
        page = page_context(server, post=actions.post, data=data)
        with server.gui.add_folder("Silhouette") as place:
            self.panel = OutlinePanel(page)
        self.person = Person(place, lambda: finished(actions, page.background))
        self.hasty = Person(place, actions.carry_out)  # who does not wait for what is done
        self.background, self.node = page.background, server.scene.get_handle_by_name
        self.wait = lambda: finished(actions, page.background)

    def text(self, outline=FRONT):
        """What stands there once the panel has looked at a pour with this outline."""
        self.panel.show(Now(replace(STATUS, outline=outline)))
        return self.person.text

    @property
    def lines(self):
        """Nodes of the lines in 3-D, and of their rims."""
        return [self.node(f"/fit/{line}/{part}") for line in ("measured", "flanks") for part in ("core", "rim")]


@pytest.fixture
def bench(server, tmp_path):
    return Bench(server, tmp_path)


def test_measured_data_are_laid_over_the_pile_and_taken_off(bench):
    person = bench.person
    assert "measured" not in bench.text()
    assert person.enter("Measured", "granudrum_mcc") == ""
    assert person.options("Curve") == ("drum_15rpm: free surface", "drum_45rpm: free surface")
    assert person.enter("Curve", "drum_45rpm: free surface") == ""
    assert "measured, drum_45rpm: free surface" in bench.text()
    assert all(node.visible for node in bench.lines)
    person.enter("Measured", NONE)
    assert "measured" not in bench.text(outline=None)
    assert not any(node.visible for node in bench.lines)


def test_a_folder_without_data_is_refused_in_one_line_and_changes_nothing(bench, tmp_path):
    person = bench.person
    person.enter("Measured", "granudrum_mcc")
    for label, value in (("Folder", str(tmp_path)), ("Measured", OWN)):
        notice = person.enter(label, value)
        assert "measurement.toml" in notice
        assert "\n" not in notice
        assert "measured, drum_15rpm: free surface" in bench.text()


def test_a_choice_that_is_refused_is_set_back_to_what_is_drawn(bench):
    person = bench.person
    person.enter("Measured", "granudrum_mcc")
    done = threading.Event()
    bench.background.start("exporting", lambda: done.wait(60.0), lambda _: None)
    assert "wait until this is done: exporting" in bench.hasty.enter("Measured", "trefoil_1")
    assert "measured, drum_15rpm: free surface" in bench.text()
    assert person.value("Measured") == "granudrum_mcc"
    done.set()
    bench.wait()
    assert person.enter("Measured", "trefoil_1") == ""
    bench.text()
    assert person.value("Measured") == "trefoil_1"
    # A folder that cannot be read is no choice either.
    person.control("Folder").value = "nowhere at all"
    assert person.enter("Measured", OWN) != ""
    bench.text()
    assert person.value("Measured") == "trefoil_1"


def test_uploaded_data_are_laid_over_the_pile_and_a_bad_archive_changes_nothing(bench):
    person, button = bench.person, "Upload measured data"
    assert person.upload(button, "drum.zip", archive(drum_files())) == ""
    assert person.value("Curve") == "drum_15rpm: free surface"
    folder = person.value("Folder")
    assert load_measurement(Path(folder)).conditions
    assert "cannot be unpacked" in person.upload(button, "drum.zip", b"no archive")
    assert person.value("Folder") == folder
    assert "measured, drum_15rpm: free surface" in bench.text()


def test_a_single_curve_is_drawn_and_a_bad_file_leaves_it(bench):
    person, button = bench.person, "Upload measured data"
    assert person.upload(button, "photo.csv", b"u_m,z_m\n-0.02,0\n0,0.01\n0.02,0\n") == ""
    assert (person.options("Curve"), person.value("Measured")) == (("photo.csv",), NONE)
    assert "photo.csv: not a text file" in person.upload(button, "photo.csv", b"\0")
    assert "measured, photo.csv" in bench.text()


def test_one_thing_is_done_at_a_time_and_a_mistake_is_no_refusal():
    actions, done, told = Actions(), [], threading.Event()
    background = BackgroundWork(actions.post)
    background.start("waiting", lambda: told.wait(60.0) and 7, done.append)
    with pytest.raises(CommandError, match="another: wait until this is done: waiting"):
        background.start("another", lambda: 1, done.append)
    told.set()
    assert finished(actions, background) == ""
    assert done == [7]
    background.start("another", lambda: 1 / 0, done.append)
    with pytest.raises(ZeroDivisionError):
        finished(actions, background)
    background.start("reading", lambda: open("/nowhere/at/all"), done.append)  # noqa: PTH123, SIM115
    assert finished(actions, background) == "reading: No such file or directory"
