"""A slider that does nothing to a standing pile says so; the former pile stays as a ghost until it is dismissed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from explorer.live.messages import Event, SessionState
from explorer.scene.source import change_lines, differences, material_source
from explorer.viewer.panel import Now
from explorer.viewer.pour.ghost import ROOT
from explorer.viewer.pour.standing_panel import WATCHED, StandingPanel, shifts, standing_text
from solver import Outcome, with_values
from solver.observables import Value
from tests.explorer.viewer.page_session import PageSession, frame_of, page_context
from tests.explorer.viewer.person import Person, drawn

SOURCE = material_source("sunflower_extract")
FRICTION = "pair.seed.seed.static_friction"
RESTITUTION = "pair.seed.seed.restitution"
PLACES = np.array([[0.0, 0.0, 0.01], [0.0, 0.02, 0.01], [9.0, 0.0, -9.0]])
INSIDE = [True, True, False]
DISMISS = "Dismiss the ghost"


@pytest.fixture
def table(server):
    """The panel with a person at it, and a session whose pile has come to rest."""
    session = PageSession(SOURCE)
    angle = {"angle_of_repose_deg": Value(21.7, "deg", 2.0)}
    ended = {"state": SessionState.ENDED, "outcome": Outcome.AT_REST, "time": 3.0}
    session.now = replace(session.now, **ended, observables=angle)
    session.newest = frame_of([0, 1, 0], PLACES, INSIDE)
    page = page_context(server, session)
    with server.gui.add_folder("standing") as place:
        panel = StandingPanel(page)
    person = Person(place)

    def look():
        panel.show(Now(session.now, session.newest))
        return person.text

    def pass_time(seconds, moved=0.0):
        places = PLACES + np.array([[moved, 0.0, 0.0], [0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
        session.newest = frame_of([0, 1, 0], places, INSIDE)
        session.now = replace(session.now, state=SessionState.RUNNING, time=session.now.time + seconds)
        return look()

    assert look() == ""
    yield SimpleNamespace(
        panel=panel, person=person, ghost=page.ghost, session=session, look=look, pass_time=pass_time, server=server
    )
    panel.close()


def ghosts(server):
    return drawn(server, f"{ROOT}/bodies/")


def test_a_change_that_moves_nothing_says_that_the_pile_stands(table):
    table.session.set_parameters({FRICTION: 0.39})
    assert table.pass_time(0.5 * WATCHED) == ""
    said = table.pass_time(WATCHED, moved=5e-5)
    assert "static friction seed–seed 0.57 → 0.39: the pile stands (no body moved by more than 0.05 mm)" in said
    assert "friction acts when something moves: shake it, tap it, or pour again." in said


def test_each_parameter_says_when_it_acts(table):
    table.session.set_parameters({RESTITUTION: 0.5, "material.seed.shear_modulus": 7e7})
    said = table.pass_time(WATCHED)
    assert "restitution acts when bodies hit each other" in said
    assert "overlaps by micrometres" in said


def test_a_pile_that_moved_is_not_said_to_stand(table):
    table.session.set_parameters({FRICTION: 0.0})
    said = table.pass_time(WATCHED, moved=4e-3)
    assert "The change itself moved the pile" in said
    assert "1 of 2 bodies by more than 0.5 mm, up to 4.0 mm. static friction seed–seed 0.57 → 0" in said
    assert "stands" not in said


def test_a_change_taken_back_and_a_new_pour_are_silent(table):
    table.session.set_parameters({FRICTION: 0.39})
    table.pass_time(WATCHED)
    table.session.set_parameters({FRICTION: 0.57})
    assert table.look() == ""
    table.session.set_parameters({FRICTION: 0.39})
    assert "the pile stands" in table.look()
    table.session.restart()
    assert "the pile stands" not in table.look()


def test_what_happened_last_stands_there_and_makes_room_for_what_a_change_did(table):
    evil = "<img src=x onerror=alert(1)>"
    happened = Event(table.session.now.generation, 3.0, f"{evil} at rest")
    table.panel.show(Now(table.session.now, table.session.newest, [happened], f"{evil} refused"))
    assert "<img" not in table.person.html
    assert table.person.html.count("&lt;img") == 2
    table.session.set_parameters({FRICTION: 0.39})
    table.pass_time(WATCHED)
    table.panel.show(Now(table.session.now, table.session.newest, table.session.events, "refused"))
    assert "refused" in table.person.text
    assert table.person.text.count("0.57 → 0.39") == 1


def test_poured_again_the_former_pile_stays_as_a_ghost_until_it_is_dismissed(table):
    table.session.set_parameters({FRICTION: 0.39})
    table.pass_time(WATCHED, moved=1e-4)
    assert not table.person.sees(DISMISS)
    table.session.restart()
    said = table.look()
    assert table.ghost.former.angle == 21.7
    assert "Grey: the former pile; since then static friction seed–seed 0.57 → 0.39" in said
    node = ghosts(table.server)[f"{ROOT}/bodies/1"]
    assert node.batched_positions[0] == pytest.approx(PLACES[1])
    assert 0.0 < node.opacity < 0.5
    table.session.restart(with_values(table.session.now.scene, {FRICTION: 0.5}))
    assert table.look() != ""
    table.person.press(DISMISS)
    assert not ghosts(table.server)
    assert table.look() == ""
    assert not table.person.sees(DISMISS)


def test_a_change_of_the_new_pile_is_told_beside_the_ghost(table):
    table.session.set_parameters({FRICTION: 0.39})
    table.pass_time(WATCHED)
    table.session.restart()
    table.session.newest = frame_of([0, 1, 0], PLACES, INSIDE)
    table.session.now = replace(table.session.now, state=SessionState.ENDED, outcome=Outcome.AT_REST, time=3.0)
    table.look()
    table.session.set_parameters({FRICTION: 0.3})
    said = table.pass_time(WATCHED)
    assert "Grey: the former pile" in said
    assert "0.39 → 0.3: the pile stands" in said


def test_a_ghost_goes_with_its_set_up(table):
    table.session.set_parameters({FRICTION: 0.39})
    table.pass_time(WATCHED)
    table.session.restart()
    assert table.look() != ""
    assert ghosts(table.server)
    table.session.restart(with_values(table.session.now.scene, {"rig.mass": "20g"}))
    assert table.look() == ""
    assert not ghosts(table.server)


def test_the_shift_is_that_of_the_bodies_in_the_domain():
    before, after = (frame_of([0, 0, 0], PLACES + k * np.array([[0.0], [0.003], [1.0]]), INSIDE) for k in (0, 1))
    assert shifts(before, after) == pytest.approx([0.0, np.sqrt(3) * 0.003], rel=1e-5)
    assert shifts(before, frame_of([0], PLACES[:1])).size == 0


def test_a_pile_of_which_a_few_bodies_slipped_still_stands():
    smooth = with_values(SOURCE.scene, {FRICTION: 0.39})
    moved = np.full(40, 1e-5)
    moved[:3] = 1.1e-3
    assert "the pile stands" in standing_text(SOURCE.scene, smooth, moved)
    assert "(3 of 40 bodies by more than 0.5 mm, up to 1.1 mm)" in standing_text(SOURCE.scene, smooth, moved)
    moved[:5] = 1.1e-3
    assert "it was not poured with these values" in standing_text(SOURCE.scene, smooth, moved)


def test_many_changes_of_one_parameter_are_told_as_their_span():
    smooth = {f"pair.{pair.a}.{pair.b}.static_friction": 0.2 for pair in SOURCE.scene.pairs}
    found = list(differences(SOURCE.scene, with_values(SOURCE.scene, {**smooth, "rig.mass": "20g"})))
    # Table 3 of the article: static friction between 0.54 and 0.83.
    assert change_lines(found) == ["static friction of 9 pairs 0.54 … 0.83 → 0.2", "mass 30 g → 20 g"]
    wider = {f"body.{body.name}.size_spread": 0.1 for body in SOURCE.scene.bodies}
    assert change_lines(differences(SOURCE.scene, with_values(SOURCE.scene, wider))) == [
        "size spread of 3 bodies 0 → 0.1"
    ]
