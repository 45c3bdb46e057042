"""The page of a recording: what is drawn at a moment is what was recorded, whoever moves the slider."""

import threading
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from explorer.live.frames import Frame
from explorer.recordings.pour_log import PourLog
from explorer.recordings.recording_reader import read_recording
from explorer.scene.file import load_scene
from explorer.scene.meshes import scene_height
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.look import drawn_look
from explorer.viewer.look.camera import view_of
from explorer.viewer.look.look import COMPONENT
from explorer.viewer.palette import STILL, linear, linear_all, mapped
from explorer.viewer.replay import replay_page
from explorer.viewer.replay.replay_page import PLAY_PAUSE, ReplayPage, columns, drawn_height, moment_html
from explorer.viewer.scene_nodes import PLATE_RADIUS, SceneNodes, plate_radius
from explorer.viewer.view import light, look_at_height
from tests.explorer.background.waiting import wait_for
from tests.explorer.recordings.test_pour_log import poses
from tests.explorer.viewer.person import Person


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("replay") / "pour.rrd"
    with PourLog(path, load_scene("funnel"), seed=1) as log:
        log.event(0.0, "phase: fill")
        for k in range(4):
            curves = {"angle_of_repose_deg": 20.0 + k, "discharged_mass_g": float(k)}
            log.frame(0.02 * k, poses(*[0] * (k + 1)), curves, gate_shut=k < 2)
        log.event(0.05, "<b>friction</b>: 0.5 → 0.6")
    return read_recording(path)


def one_turn():
    """Lets the page's loop go round once."""
    return SimpleNamespace(is_set=iter((False, True)).__next__, wait=lambda seconds: None)


class Opened:
    """The page of a recording, which stands still, and the person at it."""

    def __init__(self, recording, name="pour.rrd"):
        self.server = guarded_server("127.0.0.1", 0, "test")
        self.page = ReplayPage(self.server, recording, name)
        self.person = Person(self.server, lambda: self.page.run(one_turn()))
        self.person.press(PLAY_PAUSE)

    def at(self, moment):
        """Move the slider to ``moment`` [s]."""
        self.person.enter("Time [s]", moment)

    def node(self, name):
        """viser's handle of what is in the scene under this name."""
        return self.server.scene.get_handle_by_name(name)

    @property
    def seeds(self):
        return self.node("/bodies/0")

    @property
    def places(self):
        """Where the seeds are that are not hidden."""
        return self.seeds.batched_positions[self.seeds.batched_scales > 0]

    @contextmanager
    def playing(self):
        """The page goes on by itself meanwhile, as it is served."""
        stop = threading.Event()
        loop = threading.Thread(target=self.page.run, args=(stop,))
        loop.start()
        try:
            yield
        finally:
            stop.set()
            loop.join()


@pytest.fixture
def opened():
    """Opens the page of a recording."""
    pages = []

    def made(*what):
        pages.append(Opened(*what))
        return pages[-1]

    yield made
    for page in pages:
        page.server.stop()


@pytest.fixture
def page(opened, recording):
    return opened(recording)


@pytest.fixture
def person(page):
    return page.person


@pytest.fixture
def older(opened, recording):
    """The page of the same recording from before recordings held their scene."""
    return opened(replace(recording, scene=None))


def scene_tree(server):
    """What a browser is sent of the scene: name of a node → its properties, the bodies' own state left out.

    viser tells neither the names of all nodes nor all properties of one.
    """
    nodes = server.scene._handle_from_node_name
    return {
        name: {key: value for key, value in vars(node._impl.props).items() if not key.startswith("batched")}
        for name, node in nodes.items()
        if hasattr(node._impl, "props")
    }


def test_a_moment_is_drawn_as_it_was_recorded(page, person, recording):
    page.at(0.03)
    assert np.array_equal(page.places, recording.components[0].at(0.02).position)
    assert page.node("/rig/gate").visible
    page.at(0.06)
    assert len(page.places) == 4
    assert not page.node("/rig/gate").visible
    assert person.value("Time [s]") == pytest.approx(0.06)


def test_it_is_drawn_as_the_live_page_draws_the_scene(page, recording, server):
    """Node by node, with the camera that a browser begins with."""
    light(server)
    live = SceneNodes(server, recording.scene)
    look_at_height(server, scene_height(recording.scene))
    page.at(0.06)
    state = poses(*[0] * 4)
    live.show(
        Frame(1, 1, 0.06, state.position.astype(np.float32), state.quaternion.astype(np.float32), state.component,
              state.inside, state.scale.astype(np.float32))
    )  # fmt: skip
    mine, theirs = scene_tree(page.server), scene_tree(server)
    assert {"/rig/cone/rims", "/rig/scale", "/rig/radius 9", "/rig/bar", "/bodies/0"} <= set(theirs)
    assert set(mine) == set(theirs)
    for name, props in theirs.items():
        for key, value in props.items():
            np.testing.assert_equal(mine[name][key], value, f"{name} {key}")
    camera, expected = page.server.initial_camera, server.initial_camera
    assert np.array_equal(camera.position, expected.position)
    assert np.array_equal(camera.look_at, expected.look_at)


def test_the_plate_goes_on_behind_the_farthest_body(page, older):
    for shown in (page, older):
        shown.at(0.06)  # the farthest body is 0.424 m from the axis
        plate = shown.node("/rig/plate")
        radius = np.hypot(*(np.array(plate.scale)[:2, None] * plate.vertices[:, :2].T)).max()
        assert radius == pytest.approx(0.45, rel=1e-6)
        shown.at(0.0)
        radius = np.hypot(*(np.array(plate.scale)[:2, None] * plate.vertices[:, :2].T)).max()
        assert radius == pytest.approx(PLATE_RADIUS, rel=1e-6)
    assert plate_radius(Frame(1, 1, 0.0, np.float32([[9, 9, 0]]), None, None, np.array([False]), None)) == PLATE_RADIUS


def test_an_older_recording_is_drawn_from_its_meshes_and_says_so(person, older):
    older.at(0.03)
    assert older.node("/rig/gate").visible
    assert len(older.places) == 2

    assert "does not hold its scene" in older.person.text
    assert "does not hold its scene" not in person.text
    assert "It begins" not in person.text


def test_a_recording_that_begins_amid_a_pour_counts_from_its_beginning(opened, recording):
    late = recording.counted_from(-1.910765)
    assert (recording.zero, late.zero) == (0.0, pytest.approx(1.910765))
    page = opened(late, "late.rrd")
    person, slider = page.person, page.person.control("Time [s]")
    assert "It begins 1.911 s after the pour did" in person.text
    assert (slider.min, slider.max, slider.step) == (0.0, 0.06, 0.001)
    page.at(0.02)
    assert person.value("Time [s]") == 0.02
    assert "0.020 of 0.060 s · 2 bodies" in person.text
    page.at(0.06)
    assert "0.050 s  &lt;b&gt;friction" in person.html
    times = person.curves[0].data[0]
    assert times[0] == 0.0
    assert times[1:5] == pytest.approx([0.0, 0.02, 0.04, 0.06])


def test_times_have_few_digits(opened, recording):
    """A first frame at 9.997 ms is no reason to begin there, nor a last one at 1.970355883 s to end there."""
    page = opened(replace(recording, times=np.array([0.009997, 1.970355883])), "odd.rrd")
    slider = page.person.control("Time [s]")
    assert (slider.min, slider.max) == (0.0, 1.971)
    page.at(slider.max)
    assert page.person.value("Time [s]") == 1.97


def test_the_slider_moves_the_recording_and_bad_input_does_not(page, person):
    page.at(0.04)
    assert len(page.places) == 3
    for bad in (float("nan"), None, "text"):
        person.send("Time [s]", bad)
        assert "is not a finite number" in person.text
        assert "paused · 0.040 of 0.060 s" in person.text
        page.at(0.04)
        assert "is not a finite number" not in person.text
    person.send("Time [s]", 1e9)
    assert "paused · 0.060 of 0.060 s" in person.text


def test_it_plays_by_itself_to_the_end(page, person):
    person.press(PLAY_PAUSE)
    with page.playing():
        wait_for(lambda: "paused · 0.060 of 0.060 s" in person.text and len(page.places) == 4)
    assert "paused · 0.060 of 0.060 s" in person.text
    assert len(page.places) == 4


def test_colours_are_of_the_component_of_speed_and_of_residence_time(page, person, recording):
    page.at(0.04)
    colour = list(linear(recording.components[0].shape.colour))
    assert page.seeds.batched_colors[:3].tolist() == [colour] * 3
    # A body enters with every frame: 40, 20 and 0 ms ago.
    person.enter("Colour by", "residence time")
    person.enter("Automatic range", False)
    person.enter("From", 0.0)
    person.enter("To", 0.05)
    expected = linear_all(mapped(np.array([0.8, 0.4, 0.0])))
    assert page.seeds.batched_colors[:3].tolist() == expected.tolist()
    assert "residence time [s]: time since a body is first in the recording" in person.text
    # None of them moves.
    person.enter("Colour by", "speed")
    assert page.seeds.batched_colors[:3].tolist() == [list(linear(STILL))] * 3
    assert "speed [m/s]" in person.text
    person.enter("Colour by", COMPONENT)
    assert page.seeds.batched_colors[:3].tolist() == [colour] * 3
    assert "speed [m/s]" not in person.text
    assert "linear-gradient" not in person.html


def test_what_is_not_recorded_is_not_offered_and_the_hint_says_so(person):
    assert person.options("Colour by") == (COMPONENT, "speed", "residence time")
    assert "no contact forces" in person.control("Colour by").hint


def test_a_cut_hides_bodies_and_the_rig_fades(page, person):
    page.at(0.06)
    person.enter("Cut away", "x above")
    person.enter("Place of the cut [mm]", 150.0)
    assert page.places[:, 0] == pytest.approx([0.0, 0.1])
    person.enter("Opacity of the rig", 0.4)
    assert page.node("/rig/cone").opacity == 0.4
    assert page.node("/rig/plate").opacity is None
    assert page.node("/rig/gate").opacity != 0.4


def test_shadows_are_switched_off(person, monkeypatch):
    lit = []
    monkeypatch.setattr(drawn_look, "light", lambda server, shadows: lit.append(shadows))
    person.enter("Shadows", False)
    assert lit == [False]


def test_keys_are_those_of_the_live_page(person, recording):
    person.hit("Colour by the next quantity")
    assert person.value("Colour by") == "speed"
    person.hit("Cut away the next side")
    assert person.value("Cut away") == "x below"
    person.hit("View: side")
    camera, expected = person.browser.camera, view_of(drawn_height(recording), "Side")
    assert camera.position == pytest.approx(expected.position)
    assert camera.look_at == pytest.approx(expected.look_at)


def test_what_is_refused_is_told(person):
    person.enter("Automatic range", False)
    person.enter("To", -1.0)
    assert "colour range: its end -1 is not above its beginning 0" in person.text
    person.enter("To", 1.0)
    assert "is not above" not in person.text


def test_the_moment_is_told_and_texts_of_the_file_are_escaped(recording):
    early, late = (moment_html(recording, time, playing=False) for time in (0.03, 0.06))
    assert "paused · 0.030 of 0.060 s · 2 bodies" in early
    assert "friction" not in early
    assert "&lt;b&gt;friction&lt;/b&gt;" in late


def test_the_curve_is_marked_where_time_stands():
    moments, angles = np.array([0.0, 0.1, 0.2]), np.array([1.0, 2.0, 3.0])
    times, values, marked = columns(moments, angles, 0.15, 0.4)
    assert values[1:4].tolist() == [1.0, 2.0, 3.0]
    assert np.nansum(marked) == 2.0
    assert np.isnan(columns(moments, angles, -1.0, 0.4)[2]).all()
    # The rows around the curve: no points of it, and the end never at the same place twice running.
    assert np.isnan([values[0], values[4], marked[0], marked[4]]).all()
    assert (times[0], times[4]) == (0.0, pytest.approx(0.4, abs=1e-5))
    assert columns(moments, angles, 0.15, 0.4, turn=1)[0][4] != times[4]


def test_a_moment_s_chart_has_an_axis_that_can_be_read():
    """A recording of a millisecond: its ticks would all say the same."""
    assert columns(np.zeros(1), np.ones(1), 0.0, 0.001)[0][-1] == pytest.approx(0.1, abs=1e-5)


def test_it_plays_from_the_beginning_when_the_first_browser_comes(page, person, monkeypatch):
    monkeypatch.setattr(replay_page, "clock", SimpleNamespace(monotonic=lambda: 0.0))
    page.at(0.06)
    person.arrive()
    assert "playing · 0.000 of 0.060 s" in person.text
    page.at(0.04)
    person.arrive()
    assert "playing · 0.040 of 0.060 s" in person.text


def test_a_recording_of_a_stranger_puts_nothing_but_text_on_the_page(opened, recording):
    hostile = "| a | b |\n|---|---|\n| <img src=x onerror=alert(1)> | ![](http://example.org/seen.png) |"
    person = opened(replace(recording, parameters=hostile, outcome=hostile), "<b>pour</b>.rrd").person
    for folder in ("Parameters", "Outcome"):
        assert "| a | b |" in person.within(folder).html
    assert "<img" not in person.html
    assert "![](" not in person.html
