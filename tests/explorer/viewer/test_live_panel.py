"""What the page makes of parameters, and what it takes from a browser."""

import math
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from explorer.live.messages import SessionState, Status
from explorer.scene.source import material_source
from explorer.units import InputError, checked, quantity, screen_unit, title
from explorer.viewer.actions import Actions
from explorer.viewer.panel import Now
from explorer.viewer.pour.controls_panel import ControlsPanel
from explorer.viewer.pour.live_panel import (
    LiveSections,
    echo_html,
    effect_targets,
    live_parameters,
    material_targets,
    pair_targets,
)
from explorer.viewer.pour.live_sliders import LiveControl, decade_mark, decades_around, factor_range
from explorer.viewer.pour.restart_panel import PATHS, SetUpInputs, entered, label, size_paths
from solver import load_material, parameters, with_values
from solver.rigs import RIGS
from solver.scenes.scene import value, with_rig
from solver.scenes.sizes import SizeDistribution
from tests.explorer.viewer.page_session import PageSession, page_context
from tests.explorer.viewer.person import Person

SCENE = load_material("sunflower_extract")
KNOWN = parameters(SCENE)


@pytest.mark.parametrize(("number", "taken"), [(0.4, 0.4), (7.5, 3.0), (-1, 0.0), (2, 2.0)])
def test_numbers_from_a_browser_are_clamped(number, taken):
    assert checked(number, 0.0, 3.0, "friction") == taken


@pytest.mark.parametrize("number", [math.nan, math.inf, None, "0.5", [0.5], True, {"a": 1}])
def test_what_is_no_finite_number_is_refused(number):
    with pytest.raises(InputError, match=r"friction: .* is not a finite number"):
        checked(number, 0.0, 3.0, "friction")


@pytest.mark.parametrize("path", sorted(path for path in KNOWN if not KNOWN[path].choices))
def test_the_screen_shows_a_value_that_leads_back_to_it(path):
    unit, number = screen_unit(KNOWN[path]), value(SCENE, path)
    # Six digits are shown.
    assert unit.to_si(unit.to_screen(number)) == pytest.approx(number, rel=5e-6)


def test_units_are_those_that_a_person_reads():
    assert title(KNOWN["material.seed.shear_modulus"]) == "Shear modulus [MPa]"
    assert title(KNOWN["rig.outlet_height"]) == "Outlet height [mm]"
    assert title(KNOWN["pair.seed.seed.static_friction"]) == "Static friction"
    assert screen_unit(KNOWN["material.seed.shear_modulus"]).to_screen(56.3e6) == 56.3
    assert quantity(0.03, "kg") == "30 g"
    assert quantity(math.nan, "Pa") == "–"


def test_sliders_are_made_from_what_is_declared_live():
    choices = (material_targets(SCENE), pair_targets(SCENE), effect_targets())
    shown = [
        p.path for targets in choices for prefixes in targets.values() for p, _ in live_parameters(SCENE, prefixes)
    ]
    assert set(shown) == {path for path, parameter in KNOWN.items() if parameter.live}


def test_all_pairs_means_every_pair_and_all_bodies_leaves_the_wall_alone():
    pairs = dict(live_parameters_by_name(pair_targets(SCENE)["all pairs"]))
    assert len(pairs["static_friction"]) == len(SCENE.pairs) == 9
    moduli = dict(live_parameters_by_name(material_targets(SCENE)["all bodies"]))["shear_modulus"]
    assert [path.split(".")[1] for path in moduli] == ["seed", "plate", "petiole"]


def live_parameters_by_name(prefixes):
    return [(p.path.split(".")[-1], paths) for p, paths in live_parameters(SCENE, prefixes)]


def test_what_acts_on_restart_is_declared_so():
    assert [path for path in PATHS if path in KNOWN and KNOWN[path].live] == []


def set_up(server, scene=SCENE):
    """The inputs of the set-up, a person at them, and a list of the scenes that are poured."""
    first, started = Status(SessionState.RUNNING, "", scene, seed=1, generation=1, speed=1.0), []
    session = SimpleNamespace(status=lambda: first, restart=lambda made, seed: started.append(made))
    with server.gui.add_folder("set-up") as place:
        panel = SetUpInputs(server, session, scene, 1, lambda action: action())
    return panel, Person(place), started


def test_sizes_of_every_component_are_in_the_set_up(server):
    panel, person, started = set_up(server)
    assert [path for path in size_paths(SCENE) if KNOWN[path].live] == []
    person.enter("Plate: size distribution", "log_normal")
    person.enter("Plate: size spread", 0.2)
    person.press("Restart with this set-up")
    assert [body.sizes for body in started[0].bodies] == [
        SizeDistribution(),
        SizeDistribution("log_normal", 0.2),
        SizeDistribution(),
    ]
    # a number of spheres that was set elsewhere is offered beside the names
    other = with_values(SCENE, {"body.spheres": 12})
    panel.show(Status(SessionState.RUNNING, "", other, seed=1, generation=2, speed=1.0))
    assert person.value("Spheres") == "12"
    assert person.options("Spheres") == (*KNOWN["body.spheres"].choices, "12")


@pytest.mark.parametrize("rig", RIGS)
def test_all_of_rig_and_feed_is_in_the_set_up(server, rig):
    scene = with_rig(SCENE, rig)
    _, person, started = set_up(server, scene)
    known = parameters(scene).items()
    # A file is chosen or uploaded elsewhere (`scene_panel`).
    declared = [label(entry) for path, entry in known if path.startswith(("rig.", "insertion.")) and not entry.files]
    assert Counter(declared) <= Counter(person.labels)
    # What nobody touched stays as it is, to the last bit.
    person.press("Restart with this set-up")
    assert started == [scene]


def test_settings_of_the_next_pour_are_clamped_and_choices_checked():
    assert entered(KNOWN["rig.outlet_height"], 80.0) == pytest.approx(0.08)
    assert entered(KNOWN["rig.mass"], 1e9) == KNOWN["rig.mass"].high
    with pytest.raises(InputError, match="Mass"):
        entered(KNOWN["rig.mass"], math.nan)
    with pytest.raises(ValueError, match=r"body\.spheres"):
        with_values(SCENE, {"body.spheres": entered(KNOWN["body.spheres"], "<script>")})


def test_the_set_up_follows_a_pour_that_somebody_else_started(server):
    panel, person, _ = set_up(server)
    person.enter("Mass [g]", 12.0)
    panel.show(Status(SessionState.RUNNING, "", SCENE, seed=1, generation=1, speed=1.0))
    assert person.value("Mass [g]") == 12.0  # typed, and not yet asked for
    other = with_values(SCENE, {"rig.mass": "20g", "body.spheres": "coarse"})
    panel.show(Status(SessionState.RUNNING, "", other, seed=7, generation=2, speed=1.0))
    assert [person.value(words) for words in ("Mass [g]", "Spheres", "Seed")] == [20.0, "coarse", 7]


def test_the_solvers_values_are_shown_as_a_range_where_they_differ():
    text = echo_html(SCENE, pair_targets(SCENE)["all pairs"])
    # Table 3 of the article: static friction between 0.54 and 0.83.
    assert "0.54 … 0.83" in text
    assert "0.57 … " not in echo_html(SCENE, pair_targets(SCENE)["seed – seed"])


MIXED = "Static friction (mixed) ×"


@pytest.fixture
def sections(server):
    """A person at the sections, with a session that takes everything over at once."""
    session = PageSession(material_source("sunflower_extract"))
    with server.gui.add_folder("sections") as place:
        made = LiveSections(server, session, SCENE, lambda action: action())
    pairs, bodies = (Person(place).within(f"{kind} (acts now)") for kind in ("Pair", "Material"))
    return SimpleNamespace(pairs=pairs, bodies=bodies, session=session, show=lambda: made.show(session.now))


@pytest.fixture
def let_go(monkeypatch):
    """A call lets the time pass after which a control that a person moved follows the solver again."""
    return lambda: monkeypatch.setattr("explorer.viewer.actions.HANDS_OFF", 0.0)


def friction(session):
    return np.array([value(session.now.scene, f"pair.{pair.a}.{pair.b}.static_friction") for pair in SCENE.pairs])


def test_pairs_that_differ_are_mixed_and_scaled_with_their_ratios_kept(sections):
    before, pairs = friction(sections.session), sections.pairs
    assert pairs.value(MIXED) == 1.0
    assert len(set(before)) > 1
    # One press of an arrow key: a hundredth, and not nine equal pairs.
    pairs.enter(MIXED, 1.01)
    assert friction(sections.session) == pytest.approx(1.01 * before)
    pairs.enter(MIXED, pairs.control(MIXED).max)
    assert friction(sections.session).max() <= 3.0
    assert friction(sections.session) / friction(sections.session)[0] == pytest.approx(before / before[0])


def test_a_factor_of_zero_leads_back_to_the_ratios(sections, let_go):
    before = friction(sections.session)
    sections.pairs.enter(MIXED, 0.0)
    assert not friction(sections.session).any()
    let_go()
    sections.show()
    sections.pairs.enter(MIXED, 0.5)
    assert friction(sections.session) == pytest.approx(0.5 * before)


def test_the_control_is_another_one_once_the_values_agree_and_back(sections, let_go):
    pairs = sections.pairs
    sections.session.set_parameters({f"pair.{pair.a}.{pair.b}.static_friction": 0.4 for pair in SCENE.pairs})
    sections.show()
    assert not pairs.sees(MIXED)
    assert pairs.value("Static friction") == 0.4
    pairs.enter("Static friction", 0.6)
    assert (friction(sections.session) == 0.6).all()
    sections.session.set_parameters({"pair.seed.seed.static_friction": 0.3})
    sections.show()
    assert not pairs.sees(MIXED)  # not under a person's hand
    let_go()
    sections.show()
    assert pairs.sees(MIXED)
    assert not pairs.sees("Static friction")


def test_moduli_that_differ_are_scaled_too(sections):
    decades = "Shear modulus (mixed), decades"
    slider = sections.bodies.control(decades)
    assert (slider.value, slider.min, slider.max) == (0.0, -2.0, 2.0)
    sections.bodies.enter(decades, math.log10(2.0))
    found = [value(sections.session.now.scene, f"material.{name}.shear_modulus") for name in ("seed", "plate")]
    assert found == pytest.approx([2 * 56.3e6, 2 * 35.5e6])


def test_a_factor_keeps_all_values_in_their_range_and_begins_at_one():
    assert factor_range([0.5, 0.8], 0.0, 1.0) == (0.0, 1.25)
    assert factor_range([0.3, 0.9], 0.0, 1.0) == (0.0, 1.11)
    assert factor_range([0.0, 0.01], 0.0, 3.0) == (0.0, 4.0)
    assert factor_range([0.02, 1.0], 0.01, 1.0) == (0.5, 1.0)


def test_a_logarithmic_slider_spans_whole_decades_within_the_range():
    assert decades_around(56.3, 0.01, 1e6) == (0, 3)
    assert decades_around(0.02, 0.01, 1e6) == (-2, 0)
    assert [decade_mark(power) for power in (-1, 0, 2, 3, 4)] == ["0.1", "1", "100", "10³", "10⁴"]


BOX, POWER = "Shear modulus [MPa]", "log₁₀ MPa"


def control(server, name, prefix="material.seed"):
    """A control of one parameter, a person at it, a list of what is sent to the solver, and the parameter's path."""
    sent, path = [], f"{prefix}.{name}"
    with server.gui.add_folder("control") as place:
        made = LiveControl(server.gui, KNOWN[path], [path], SCENE, lambda action: action(), sent.append)
    return made, Person(place), sent, path


def test_moving_the_box_and_the_logarithmic_slider_sends_pascals(server):
    _, person, sent, path = control(server, "shear_modulus")
    person.enter(BOX, 80.0)
    person.enter(POWER, 2.0)
    person.send(POWER, 99.0)
    assert [values[path] for values in sent] == pytest.approx([80e6, 100e6, 1e9])


def test_the_solver_does_not_take_back_what_a_person_sent_before_the_call_of_it_comes(server, let_go):
    made, person, sent, path = control(server, "static_friction", "pair.seed.seed")
    person.send("Static friction", 0.25, before_call=lambda: made.follow(SCENE))
    assert sent == [{path: 0.25}]
    let_go()  # refused or overtaken, it goes back with the next frame
    made.follow(SCENE)
    assert person.value("Static friction") == value(SCENE, path)


def test_a_control_goes_back_where_the_browser_left_before_the_call_of_what_it_sent(server, let_go):
    made, person, _, path = control(server, "static_friction", "pair.seed.seed")
    person.control("Static friction").value = 0.25
    made.follow(SCENE)
    assert person.value("Static friction") == 0.25
    let_go()
    made.follow(SCENE)
    assert person.value("Static friction") == value(SCENE, path)


def test_a_power_of_ten_is_shown_with_the_digits_that_its_box_holds(server):
    made, person, _, _ = control(server, "shear_modulus")
    # log10(56.3) = 1.7505
    assert person.value(POWER) == 1.75
    made.follow(with_values(SCENE, {"material.seed.shear_modulus": 47.3e6}))
    assert person.value(POWER) == 1.67
    assert person.value(BOX) == 47.3


def test_what_the_program_sets_itself_is_not_sent_back(server):
    _, person, sent, _ = control(server, "static_friction", "pair.seed.seed")
    person.control("Static friction").value = 0.1
    assert sent == []


def test_a_control_follows_the_solver_unless_a_person_is_at_it(server, let_go):
    made, person, _, path = control(server, "static_friction", "pair.seed.seed")
    changed = with_values(SCENE, {path: 0.2})
    made.follow(changed)
    assert person.value("Static friction") == 0.2
    person.enter("Static friction", 1.5)
    made.follow(SCENE)
    assert person.value("Static friction") == 1.5
    let_go()
    made.follow(SCENE)
    assert person.value("Static friction") == value(SCENE, path)


def test_actions_run_in_order_and_a_refusal_becomes_the_notice():
    actions, done = Actions(), []

    def refuse():
        raise InputError("friction: 'nan' is not a finite number")

    assert actions.carry_out() is None
    for action in (lambda: done.append(1), refuse, lambda: done.append(2)):
        actions.post(action)
    assert actions.carry_out() == "friction: 'nan' is not a finite number"
    assert done == [1, 2]
    actions.post(lambda: done.append(3))
    assert actions.carry_out() == ""


def test_a_file_that_cannot_be_written_is_told_too(tmp_path):
    actions = Actions()
    actions.post(lambda: (tmp_path / "none" / "file").write_text(""))
    assert actions.carry_out() == f"{tmp_path / 'none' / 'file'}: No such file or directory"


def test_a_mistake_in_the_program_is_not_taken_for_bad_input():
    actions = Actions()
    actions.post(lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        actions.carry_out()


def test_the_feed_rate_beside_the_sliders_is_that_of_the_pour_whoever_began_it(server):
    session = PageSession(material_source("sunflower_extract"))
    page = page_context(server, session)
    with server.gui.add_folder("controls") as place:
        panel = ControlsPanel(page)
    person, feed, path = Person(place), "Feed rate [g/s]", "insertion.rate"
    assert person.value(feed) == pytest.approx(1e3 * value(session.now.scene, path))
    # Another browser, or Set-up, pours with another feed; pouring again here keeps it.
    session.restart(with_values(session.now.scene, {path: 0.035}))
    panel.show(Now(session.now))
    assert person.value(feed) == pytest.approx(35.0)
    person.press("New seed")
    assert (value(session.now.scene, path), session.now.seed) == (0.035, 2)
    person.enter(feed, 15.0)
    person.press("Same seed")
    assert value(session.now.scene, path) == pytest.approx(0.015)
    assert session.now.seed == 2
    # So do the timeline's button and its key.
    for rate, ask in (
        (12.0, lambda: page.channel.take('{"do": "restart"}')),
        (11.0, lambda: Person(server).hit("Pour again (R)")),
    ):
        person.enter(feed, rate)
        ask()
        assert value(session.now.scene, path) == pytest.approx(1e-3 * rate)
        assert session.now.seed == 2
