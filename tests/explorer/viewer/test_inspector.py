"""One body under inspection: clicked, told, followed and let go; and where cameras stand."""

import math
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from urllib.parse import parse_qs, urlparse

import numpy as np
import pytest

from explorer.live.messages import SessionState, Status
from explorer.scene.file import load_scene
from explorer.scene.meshes import body_triangles, outlet_height, scene_height
from explorer.viewer.actions import Actions
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.look.camera import (
    BODY_REACH,
    DIRECTIONS,
    FRAMED,
    framing,
    go_along,
    go_to,
    link_to,
    pile_points,
    view_of,
)
from explorer.viewer.look.inspector import NOBODY, body_html, first_crossing, force, nearest_hit
from explorer.viewer.look.look_panel import LookPanel
from explorer.viewer.palette import SELECTED, linear
from explorer.viewer.panel import Now
from explorer.viewer.view import VIEW_FIELD
from tests.explorer.beads import RADIUS, bead_scene
from tests.explorer.viewer.page_session import frame_of, page_context
from tests.explorer.viewer.person import Person
from tests.explorer.viewer.test_look import DETAILS, FRAME

SCENE = bead_scene()
BEADS = replace(
    FRAME,
    component=np.zeros(4, dtype=np.int32),
    position=np.float32([[0, 0, 0.1], [0.05, 0, 0.1], [0, 0, 0.05], [0, 0.05, 0.1]]),
)
DOWN = np.array([0.0, 0.0, -1.0])


def hit(x, y, z=1.0, direction=DOWN, seen=BEADS.inside, frame=BEADS):
    return nearest_hit([body_triangles(SCENE.bodies[0])], frame, seen, np.array([x, y, z]), np.array(direction))


def test_a_ray_meets_the_nearest_body_in_sight():
    assert hit(0.0, 0.0) == 0
    assert hit(0.0, 0.0, seen=np.array([False, True, True, True])) == 2
    assert hit(0.0, 0.0, z=-1.0, direction=(0, 0, 5.0)) == 2
    assert hit(0.05 + 0.9 * RADIUS, 0.0) == 1
    assert hit(0.05 + 1.1 * RADIUS, 0.0) is None
    # One that has left the domain, and one behind the camera.
    assert hit(0.0, 0.05) is None
    assert hit(0.0, 0.0, z=0.075) == 2


def test_size_and_turn_of_a_body_count():
    large = replace(BEADS, scale=np.float32([2, 1, 1, 1]))
    assert hit(1.9 * RADIUS, 0.0, frame=large) == 0
    plate = SimpleNamespace(
        vertices=np.float32([[-1, -0.1, 0], [1, -0.1, 0], [1, 0.1, 0], [-1, 0.1, 0]]) * 0.01,
        faces=np.array([[0, 1, 2], [0, 2, 3]]),
    )
    turned = replace(BEADS, quaternion=np.tile(np.float32([math.sqrt(0.5), 0, 0, math.sqrt(0.5)]), (4, 1)))
    for frame, along_x in ((BEADS, 0), (turned, None)):
        assert nearest_hit([plate], frame, BEADS.inside, np.array([0.008, 0, 1.0]), DOWN) == along_x
        at_y = nearest_hit([plate], frame, BEADS.inside, np.array([0, 0.008, 1.0]), DOWN)
        assert at_y == (None if along_x == 0 else 0)


@pytest.mark.parametrize("ray", [((math.nan, 0, 1), DOWN), ((0, 0, 1), (0, 0, 0)), ((0, 0, 1), (math.inf, 0, 0))])
def test_a_ray_that_is_none_meets_nothing(ray):
    assert nearest_hit([body_triangles(SCENE.bodies[0])], BEADS, BEADS.inside, *map(np.array, ray)) is None


def test_a_crossing_is_at_its_distance():
    triangle = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    assert first_crossing(triangle, np.array([0.2, 0.2, 3.0]), np.array([0, 0, -2.0])) == pytest.approx(1.5)
    assert first_crossing(triangle, np.array([0.8, 0.8, 3.0]), DOWN) == math.inf


def test_a_body_is_told_with_its_contacts():
    evil = "<img src=x onerror=alert(1)>"
    scene = replace(SCENE, bodies=(replace(SCENE.bodies[0], name=evil),))
    text = body_html(scene, BEADS, DETAILS, 0)
    assert "<img" not in text
    for part in ("no. 1 of 4", "1 g", "0.0, 0.0, 100.0 mm", "0.000, 0.000, 0.000 m/s", "0.500 s", "5 mN"):
        assert part in text
    # Of contacts the strongest comes first: 5 mN with body 2, then 1.5 mN with the plate (surface 0).
    assert text.index("no. 2</td><td>5 mN</td><td>1 mN</td>") < text.index("<td>plate</td><td>1.5 mN</td><td>0 mN</td>")
    assert "no. 3</td>" not in text
    assert NOBODY in body_html(scene, BEADS, DETAILS, None)


def test_a_body_that_has_just_entered_is_told_without_what_is_not_known_yet():
    text = body_html(SCENE, BEADS, DETAILS, 3)
    assert "no. 4 of 4" in text
    assert "Mass" not in text
    assert "Mass" not in body_html(SCENE, BEADS, None, 0)


@pytest.mark.parametrize("name", DIRECTIONS)
def test_presets_have_rig_and_feed_in_the_picture(name):
    height = scene_height(SCENE)
    view = view_of(height, name)
    away = view.position - view.look_at
    assert away / np.linalg.norm(away) == pytest.approx(np.array(DIRECTIONS[name]) / np.linalg.norm(DIRECTIONS[name]))
    # Half the picture at that distance is more than the part of the height above the middle.
    assert np.linalg.norm(away) * math.tan(VIEW_FIELD / 2) > 0.58 * height


class FakeCamera:
    """As viser's: a new position takes the point that is looked at along."""

    def __init__(self):
        self._position, self.look_at = np.array([1.0, 0.0, 0.0]), np.zeros(3)
        self.up_direction, self.fov = np.array([0.0, 0.0, 1.0]), 1.0

    @property
    def position(self):
        return self._position

    @position.setter
    def position(self, position):
        self.look_at = self.look_at + (position - self._position)
        self._position = np.array(position)


class FakeClient:
    def __init__(self, number=1):
        self.client_id, self.camera, self.groups = number, FakeCamera(), 0

    @contextmanager
    def atomic(self):
        self.groups += 1
        yield


def test_a_camera_goes_to_a_preset():
    client = FakeClient()
    go_to(client, view_of(scene_height(SCENE), "Front"))
    assert client.camera.position == pytest.approx(view_of(scene_height(SCENE), "Front").position)
    assert client.camera.look_at == pytest.approx(view_of(scene_height(SCENE), "Front").look_at)


def test_a_camera_goes_along_and_keeps_its_distance_and_side():
    client, target = FakeClient(), np.array([0.1, 0.2, 0.3])
    go_along([client], target)
    assert client.camera.look_at == pytest.approx(target)
    assert client.camera.position - client.camera.look_at == pytest.approx([1.0, 0.0, 0.0])
    groups = client.groups
    go_along([client], target + 1e-7)
    assert client.groups == groups


def test_a_link_holds_the_whole_view():
    camera = FakeCamera()
    camera.position = np.array([0.25, -1.0, 0.123456])
    url = urlparse(link_to("http://127.0.0.1:8080", camera))
    assert url.netloc == "127.0.0.1:8080"
    assert parse_qs(url.query) == {
        "initialCameraPosition": ["0.25,-1,0.1235"],
        "initialCameraLookAt": ["-0.75,-1,0.1235"],
        "initialCameraUp": ["0,0,1"],
        "initialCameraFov": ["1"],
    }


class FakeSession:
    def __init__(self):
        self.found, self.watched = None, None

    def details(self):
        return self.found

    def watch(self, wanted, body=None):
        self.watched = (wanted, body)

    def status(self):
        return Status(SessionState.RUNNING, "", SCENE, seed=1, generation=1, speed=1.0)


class Tab:
    """The tab "Look" on a page of its own, and a person at it; ``browser``: the one in which that person sits."""

    def __init__(self):
        self.server, self.session, actions = guarded_server("127.0.0.1", 0, "test"), FakeSession(), Actions()
        self.panel, self.browser = LookPanel(page_context(self.server, self.session, actions.post)), FakeClient()
        self.person = Person(self.server, actions.carry_out, self.browser)
        self.draw()

    def draw(self, frame=BEADS, **changes):
        self.panel.draw(Now(self.session.status(), replace(frame, **changes)))

    def click(self, x, y):
        self.panel.click(np.array([x, y, 1.0]), DOWN)
        self.draw()

    def cut(self, at):
        """Cut away what is above ``at`` [mm]."""
        self.person.enter("Cut away", "z above")
        self.person.enter("Place of the cut [mm]", at)

    @property
    def bodies(self):
        return self.server.scene.get_handle_by_name("/bodies/0")

    @property
    def shows_chains(self):
        lines = map(self.server.scene.get_handle_by_name, ("/forces/core", "/forces/rim"))
        return any(line is not None and line.visible for line in lines)


@pytest.fixture
def tab():
    tab = Tab()
    yield tab
    tab.server.stop()


def test_a_click_inspects_a_body_and_another_beside_lets_it_go(tab):
    assert tab.session.watched == (False, None)
    tab.click(0.05, 0.0)
    assert tab.session.watched == (True, 1)
    assert tab.bodies.batched_colors[1].tolist() == list(linear(SELECTED))
    assert "bead no. 2 of 4" in tab.person.text
    assert NOBODY not in tab.person.text
    tab.click(0.5, 0.5)
    assert tab.session.watched == (False, None)
    assert NOBODY in tab.person.text
    assert tab.bodies.batched_colors[1].tolist() != list(linear(SELECTED))


def test_a_body_that_is_cut_away_cannot_be_clicked(tab):
    tab.cut(at=70.0)
    tab.click(0.0, 0.0)
    assert tab.session.watched == (True, 2)
    assert tab.bodies.batched_scales.tolist()[:4] == [0, 0, 1, 0]


def test_keys_go_from_body_to_body_among_those_in_sight(tab):
    after, before = "Inspect the next body", "Inspect the body that entered before"

    def step(key):
        assert tab.person.hit(key) == ""
        tab.draw()
        return tab.session.watched[1]

    assert step(after) == int(np.argmax(BEADS.position[:, 2]))  # at first the topmost
    seen = np.flatnonzero(BEADS.inside).tolist()
    assert 1 < len(seen) < len(BEADS.component)
    tab.person.hit("Let the body go")
    tab.click(0.05, 0.0)  # no. 2, counted from 1
    place = seen.index(1)
    assert [step(after) for _ in seen] == [*seen[place + 1 :], *seen[: place + 1]]
    assert step(before) == seen[place - 1]
    tab.cut(at=-200.0)
    assert tab.person.hit(after) == "no body is in sight"


def test_a_camera_follows_until_the_body_is_let_go(tab, monkeypatch):
    one, other = tab.browser, FakeClient(2)
    monkeypatch.setattr(tab.server, "get_clients", lambda: {1: one, 2: other})
    assert "click a body" in tab.person.press("Follow")
    tab.click(0.05, 0.0)
    assert tab.person.press("Follow") == ""
    assert one.camera.look_at == pytest.approx(BEADS.position[1])
    moved = BEADS.position + np.float32([0, 0.01, 0])
    tab.draw(number=2, position=moved)
    assert one.camera.look_at == pytest.approx(moved[1])
    assert other.groups == 0
    tab.person.press("Release")
    tab.draw(number=3)
    assert one.camera.look_at == pytest.approx(moved[1])


def test_a_follower_that_has_gone_is_forgotten(tab, monkeypatch):
    monkeypatch.setattr(tab.server, "get_clients", lambda: {1: tab.browser})
    tab.click(0.05, 0.0)
    tab.person.press("Follow")
    monkeypatch.setattr(tab.server, "get_clients", dict)
    tab.draw(number=2)
    monkeypatch.setattr(tab.server, "get_clients", lambda: {1: tab.browser})
    tab.draw(number=3, position=BEADS.position + np.float32([0, 0.01, 0]))
    assert tab.browser.camera.look_at == pytest.approx(BEADS.position[1])


def test_another_pour_or_a_time_before_its_entry_lets_a_body_go(tab):
    tab.click(0.05, 0.0)
    tab.draw(number=2, generation=2)
    assert tab.session.watched == (False, None)
    tab.click(0.05, 0.0)
    tab.click(0.05, 0.0)
    assert tab.session.watched == (True, 1)
    early = {name: getattr(BEADS, name)[:1] for name in ("component", "position", "inside", "quaternion", "scale")}
    tab.draw(number=3, **early)
    assert tab.session.watched == (False, None)


def test_what_is_asked_for_is_drawn_when_it_comes(tab):
    tab.person.enter("Colour by", "speed")
    tab.person.enter("Force chains", True)
    tab.draw()
    assert tab.session.watched == (True, None)
    assert not tab.shows_chains
    before = tab.bodies.batched_colors.copy()
    tab.session.found = DETAILS
    tab.draw()
    assert tab.shows_chains
    assert (tab.bodies.batched_colors != before).any()
    assert tab.bodies.opacity < 1.0
    tab.person.enter("Colour by", "component")
    tab.person.enter("Force chains", False)
    tab.draw()
    assert not tab.shows_chains
    assert tab.bodies.opacity is None


@pytest.mark.parametrize("direction", [(0.62, -0.75, 0.24), (0.0, -1.0, 0.0), (0.0, 0.0, 3.0), (1.0, 0.0, -0.2)])
@pytest.mark.parametrize("aspect", [0.5, 1.1, 2.4])
def test_the_pile_is_framed_from_wherever_one_looks(direction, aspect):
    """All points are in the picture, and one is at the edge of the part that is taken up."""
    points = np.random.default_rng(3).normal(size=(50, 3)) * [0.1, 0.06, 0.02]
    view = framing(points, np.array(direction), VIEW_FIELD, aspect)
    back = view.position - view.look_at
    assert back / np.linalg.norm(back) == pytest.approx(direction / np.linalg.norm(direction), abs=2e-3)
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    away = (points - view.position) @ -back
    across = (abs((points - view.look_at) @ right) + BODY_REACH) / (away * math.tan(VIEW_FIELD / 2) * aspect)
    upright = (abs((points - view.look_at) @ np.cross(back, right)) + BODY_REACH) / (away * math.tan(VIEW_FIELD / 2))
    assert (away > 0.0).all()
    assert max(across.max(), upright.max()) == pytest.approx(FRAMED)


def test_the_pile_is_what_has_left_the_funnel():
    rig = load_scene("funnel").rig
    assert outlet_height(rig) == pytest.approx(rig.outlet_height)
    frame = frame_of([0, 0, 0], [[0.0, 0.0, 0.01], [0.1, 0.0, 0.0], [0.0, 0.0, rig.outlet_height + 0.05]])
    assert pile_points(frame, outlet_height(rig)) == pytest.approx(np.float32([[0.0, 0.0, 0.01], [0.1, 0.0, 0.0]]))
    assert len(pile_points(frame, 0.0)) == 3
    assert len(pile_points(None, 0.0)) == 0
    assert outlet_height(load_scene("lifting_cylinder").rig) == pytest.approx(0.0)


def test_a_force_is_told_in_newtons_where_it_is_one():
    assert [force(one) for one in (0.0042, 0.9994, 3.69)] == ["4.2 mN", "999 mN", "3.69 N"]
