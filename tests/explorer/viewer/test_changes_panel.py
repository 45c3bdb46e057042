"""Undo, redo, presets and the way back to the default, as the page asks the session for them."""

from dataclasses import replace

import pytest

from explorer.errors import CommandError
from explorer.scene.source import differences, material_source
from explorer.viewer.actions import Actions
from explorer.viewer.panel import Now
from explorer.viewer.pour.changes_panel import (
    BACK,
    DEFAULT,
    MOST_SHOWN,
    NO_PRESET,
    REDO,
    UNDO,
    ChangesPanel,
    changes_html,
)
from solver.scenes.scene import value, with_values
from tests.explorer.viewer.page_session import PageSession, page_context
from tests.explorer.viewer.person import Person

SOURCE = material_source("sunflower_extract")
FRICTION, MASS = "pair.seed.seed.static_friction", "rig.mass"


class Bench:
    """A panel with a person at it, its session, and the page's loop by hand."""

    def __init__(self, server, folder):
        self.session, self.actions = PageSession(SOURCE), Actions()
        with server.gui.add_folder("Changes and presets") as place:
            self.panel = ChangesPanel(page_context(server, self.session, self.actions.post, folder))
        self.person = Person(place, self.turn)
        self.turn()

    def turn(self):
        """One turn of the page's loop: the notice, after all panels have followed."""
        notice = self.actions.carry_out()
        self.panel.draw(Now(self.session.status()))
        self.panel.show(Now(self.session.status()))
        return notice

    def change(self, **values):
        names = {"friction": FRICTION, "mass": MASS}
        self.session.now = replace(
            self.session.now,
            scene=with_values(self.session.now.scene, {names[key]: number for key, number in values.items()}),
        )
        self.turn()

    def friction(self):
        return value(self.session.now.scene, FRICTION)


@pytest.fixture
def bench(server, tmp_path):
    return Bench(server, tmp_path)


def test_undo_takes_back_what_anybody_changed_and_redo_brings_it_again(bench):
    bench.change(friction=0.1)
    assert bench.person.press(UNDO) == ""
    assert bench.friction() == 0.57
    assert bench.person.press(UNDO) == "nothing to undo: no live parameter was changed"
    assert bench.person.press(REDO) == ""
    assert bench.friction() == 0.1
    assert bench.person.press(REDO) == "nothing to redo"


def test_an_undo_that_the_session_refuses_can_be_asked_again(bench, monkeypatch):
    bench.change(friction=0.1)

    def refuse(values):
        raise CommandError("the solver process does not run")

    with monkeypatch.context() as patch:
        patch.setattr(bench.session, "set_parameters", refuse)
        assert bench.person.press(UNDO) == "the solver process does not run"
    assert bench.person.press(UNDO) == ""
    assert bench.friction() == 0.57


def test_a_preset_is_one_step_of_the_history(bench):
    assert bench.person.enter("Preset", "frictionless") == ""
    assert {pair.static_friction for pair in bench.session.now.scene.pairs} == {0.0}
    assert "No contact holds by friction" in bench.person.text
    bench.person.press(UNDO)
    assert bench.session.now.scene == SOURCE.scene


def test_the_list_tells_default_and_now_and_one_choice_leads_back(bench):
    bench.change(friction=0.1, mass=0.012)
    content = bench.person.html
    assert "0.57 → <b>0.1</b>" in content
    assert "(on restart)" in content
    assert "30 g → <b>12 g</b>" in content
    assert bench.person.options("Back to default")[1:] == (FRICTION,)
    assert bench.person.enter("Back to default", FRICTION) == ""
    assert bench.friction() == 0.57
    assert value(bench.session.now.scene, MASS) == 0.012


def test_all_back_keeps_the_pour_and_the_default_is_a_new_one(bench):
    bench.change(friction=0.1, mass=0.012)
    bench.person.press(BACK)
    assert (bench.friction(), bench.session.asked) == (0.57, ["set_parameters"])
    bench.person.press(DEFAULT)
    assert bench.session.now.scene == SOURCE.scene
    assert bench.session.asked == ["set_parameters", "start"]


def test_a_preset_of_ones_own_is_saved_offered_and_applied(bench, tmp_path):
    bench.change(friction=0.1, mass=0.012)
    bench.person.enter("Name", "my try")
    assert bench.person.press("Save as preset") == ""
    assert (tmp_path / "presets" / "my try.toml").is_file()
    assert "my try (own)" in bench.person.options("Preset")
    changed = bench.session.now.scene
    bench.person.press(DEFAULT)
    # It names the mass, which acts on restart: a new pour.
    assert bench.person.enter("Preset", "my try (own)") == ""
    assert bench.session.now.scene == changed
    assert bench.session.asked[-1] == "start"


def test_a_button_that_is_not_there_does_nothing(bench):
    assert bench.person.send("Changes", "Delete everything") == ""
    assert bench.session.asked == []


@pytest.mark.parametrize("name", ["../../etc/passwd", "no such preset"])
def test_a_preset_that_is_not_offered_is_refused(bench, name):
    assert "no such preset" in bench.person.send("Preset", name)
    assert bench.session.asked == []


def test_a_bad_file_is_one_line_and_changes_nothing(bench, tmp_path):
    (tmp_path / "presets").mkdir()
    (tmp_path / "presets" / "bad.toml").write_text("format = 1\n[values]\n'pair.*.*.static_friction' = 'much'\n")
    assert "is not a number" in bench.person.send("Preset", "bad (own)")
    assert bench.session.asked == []


def test_a_preset_that_is_refused_can_be_chosen_again(server, tmp_path):
    (tmp_path / "presets").mkdir()
    (tmp_path / "presets" / "other.toml").write_text("format = 1\n[values]\n'pair.bean.bean.static_friction' = 0.3\n")
    person = Bench(server, tmp_path).person
    assert "pair.bean" in person.enter("Preset", "other (own)")
    assert person.value("Preset") == NO_PRESET


def test_texts_of_the_list_are_escaped_and_a_long_list_is_cut():
    found = list(differences(SOURCE.scene, with_values(SOURCE.scene, {FRICTION: 0.1})))
    evil = replace(found[0], path="<img src=x>")
    assert "<img" not in changes_html([evil], 1, 0)
    assert "and 2 more" in changes_html([evil] * (MOST_SHOWN + 2), 1, 0)
    assert "Everything is at its default" in changes_html([], 0, 0)
