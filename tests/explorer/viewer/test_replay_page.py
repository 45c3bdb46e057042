"""The page of a recording: what is drawn at a moment is what was recorded, whoever moves the slider."""

import threading
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import viser

from explorer.live.frames import Frame
from explorer.logs.pour_log import PourLog
from explorer.logs.recording_reader import read_recording
from explorer.scene.file import load_scene
from explorer.scene.meshes import scene_height
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.look import drawn_look
from explorer.viewer.look.camera import view_of
from explorer.viewer.look.look import COMPONENT
from explorer.viewer.palette import STILL, linear, linear_all, mapped
from explorer.viewer.replay.replay_page import MeshNodes, ReplayPage, columns, drawn_height, moment_html
from explorer.viewer.scene_nodes import PLATE_RADIUS, SceneNodes, plate_radius
from explorer.viewer.view import light, look_at_height
from tests.explorer.background.waiting import wait_for
from tests.explorer.logs.test_pour_log import poses


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


@pytest.fixture
def page(recording):
    server = guarded_server("127.0.0.1", 0, "test")
    yield ReplayPage(server, recording, "pour.rrd")
    server.stop()


@pytest.fixture
def older(recording):
    """The page of the same recording from before recordings held their scene."""
    server = guarded_server("127.0.0.1", 0, "test")
    yield ReplayPage(server, replace(recording, scene=None), "pour.rrd")
    server.stop()


def drawn(page):
    """Positions of the seeds that are not hidden."""
    node = page._look._nodes.bodies.nodes[0]
    return node.batched_positions[node.batched_scales > 0]


def rig(page):
    """Nodes of the rig by name."""
    nodes = page._look._nodes
    return {s.shape.name: node for s, node in nodes._surfaces} if isinstance(nodes, MeshNodes) else nodes._rig


def scene_tree(server):
    """What a browser is sent of the scene: name of a node → its properties, the bodies' own state left out."""
    nodes = server.scene._handle_from_node_name
    return {
        name: {key: value for key, value in vars(node._impl.props).items() if not key.startswith("batched")}
        for name, node in nodes.items()
        if hasattr(node._impl, "props")
    }


def test_a_moment_is_drawn_as_it_was_recorded(page, recording):
    page._timeline.go_to(0.03)
    page.show()
    assert np.array_equal(drawn(page), recording.components[0].at(0.02).position)
    assert rig(page)["gate"].visible
    page._timeline.go_to(0.06)
    page.show()
    assert len(drawn(page)) == 4
    assert not rig(page)["gate"].visible
    assert page._slider.value == pytest.approx(0.06)


def test_it_is_drawn_as_the_live_page_draws_the_scene(page, recording, server):
    """Node by node, with the camera that a browser begins with."""
    light(server)
    live = SceneNodes(server, recording.scene)
    look_at_height(server, scene_height(recording.scene))
    page._timeline.go_to(0.06)
    page.show()
    state = poses(*[0] * 4)
    live.show(
        Frame(1, 1, 0.06, state.position.astype(np.float32), state.quaternion.astype(np.float32), state.component,
              state.inside, state.scale.astype(np.float32))
    )  # fmt: skip
    mine, theirs = scene_tree(page._server), scene_tree(server)
    assert {"/rig/cone/rims", "/rig/scale", "/rig/radius 9", "/rig/bar", "/bodies/0"} <= set(theirs)
    assert set(mine) == set(theirs)
    for name, props in theirs.items():
        for key, value in props.items():
            np.testing.assert_equal(mine[name][key], value, f"{name} {key}")
    camera, expected = page._server.initial_camera, server.initial_camera
    assert np.array_equal(camera.position, expected.position)
    assert np.array_equal(camera.look_at, expected.look_at)


def test_the_plate_goes_on_behind_the_farthest_body(page, older):
    for shown in (page, older):
        shown._timeline.go_to(0.06)  # the farthest body is 0.424 m from the axis
        shown.show()
        plate = rig(shown)["plate"]
        radius = np.hypot(*(np.array(plate.scale)[:2, None] * plate.vertices[:, :2].T)).max()
        assert radius == pytest.approx(0.45, rel=1e-6)
        shown._timeline.go_to(0.0)
        shown.show()
        radius = np.hypot(*(np.array(plate.scale)[:2, None] * plate.vertices[:, :2].T)).max()
        assert radius == pytest.approx(PLATE_RADIUS, rel=1e-6)
    assert plate_radius(Frame(1, 1, 0.0, np.float32([[9, 9, 0]]), None, None, np.array([False]), None)) == PLATE_RADIUS


def test_an_older_recording_is_drawn_from_its_meshes_and_says_so(page, older):
    older._timeline.go_to(0.03)
    older.show()
    assert rig(older)["gate"].visible
    assert len(drawn(older)) == 2

    assert "does not hold its scene" in older._notes.content
    assert page._notes.content == ""


def test_a_recording_that_begins_amid_a_pour_counts_from_its_beginning(recording, server):
    late = recording.counted_from(-1.910765)
    assert (recording.zero, late.zero) == (0.0, pytest.approx(1.910765))
    page = ReplayPage(server, late, "late.rrd")
    assert (page._slider.min, page._slider.max, page._slider.step) == (0.0, 0.06, 0.001)
    page._timeline.go_to(0.02)
    page.show()
    assert page._slider.value == 0.02
    assert "0.020 of 0.060 s · 2 bodies" in page._text.content
    page._timeline.go_to(0.06)
    page.show()
    assert "0.050 s  &lt;b&gt;friction" in page._text.content
    times = page._plots[0][1].data[0]
    assert times[0] == 0.0
    assert times[1:5] == pytest.approx([0.0, 0.02, 0.04, 0.06])


def test_times_have_few_digits(recording, server):
    """A first frame at 9.997 ms is no reason to begin there, nor a last one at 1.970355883 s to end there."""
    odd = replace(recording, times=np.array([0.009997, 1.970355883]))
    page = ReplayPage(server, odd, "odd.rrd")
    assert (page._slider.min, page._slider.max) == (0.0, 1.971)
    page._timeline.go_to(9.0)
    page.show()
    assert page._slider.value == 1.97


def entered(slider, value):
    """What viser does when a browser moves a slider."""
    for callback in slider._impl.update_cb:
        callback(SimpleNamespace(client_id=0, client=None, target=SimpleNamespace(value=value)))


def test_the_slider_moves_the_recording_and_bad_input_does_not(page):
    page._timeline.playing = False
    entered(page._slider, 0.04)
    page._actions.carry_out()
    page.show()
    assert len(drawn(page)) == 3
    for bad in (float("nan"), None, "text"):
        entered(page._slider, bad)
        assert "is not a finite number" in page._actions.carry_out()
        assert page._timeline.time == pytest.approx(0.04)
    entered(page._slider, 1e9)
    page._actions.carry_out()
    assert page._timeline.time == pytest.approx(0.06)


def test_it_plays_by_itself_to_the_end(page):
    stop = threading.Event()
    loop = threading.Thread(target=page.run, args=(stop,))
    loop.start()
    wait_for(lambda: not page._timeline.playing)
    wait_for(lambda: page._timeline.time == pytest.approx(0.06) and len(drawn(page)) == 4)
    stop.set()
    loop.join()
    assert page._timeline.time == pytest.approx(0.06)
    assert len(drawn(page)) == 4


def settle(page, **settings):
    page._timeline.playing = False
    page._look._settings.change(**settings)
    page.show()


def test_colours_are_of_the_component_of_speed_and_of_residence_time(page, recording):
    node = page._look._nodes.bodies.nodes[0]
    page._timeline.go_to(0.04)
    settle(page)
    colour = list(linear(recording.components[0].shape.colour))
    assert node.batched_colors[:3].tolist() == [colour] * 3
    # A body enters with every frame: 40, 20 and 0 ms ago.
    settle(page, colour_by="residence time", automatic=False, low=0.0, high=0.05)
    expected = linear_all(mapped(np.array([0.8, 0.4, 0.0])))
    assert node.batched_colors[:3].tolist() == expected.tolist()
    assert "residence time [s]: time since a body is first in the recording" in page._look._colours._bar.content
    assert page._look._colours._bar.visible
    # None of them moves.
    settle(page, colour_by="speed")
    assert node.batched_colors[:3].tolist() == [list(linear(STILL))] * 3
    settle(page, colour_by=COMPONENT)
    assert node.batched_colors[:3].tolist() == [colour] * 3
    assert not page._look._colours._bar.visible


def test_what_is_not_recorded_is_not_offered_and_the_hint_says_so(page):
    chooser = page._look._colours._colour
    assert chooser.options == (COMPONENT, "speed", "residence time")
    assert "no contact forces" in chooser._impl.props.hint


def test_a_cut_hides_bodies_and_the_rig_fades(page):
    page._timeline.go_to(0.06)
    settle(page, cut_away="x above", cut_at=0.15)
    assert drawn(page)[:, 0] == pytest.approx([0.0, 0.1])
    settle(page, rig_opacity=0.4)
    opacities = {name: node.opacity for name, node in rig(page).items()}
    assert opacities["cone"] == 0.4
    assert opacities["plate"] is None
    assert opacities["gate"] != 0.4


def test_shadows_are_switched_off(page, monkeypatch):
    lit = []
    monkeypatch.setattr(drawn_look, "light", lambda server, shadows: lit.append(shadows))
    settle(page, shadows=False)
    assert lit == [False]


def trigger(page, label):
    """Trigger the command that the key of ``label`` triggers, as the browser that has pressed it."""
    client = SimpleNamespace(client_id=1, atomic=nullcontext, camera=SimpleNamespace())
    commands = page._server.gui._command_handle_from_uuid.values()
    (command,) = [one for one in commands if one._impl.props.label == label]
    for callback in command._impl.trigger_cb:
        callback(SimpleNamespace(client=client, client_id=1))
    page._actions.carry_out()
    return client


def test_keys_are_those_of_the_live_page(page, recording):
    trigger(page, "Colour by the next quantity")
    assert page._look._settings.look.colour_by == "speed"
    trigger(page, "Cut away the next side")
    assert page._look._settings.look.cut_away == "x below"
    camera, expected = trigger(page, "View: side").camera, view_of(drawn_height(recording), "Side")
    assert camera.position == pytest.approx(expected.position)
    assert camera.look_at == pytest.approx(expected.look_at)


def test_what_is_refused_is_told(page):
    stop = threading.Event()
    loop = threading.Thread(target=page.run, args=(stop,))
    loop.start()
    entered(page._look._colours._high, -1.0)
    wait_for(lambda: "is not above" in page._text.content)
    stop.set()
    loop.join()
    assert "colour range: its end -1 is not above its beginning 0" in page._text.content


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


def test_it_plays_from_the_beginning_when_the_first_browser_comes(page):
    page._timeline.go_to(9.0)
    page._timeline.playing = False
    for callback in page._server._client_connect_cb:
        callback(None)
    page._actions.carry_out()
    assert (page._timeline.time, page._timeline.playing) == (0.0, True)
    page._timeline.go_to(0.04)
    for callback in page._server._client_connect_cb:
        callback(None)
    page._actions.carry_out()
    assert page._timeline.time == 0.04


def test_a_recording_of_a_stranger_puts_nothing_but_text_on_the_page(recording):
    hostile = "| a | b |\n|---|---|\n| <img src=x onerror=alert(1)> | ![](http://example.org/seen.png) |"
    server = guarded_server("127.0.0.1", 0, "test")
    try:
        ReplayPage(server, replace(recording, parameters=hostile, outcome=hostile), "<b>pour</b>.rrd")
        children = [
            one for place in server.gui._container_handle_from_uuid.values() for one in place._children.values()
        ]
        texts = [one.content for one in children if isinstance(one, viser.GuiMarkdownHandle | viser.GuiHtmlHandle)]
        assert sum("| a | b |" in text for text in texts) == 2
        assert not any("<img" in text or "![](" in text for text in texts)
    finally:
        server.stop()
