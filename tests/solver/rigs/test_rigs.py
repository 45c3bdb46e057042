"""The contract of a rig, over all of them, and what is refused."""

import dataclasses

import numpy as np
import pytest

from solver.observables import observables_in
from solver.params import ParameterError
from solver.rigs import BENCH_RIGS, RIGS
from solver.rigs.feed import RoundFeed
from solver.rigs.rig import Move, Switch
from solver.scenes.material_file import with_set_up, with_settings
from solver.scenes.scene import body_counts, parameters, pour_rig, poured_mass, value, with_rig, with_values
from tests.explorer.beads import bead_scene

ALL = {**RIGS, **BENCH_RIGS}


@pytest.mark.parametrize("name", ALL)
def test_names_fit_surfaces_and_parameters_are_in_range(name):
    rig = ALL[name]()
    assert rig.name == name
    assert len(rig.surface_names) == len(rig.surfaces()) == len(set(rig.surface_names))
    assert hash(rig) == hash(ALL[name]())
    scene = with_rig(bead_scene(), name)
    declared = {path: entry for path, entry in parameters(scene).items() if path.startswith("rig.")}
    assert declared
    for path, entry in declared.items():
        default = getattr(scene.rig, path.removeprefix("rig."))
        assert entry.check(default) == default
        assert entry.doc


@pytest.mark.parametrize("name", RIGS)
def test_a_rig_says_what_it_does_and_what_is_read(name):
    rig = RIGS[name]()
    assert observables_in(rig)
    actions = rig.actions()
    assert actions
    assert [action.after for action in actions] == sorted(action.after for action in actions)
    assert all(0 <= action.surface < len(rig.surfaces()) for action in actions)
    gates = [action for action in actions if isinstance(action, Switch) and not action.active]
    assert {rig.surface_names[action.surface] for action in gates} <= {"gate"}
    assert gates or any(isinstance(action, Move) for action in actions)


@pytest.mark.parametrize("name", RIGS)
def test_what_a_laboratory_can_change_makes_another_rig_that_passes_its_checks(name):
    scene = with_settings(bead_scene(), {"rig.name": name})
    for factors in pour_rig(scene).quick_changes.values():
        changed = {path: factor * float(value(scene, path)) for path, factor in factors.items()}
        assert all(path.startswith("rig.") for path in factors)
        assert with_values(scene, changed).rig != scene.rig


@pytest.mark.parametrize("name", RIGS)
def test_what_a_rig_forgets_is_a_parameter_of_any_rig(name):
    scene = with_settings(bead_scene(), {"rig.name": name})
    assert set(pour_rig(scene).forgets) <= {path for path in parameters(scene) if path.startswith("insertion.")}


@pytest.mark.parametrize("name", RIGS)
def test_what_suits_a_rig_makes_a_scene_that_passes_its_checks(name):
    scene = with_settings(bead_scene(), {"rig.name": name})
    assert scene.rig.name == name
    assert scene.rig.wall == "steel"
    assert sum(body_counts(scene)) > 0


def test_poured_mass():
    lifted = with_settings(bead_scene(), {"rig.name": "lifting_cylinder", "rig.mass": "25g"})
    assert poured_mass(lifted) == 0.025
    drum = with_settings(bead_scene(), {"rig.name": "rotating_drum", "rig.filled_volume": "100mL", "rig.packing": 0.5})
    # 100 cm³, half of it glass of 2500 kg/m³
    assert poured_mass(drum) == pytest.approx(0.125)


def test_choosing_a_rig_again_keeps_its_settings():
    scene = with_settings(bead_scene(), {"rig.name": "rotating_drum", "rig.speed_rpm": 30, "insertion.rate": "1g/s"})
    again = with_settings(scene, {"rig.name": "rotating_drum", "numerics.max_time": 50.0})
    assert (again.rig.speed_rpm, again.insertion.rate, again.numerics.max_time) == (30.0, 1e-3, 50.0)
    other = with_settings(scene, {"rig.name": "funnel"})
    assert other.insertion.protocol == "pour_through"


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"rig": {"name": "mixer"}}, ["rig.name", "'mixer'", "funnel", "rotating_drum", "compression"]),
        ({"rig": {"name": 3}}, ["rig.name", "3", "funnel"]),
        ({"rig": {"name": "rotating_drum", "speed": 3}}, ["rig.speed", "rig.speed_rpm"]),
        ({"rig": {"name": "rotating_drum", "speed_rpm": 1e4}}, ["rig.speed_rpm", "10000 rpm", "0.1 … 300"]),
        ({"rig": {"name": "rotating_drum", "end_plates": "none"}}, ["rig.end_plates", "turning, standing"]),
        ({"rig": {"name": "rotating_drum", "filled_volume": "2L"}}, ["rig.filled_volume", "80%", "up to"]),
        (
            {"rig": {"name": "rotating_drum", "axial_length": "11mm", "filled_volume": "50mL"}},
            ["feed opening", "0.011 m", "0.012 m"],
        ),
        ({"rig": {"name": "lifting_cylinder", "diameter": "7cm"}}, ["insertion.region_radius", "up to 0.035 m"]),
        ({"rig": {"name": "lifting_cylinder", "diameter": "11mm"}}, ["rig.diameter", "0.012 m"]),
        ({"rig": {"name": "lipped_plate", "lip_diameter": "7cm"}}, ["rig.lip_diameter", "0.07 m", "0.08 m"]),
        ({"rig": {"name": "draw_down_box", "slot_width": "11mm"}}, ["rig.slot_width", "more than 0.012 m"]),
        ({"rig": {"name": "draw_down_box", "slot_width": 0.4}}, ["rig.slot_width", "rig.width", "0.24 m"]),
        (
            {"rig": {"name": "draw_down_box"}, "insertion": {"protocol": "pour_through"}},
            ["insertion.protocol", "pour_through", "fill_then_open", "draw_down_box"],
        ),
        ({"rig": {"name": "compression", "body": "wheat"}}, ["rig.body", "wheat", "bead"]),
        ({"rig": {"name": "compression"}, "insertion": {"rate": 1}}, ["insertion.rate"]),
        ({"rig": {"name": "rotating_drum", "speed_rpm": 1}}, ["numerics.max_time", "60 s", "90 s"]),
        ({"rig": {"name": "lifting_cylinder", "lift_speed": "4mm/s"}}, ["numerics.max_time", "30 s", "37.5 s"]),
        ({"rig": 3}, ["rig", "table"]),
        ({"numerics": {"skim": 1}}, ["numerics.skim", "numerics.skin"]),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(table, words):
    with pytest.raises(ParameterError) as error:
        with_set_up(bead_scene(), table)
    text = str(error.value)
    assert "\n" not in text
    assert all(word in text for word in words), text


def test_a_bench_test_is_not_poured():
    scene = with_settings(bead_scene(), {"rig.name": "inclined_plane"})
    for asked in (pour_rig, poured_mass, body_counts):
        with pytest.raises(ParameterError, match=r"rig\.name: 'inclined_plane' is a bench test"):
            asked(scene)
    assert not any(path.startswith("insertion.") for path in parameters(scene))
    assert with_values(scene, {"rig.body": "bead"}).rig.body == "bead"


def test_bodies_enter_inside_the_opening():
    rng = np.random.default_rng(0)
    for name in RIGS:
        scene = with_settings(bead_scene(), {"rig.name": name})
        feed, reach = pour_rig(scene).feed(), scene.insertion.region_radius
        places = np.array([feed.draw(reach, rng) for _ in range(2000)])
        points = np.column_stack([places, np.zeros(len(places))])
        assert feed.holds(points, np.zeros(len(places)), reach)
        assert not feed.holds(points * 1.5, np.zeros(len(places)), reach)
        # uniform: the mean of |x| over a disc of radius a is 4a/3π, over a box a/2; 1 standard error is 1 %
        outer = np.abs(places[:, 0]).max()
        expected = 4.0 / (3.0 * np.pi) if isinstance(feed, RoundFeed) else 0.5
        assert np.abs(places[:, 0]).mean() / outer == pytest.approx(expected, rel=0.04)


def test_the_inside_of_a_lifted_cylinder_rises_with_it():
    rig = dataclasses.replace(RIGS["lifting_cylinder"](), lift_speed=0.02, lift_height=0.1)
    assert rig.container(0.0).height == 0.0
    assert rig.container(2.0).height == pytest.approx(0.04)
    assert rig.container(99.0).height == pytest.approx(0.1)
    up, stop = rig.actions()
    assert (up.velocity, stop.velocity, stop.after) == ((0.0, 0.0, 0.02), (0.0, 0.0, 0.0), pytest.approx(5.0))
