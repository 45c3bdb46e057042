"""The matrix of pairs: every pair has a box, one box changes one pair, and the boxes follow the solver."""

import math
from dataclasses import replace

import pytest

from explorer.scene.source import material_source
from explorer.units import InputError
from explorer.viewer.pour.live_panel import BOXES, LivePanel, PairMatrix, matrix_html, pair_parameters, triangle
from explorer.viewer.pour.restart_panel import RestartPanel
from solver.params import declared
from solver.scenes.material import Pair
from solver.scenes.scene import canonical, parameters, value, with_rig, with_values
from tests.explorer.beads import bead_scene
from tests.explorer.viewer.page_session import PageSession, event, page_context

SOURCE = material_source("sunflower_extract")
SCENE = SOURCE.scene


def matrix(server, name="static_friction"):
    sent = []
    made = PairMatrix(server.gui, SCENE, name, lambda action: action(), sent.append)
    return made, sent


def row(made, name):
    return next(one for one in made._rows if one.paths[0].startswith(f"pair.{name}."))


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
    made, sent = matrix(server)
    petiole = row(made, "petiole")
    assert petiole.handle.value == (0.54, 0.82, 0.83)
    event(petiole.handle, (0.54, 0.3, 0.83))
    assert [{canonical(SCENE, path): number for path, number in values.items()} for values in sent] == [
        {"pair.plate.petiole.static_friction": 0.3}
    ]
    event(row(made, "seed").handle, 0.2)
    assert sent[-1] == {"pair.seed.seed.static_friction": 0.2}
    # The same again is no change.
    event(row(made, "seed").handle, 0.2)
    assert len(sent) == 2


@pytest.mark.parametrize("sent_value", [(0.5, 0.6), (0.5, math.nan, 0.5), (0.5, "x", 0.5), None, {"a": 1}])
def test_what_is_no_row_of_numbers_is_refused(server, sent_value):
    made, sent = matrix(server)
    with pytest.raises(InputError):
        event(row(made, "petiole").handle, sent_value)
    assert sent == []


def test_a_number_out_of_range_is_taken_as_its_end(server):
    made, sent = matrix(server, "restitution")
    high = declared(Pair, "pair")["pair.restitution"].high
    event(row(made, "plate").handle, (99.0, 0.56))
    assert sent == [{"pair.plate.seed.restitution": high}]


def test_the_boxes_follow_the_solver_unless_a_person_is_at_the_row(server):
    made, _ = matrix(server)
    changed = with_values(SCENE, {"pair.seed.seed.static_friction": 0.1, "pair.plate.petiole.static_friction": 0.2})
    event(row(made, "petiole").handle, (0.54, 0.3, 0.83))
    made.follow(changed)
    assert row(made, "seed").handle.value == 0.1
    assert row(made, "petiole").handle.value == (0.54, 0.82, 0.83)
    row(made, "petiole").touched = -math.inf
    made.follow(changed)
    assert row(made, "petiole").handle.value == (0.54, 0.2, 0.83)


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
    live, set_up = LivePanel(page), RestartPanel(page)
    first = live.controls(SCENE)
    assert live.controls(with_values(SCENE, {"pair.seed.seed.static_friction": 0.1})) is first
    drum = with_rig(SCENE, "rotating_drum")
    assert "rig.speed_rpm" in set_up.controls(drum)._inputs
    assert "rig.outlet_height" not in set_up.controls(drum)._inputs
    session.start(bead_scene(), 1)
    second = live.controls(bead_scene())
    assert second is not first
    second.show(session.status())
    assert value(bead_scene(), "pair.bead.steel.static_friction") == row(second._matrices[0], "steel").handle.value
    # The old widgets are gone from the page.
    assert first._sections[0]._chooser._impl.removed
