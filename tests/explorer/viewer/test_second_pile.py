"""The second pile: poured as the first is, drawn beside it, in step with it, and gone when it is taken away."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from explorer.diagnosis.piles import surface_of_revolution
from explorer.errors import CommandError
from explorer.live.frames import Frame
from explorer.live.messages import SessionState, Status
from explorer.scene.file import load_scene
from explorer.scene.meshes import PLATE_NAME
from explorer.viewer.guarded_server import guarded_server
from explorer.viewer.look.camera import go_to_place
from explorer.viewer.panel import Now
from explorer.viewer.pour.beside_pile import BESIDE, ROOT, BesidePile, stand_aside
from explorer.viewer.pour.second_pile import NONE, POUR_SECOND, SecondPile, comparison_markdown
from explorer.viewer.scene_nodes import PLATE_RADIUS, SceneNodes
from solver import Outcome, with_values
from solver.observables import Value
from tests.explorer.viewer.page_session import page_context
from tests.explorer.viewer.person import Person, drawn

SCENE = with_values(load_scene("funnel"), {"rig.mass": 2e-3, "body.spheres": "coarse"})


class FakeSession:
    """A session that does as it is told, and remembers what that was."""

    def __init__(self, scene=SCENE):
        self.now = Status(SessionState.RUNNING, "", scene, seed=4, generation=1, speed=1.0)
        self.told = []
        self.newest = None

    def start(self, scene, seed):
        self.told.append(("start", scene, seed))
        self.now = replace(self.now, scene=scene, seed=seed, generation=self.now.generation + 1)

    def status(self):
        return self.now

    def frame(self):
        return self.newest

    def pause(self):
        self.told.append("pause")

    def play(self):
        self.told.append("play")

    def back_to(self, time):
        self.told.append(("back to", pytest.approx(time)))

    def set_speed(self, factor):
        self.told.append(("speed", factor))

    def close(self):
        self.told.append("close")


def frame(number):
    return Frame(
        number,
        1,
        0.1,
        np.full((1, 3), 0.05, dtype=np.float32),
        np.array([[1.0, 0.0, 0.0, 0.0]], dtype=np.float32),
        np.zeros(1, dtype=np.int32),
        np.ones(1, dtype=bool),
        np.ones(1, dtype=np.float32),
    )


@pytest.fixture
def bench():
    """Server, both sessions, the piles, the panel and a person at it; actions are carried out at once."""
    server = guarded_server("127.0.0.1", 0, "test")
    first, second = FakeSession(), FakeSession()
    page = page_context(server, first)
    page.__dict__["beside"] = BesidePile(server, first, lambda: second)
    with server.gui.add_folder("Second pile") as place:
        panel = SecondPile(page)
    person = Person(place)
    yield SimpleNamespace(server=server, first=first, second=second, beside=page.beside, panel=panel, person=person)
    server.stop()


def nodes(server):
    # The empty parents that viser makes by itself draw nothing.
    made = {f"{ROOT}/bodies", f"{ROOT}/rig"}
    return drawn(server, f"{ROOT}/").keys() - made


def signs(server):
    """What stands above the piles, and where."""
    return {sign.text: sign.position[0] for sign in drawn(server, "/names/").values()}


def drawn_radius(server, root):
    """Of the plate that is drawn below ``root`` [m]."""
    (plate,) = drawn(server, f"{root}/rig/{PLATE_NAME}").values()
    return np.hypot(*plate.vertices[:, :2].T).max() * plate.scale[0]


def test_it_is_poured_with_the_first_one_s_scene_and_seed_and_drawn_beside_it(bench):
    assert bench.person.html == NONE
    bench.person.press(POUR_SECOND)
    assert bench.second.told == [("start", SCENE, 4)]
    bench.second.newest = frame(1)
    bench.panel.draw(Now(bench.first.now))
    assert f"{ROOT}/rig/cone" in nodes(bench.server)
    seeds = drawn(bench.server)[f"{ROOT}/bodies/0"]
    assert seeds.batched_positions[0] == pytest.approx([0.05] * 3)
    assert drawn(bench.server)[ROOT].position[0] == BESIDE


def test_a_second_pour_that_is_refused_leaves_the_page_as_it_was(bench, monkeypatch):
    def refuse(scene, seed):
        raise CommandError("rig.mass: 9 kg are too many bodies")

    monkeypatch.setattr(bench.second, "start", refuse)
    monkeypatch.setattr(bench.second, "status", lambda: pytest.fail("no pour has been started"))
    with pytest.raises(CommandError, match="too many bodies"):
        bench.person.press(POUR_SECOND)
    bench.panel.draw(Now(bench.first.now))
    bench.panel.show(Now(bench.first.now))
    assert bench.person.html == NONE
    assert not signs(bench.server)


def test_it_stays_as_it_was_while_the_first_is_changed_and_the_difference_is_told(bench):
    bench.person.press(POUR_SECOND)
    rougher = with_values(SCENE, {"pair.seed.seed.static_friction": 0.9})
    bench.first.now = replace(bench.first.now, scene=rougher)
    bench.panel.show(Now(bench.first.now))
    assert "static friction seed–seed 0.57 → 0.9" in bench.person.text
    assert bench.second.now.scene == SCENE


def test_it_pauses_plays_and_keeps_speed_with_the_first(bench):
    bench.person.press(POUR_SECOND)
    bench.second.told.clear()
    bench.first.now = replace(bench.first.now, state=SessionState.PAUSED, speed=0.5)
    bench.panel.show(Now(bench.first.now))
    assert bench.second.told == ["pause", ("speed", 0.5)]
    bench.second.told.clear()
    bench.second.now = replace(bench.second.now, state=SessionState.PAUSED, speed=0.5)
    bench.panel.show(Now(bench.first.now))
    assert bench.second.told == []
    bench.panel.show(Now(replace(bench.first.now, state=SessionState.RUNNING)))
    assert bench.second.told == ["play"]


def test_where_the_first_stands_still_the_second_comes_to_its_moment(bench):
    bench.person.press(POUR_SECOND)
    bench.second.told.clear()
    first = replace(bench.first.now, state=SessionState.PAUSED, time=0.5)
    for time, state, asked in (
        (0.7, SessionState.RUNNING, "pause"),
        (0.7, SessionState.PAUSED, ("back to", 0.5)),
        (0.7, SessionState.ENDED, ("back to", 0.5)),
        (0.3, SessionState.PAUSED, "play"),
        (0.3, SessionState.RUNNING, None),
        (0.502, SessionState.PAUSED, None),
    ):
        bench.second.now = replace(bench.second.now, state=state, time=time, earliest=0.0)
        bench.panel.show(Now(first))
        assert bench.second.told == ([] if asked is None else [asked]), (time, state)
        bench.second.told.clear()
    bench.second.now = replace(bench.second.now, state=SessionState.PAUSED, time=0.7, earliest=0.6)
    bench.panel.show(Now(first))
    assert bench.second.told == []  # so far back nothing is kept


def test_taken_away_it_leaves_nothing(bench):
    bench.person.press(POUR_SECOND)
    bench.second.newest = frame(1)
    bench.panel.draw(Now(bench.first.now))
    bench.panel.close()
    bench.panel.show(Now(bench.first.now))
    assert bench.second.told[-1] == "close"
    assert nodes(bench.server) == set()
    assert bench.person.html == NONE
    bench.panel.close()


def test_both_results_stand_side_by_side():
    rest = {"angle_of_repose_deg": Value(24.0, "deg", 3.0)}
    first = Status(
        SessionState.ENDED, "", SCENE, 1, 1, 1.0, outcome=Outcome.AT_REST, observables=rest, discharged_mass=2e-3
    )
    second = replace(first, observables={"angle_of_repose_deg": Value(20.5, "deg")}, outcome=Outcome.JAMMED)
    text = comparison_markdown(first, second)
    assert "| angle of repose | 24.0°, SD over flanks 3.0° | 20.5° |" in text
    assert "| state | at rest: a valid pile | jammed: material stays in the rig |" in text
    assert "**+3.5°**" in text
    assert "Same parameters." in text


def test_a_solver_that_died_says_so_without_markup():
    first = Status(SessionState.RUNNING, "", SCENE, 1, 1, 1.0)
    text = comparison_markdown(first, replace(first, state=SessionState.DIED, message="<b>killed</b>"))
    assert "&lt;b&gt;killed&lt;/b&gt;" in text


def test_a_measured_pile_stands_on_the_other_side_with_names_above_all_three(bench):
    surface = surface_of_revolution(np.array([0.01, 0.03]), np.array([0.02, 0.0]))
    bench.beside.pour(SCENE, 4, ("calibrated model", "corrected model"))
    bench.beside.show_measured(surface, "measured\n18.0°", SCENE)
    assert drawn(bench.server)["/measured"].position[0] == -BESIDE
    names = {text.split("\n")[0]: place for text, place in signs(bench.server).items()}
    assert names == {"measured": -BESIDE, "calibrated model": 0.0, "corrected model": BESIDE}
    bench.panel.close()
    assert not signs(bench.server)
    assert not drawn(bench.server, "/measured")


def test_each_name_says_what_its_pour_has_come_to(bench):
    bench.person.press(POUR_SECOND)
    rest = {"angle_of_repose_deg": Value(24.0, "deg", 3.0)}
    ended = replace(bench.first.now, state=SessionState.ENDED, outcome=Outcome.AT_REST, observables=rest)
    bench.second.now = replace(bench.second.now, time=0.52)

    def said():
        return [text.replace("\n", ": ") for text in signs(bench.server)]

    bench.panel.show(Now(ended))
    assert said() == ["first pour: 24.0°, one pour", "second pour: pouring, 0.5 s"]
    bench.second.now = replace(ended, outcome=Outcome.JAMMED)
    bench.panel.show(Now(ended))
    assert said()[1] == "second pour: jammed"
    bench.second.now = replace(ended, observables={})
    bench.panel.show(Now(replace(bench.first.now, state=SessionState.DIED)))
    assert said() == ["first pour: solver gone", "second pour: at rest, no angle"]


class Camera:
    """As viser's: a new position takes the point that is looked at along."""

    image_width, image_height, fov = 600, 1000, 0.6

    def __init__(self):
        self._position, self.look_at = np.array([0.3, -0.4, 0.2]), np.array([0.0, 0.0, 0.05])

    @property
    def position(self):
        return self._position

    @position.setter
    def position(self, position):
        self.look_at = self.look_at + (np.asarray(position) - self._position)
        self._position = np.asarray(position)


@pytest.mark.parametrize(("middle", "axes"), [(0.5 * BESIDE, (0.0, BESIDE)), (0.0, (-BESIDE, 0.0, BESIDE))])
@pytest.mark.parametrize("width", [390, 1280])
def test_every_camera_looks_at_the_middle_from_where_all_plates_are_in_the_picture(middle, axes, width):
    client = SimpleNamespace(camera=Camera(), atomic=nullcontext)
    client.camera.image_width = width
    before = client.camera.position - client.camera.look_at
    go_to_place(client, stand_aside(client.camera, before, SCENE, middle))
    camera = client.camera
    assert camera.look_at[0] == pytest.approx(middle)
    away = camera.position - camera.look_at
    np.testing.assert_allclose(away / np.linalg.norm(away), before / np.linalg.norm(before))
    # The picture of a pinhole: across over depth, for points all around every plate.
    forward = -away / np.linalg.norm(away)
    right = np.cross(forward, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(forward, [0.0, 0.0, 1.0]))
    around = np.linspace(0.0, 2.0 * np.pi, 100)
    for axis in axes:
        rim = np.stack([axis + PLATE_RADIUS * np.cos(around), PLATE_RADIUS * np.sin(around), 0.0 * around], axis=1)
        seen = rim - camera.position
        across = (seen @ right) / (seen @ forward)
        assert np.abs(across).max() < 1.1 * np.tan(0.5 * camera.fov) * width / camera.image_height


def test_a_picture_of_another_shape_holds_all_plates_again_unless_a_person_moved_the_camera(bench, monkeypatch):
    client = SimpleNamespace(camera=Camera(), atomic=nullcontext)
    monkeypatch.setattr(bench.server, "get_clients", lambda: {3: client})
    bench.person.press(POUR_SECOND)
    narrow = np.linalg.norm(client.camera.position - client.camera.look_at)
    client.camera.image_width *= 2  # a panel was folded away
    bench.panel.draw(Now(bench.first.now))
    wide = np.linalg.norm(client.camera.position - client.camera.look_at)
    assert wide < 0.7 * narrow
    client.camera.position = client.camera.position + np.array([0.0, 0.0, 0.1])
    moved = client.camera.position
    client.camera.image_width *= 2
    bench.panel.draw(Now(bench.first.now))
    np.testing.assert_array_equal(client.camera.position, moved)


def test_a_plate_does_not_grow_over_the_one_beside_it(bench):
    """A body has rolled 0.9 m away: alone its plate follows it, beside another one it does not."""
    beside = bench.beside
    assert beside.widest_plate == float("inf")
    bench.person.press(POUR_SECOND)
    assert beside.widest_plate == PLATE_RADIUS
    far = replace(frame(1), position=np.float32([[0.9, 0.0, 0.0]]))
    bench.second.newest = far
    bench.panel.draw(Now(bench.first.now))
    assert drawn_radius(bench.server, ROOT) == pytest.approx(PLATE_RADIUS)
    alone = SceneNodes(bench.server, SCENE, "/alone")
    alone.show(far)
    assert drawn_radius(bench.server, "/alone") > 0.9
    beside.close()
    assert beside.widest_plate == float("inf")
