"""The matrix of pairs: every pair has a box, one box changes one pair, and the boxes follow the solver."""

import math
from dataclasses import replace

import pytest

from explorer.scene.source import material_source
from explorer.units import InputError
from explorer.viewer.pour.live_panel import LivePanel, pair_targets
from explorer.viewer.pour.pair_matrix import BOXES, PairMatrix, matrix_html, pair_parameters, triangle
from explorer.viewer.pour.restart_panel import RestartPanel, label
from solver.params import declared
from solver.scenes.material import Pair
from solver.scenes.scene import canonical, parameters, value, with_rig, with_values
from tests.explorer.beads import bead_scene
from tests.explorer.viewer.page_session import PageSession, page_context
from tests.explorer.viewer.person import Person

SOURCE = material_source("sunflower_extract")
SCENE = SOURCE.scene


def matrix(server, name="static_friction"):
    """The matrix, a person at its boxes, and a list of what is sent to the solver."""
    sent = []
    with server.gui.add_folder("matrix") as place:
        made = PairMatrix(server.gui, SCENE, name, lambda action: action(), sent.append)
    return made, Person(place), sent


def many(count):
    names = [f"m{k}" for k in range(count)]
    return replace(SCENE, pairs=tuple(Pair(a, b, 0.5, 0.5) for k, a in enumerate(names) for b in names[k:]))


@pytest.mark.parametrize("scene", [SCENE, bead_scene(), many(8)], ids=["sunflower", "beads", "eight"])
def test_every_pair_has_exactly_one_box(scene):
    rows = list(triangle(scene))
    boxes = [frozenset((one, other)) for one, others in rows for other in others]
    assert len(boxes) == len(set(boxes)) == len(scene.pairs)
    assert set(boxes) == {frozenset((pair.a, pair.b)) for pair in scene.pairs}
    assert all(1 <= len(others) <= BOXES for _, others in rows)


def test_all_that_pairs_have_is_there():
    live = {path.split(".")[-1] for path, one in parameters(SCENE).items() if one.live and path.startswith("pair.")}
    assert set(pair_parameters()) == live == {"static_friction", "restitution"}


def test_one_box_changes_one_pair(server):
    _, person, sent = matrix(server)
    assert person.value("petiole") == (0.54, 0.82, 0.83)
    person.enter("petiole", (0.54, 0.3, 0.83))
    assert [{canonical(SCENE, path): number for path, number in values.items()} for values in sent] == [
        {"pair.plate.petiole.static_friction": 0.3}
    ]
    person.enter("seed", 0.2)
    assert sent[-1] == {"pair.seed.seed.static_friction": 0.2}
    # The same again is no change.
    person.enter("seed", 0.2)
    assert len(sent) == 2


@pytest.mark.parametrize("sent_value", [(0.5, 0.6), (0.5, math.nan, 0.5), (0.5, "x", 0.5), None, {"a": 1}])
def test_what_is_no_row_of_numbers_is_refused(server, sent_value):
    _, person, sent = matrix(server)
    with pytest.raises(InputError):
        person.send("petiole", sent_value)
    assert sent == []


def test_a_number_out_of_range_is_taken_as_its_end(server):
    _, person, sent = matrix(server, "restitution")
    high = declared(Pair, "pair")["pair.restitution"].high
    person.send("plate", (99.0, 0.56))
    assert sent == [{"pair.plate.seed.restitution": high}]


def test_the_boxes_follow_the_solver_unless_a_person_is_at_the_row(server, monkeypatch):
    made, person, _ = matrix(server)
    changed = with_values(SCENE, {"pair.seed.seed.static_friction": 0.1, "pair.plate.petiole.static_friction": 0.2})
    person.enter("petiole", (0.54, 0.3, 0.83))
    made.follow(changed)
    assert person.value("seed") == 0.1
    assert person.value("petiole") == (0.54, 0.3, 0.83)
    monkeypatch.setattr("explorer.viewer.actions.HANDS_OFF", 0.0)  # the person has let go
    made.follow(changed)
    assert person.value("petiole") == (0.54, 0.2, 0.83)


def test_the_solver_does_not_take_back_a_box_before_the_call_of_it_comes(server):
    made, person, sent = matrix(server)
    person.send("seed", 0.2, before_call=lambda: made.follow(SCENE))
    assert sent == [{"pair.seed.seed.static_friction": 0.2}]


@pytest.mark.parametrize("name", ["petiole", "seed"])
def test_a_number_that_is_none_is_no_hand(server, name, monkeypatch):
    made, person, _ = matrix(server)
    monkeypatch.setattr("explorer.viewer.actions.HANDS_OFF", 0.0)
    before = person.value(name)
    with pytest.raises(InputError):
        person.send(name, math.nan if name == "seed" else (math.nan,) * 3)
    made.follow(SCENE)
    assert person.value(name) == before


def test_the_table_is_symmetric_and_tells_what_is_missing():
    html = matrix_html(SCENE, declared(Pair, "pair")["pair.static_friction"], "static_friction")
    assert html.count(">0.82<") == 2
    assert html.count(">0.57<") == 1
    # Wall against wall.
    assert html.count(">–<") == 1
    evil = replace(SCENE, pairs=(Pair("<img src=x>", "b", 0.5, 0.5),))
    assert "<img" not in matrix_html(evil, declared(Pair, "pair")["pair.restitution"], "restitution")


def test_panels_follow_a_scene_with_other_parameters(server):
    session = PageSession(SOURCE)
    page = page_context(server, session)
    with server.gui.add_folder("live") as live_place:
        live = LivePanel(page)
    with server.gui.add_folder("set-up") as set_up_place:
        set_up = RestartPanel(page)
    at_live, at_set_up = Person(live_place), Person(set_up_place)
    first = live.controls(SCENE)
    assert live.controls(with_values(SCENE, {"pair.seed.seed.static_friction": 0.1})) is first
    drum = with_rig(SCENE, "rotating_drum")
    height, speed = "Outlet height [mm]", label(parameters(drum)["rig.speed_rpm"])
    assert (at_set_up.sees(height), at_set_up.sees(speed)) == (True, False)
    set_up.controls(drum)
    assert (at_set_up.sees(height), at_set_up.sees(speed)) == (False, True)
    assert at_live.options("Pair") == tuple(pair_targets(SCENE))
    session.start(bead_scene(), 1)
    second = live.controls(bead_scene())
    assert second is not first
    second.show(session.status())
    friction = at_live.within("Static friction of every pair (acts now)")
    assert value(bead_scene(), "pair.bead.steel.static_friction") == friction.value("steel")
    # There is one of them: the old controls are gone from the page.
    assert at_live.options("Pair") == tuple(pair_targets(bead_scene()))
