"""Undo and redo along what the solver had in force."""

import pytest

from explorer.errors import CommandError
from explorer.scene.source import change_lines, differences
from explorer.viewer.pour.changes_panel import MERGED, ParameterHistory, live_values
from solver import load_material, parameters, value, with_values
from solver.scenes.scene import values

SCENE = load_material("sunflower_extract")
A, B = "pair.seed.seed.static_friction", "pair.seed.seed.restitution"


def put(scene, **changed):
    return with_values(scene, {{"a": A, "b": B, "mass": "rig.mass"}[key]: number for key, number in changed.items()})


def taken(*scenes, every=10.0):
    history = ParameterHistory()
    for k, scene in enumerate(scenes):
        history.take(scene, every * k)
    return history


def test_every_value_stands_under_its_path():
    assert values(SCENE) == {path: value(SCENE, path) for path in parameters(SCENE)}
    assert set(live_values(SCENE)) == {path for path, parameter in parameters(SCENE).items() if parameter.live}


def test_undo_and_redo_go_along_the_changes():
    first, second = put(SCENE, a=0.1), put(SCENE, a=0.1, b=0.2)
    history = taken(SCENE, first, second)
    assert (history.undoable, history.redoable) == (2, 0)
    assert history.undo() == {B: value(SCENE, B)}
    history.take(first, 30.0)
    assert history.undo() == {A: value(SCENE, A)}
    history.take(SCENE, 40.0)
    with pytest.raises(CommandError, match="nothing to undo"):
        history.undo()
    assert history.redo() == {A: 0.1}
    history.take(first, 50.0)
    assert (history.undoable, history.redoable) == (1, 1)
    assert history.redo() == {B: 0.2}
    history.take(second, 60.0)
    with pytest.raises(CommandError, match="nothing to redo"):
        history.redo()


def test_two_undos_before_the_solver_has_answered_the_first():
    first, second = put(SCENE, a=0.1), put(SCENE, a=0.1, b=0.2)
    history = taken(SCENE, first, second)
    assert history.undo() == {B: value(SCENE, B)}
    assert history.undo() == {A: value(SCENE, A)}
    history.take(first, 30.0)
    history.take(SCENE, 31.0)
    assert (history.undoable, history.redoable) == (0, 2)


def test_a_change_after_an_undo_takes_the_place_of_what_was_undone():
    first = put(SCENE, a=0.1)
    history = taken(SCENE, first)
    history.undo()
    history.take(SCENE, 20.0)
    history.take(put(SCENE, a=0.3), 30.0)
    assert (history.undoable, history.redoable) == (1, 0)
    assert history.undo() == {A: value(SCENE, A)}


def test_a_drag_of_one_slider_is_one_entry_and_a_pause_ends_it():
    drag = [put(SCENE, a=0.01 * k) for k in range(10, 20)]
    history = taken(SCENE, *drag, every=0.5 * MERGED)
    assert history.undoable == 1
    assert taken(SCENE, *drag, every=1.5 * MERGED).undoable == 10
    assert taken(SCENE, put(SCENE, a=0.1), put(SCENE, a=0.1, b=0.3), every=0.1).undoable == 2


def test_a_restart_keeps_the_history_and_its_set_up_is_no_entry():
    history = taken(SCENE, put(SCENE, a=0.1), put(SCENE, a=0.1, mass="12g"))
    assert history.undoable == 1
    assert history.undo() == {A: value(SCENE, A)}


def test_another_material_begins_anew():
    history = taken(SCENE, put(SCENE, a=0.1), load_material("nine_sphere_seed"))
    assert (history.undoable, history.redoable) == (0, 0)


def test_differences_tell_old_and_new_with_units_and_what_acts_now():
    found = list(differences(SCENE, put(SCENE, a=0.1, mass="12g")))
    assert [str(one) for one in found] == [f"{A}: 0.57 → 0.1", "rig.mass: 30 g → 12 g"]
    assert [one.live for one in found] == [True, False]
    # A change that the four digits of the screen do not show is told in full.
    assert change_lines(differences(SCENE, put(SCENE, a=0.5700001))) == ["static friction seed–seed 0.57 → 0.5700001"]
