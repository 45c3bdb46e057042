"""What no exported deck can hold is refused in one line."""

import dataclasses

import numpy as np
import pytest

from explorer.errors import CommandError
from explorer.export import EXPORTS
from explorer.export.deck import deck_of
from explorer.export.readme import _differences
from explorer.scene.file import load_scene
from solver import with_values
from solver.effects import EFFECTS
from solver.scenes.contact_model import ContactModel
from solver.scenes.sizes import SizeDistribution
from tests.explorer.command_line import TINY, explorer, refused, settings
from tests.solver.observables.made_up import cone, record_of


def test_bodies_of_unequal_size_are_not_exported():
    record = record_of(cone(20.0, 0.05), np.zeros(1), np.zeros(1), 0.03)
    first = dataclasses.replace(record.scene.bodies[0], sizes=SizeDistribution("uniform", 0.1))
    scene = dataclasses.replace(record.scene, bodies=(first, *record.scene.bodies[1:]))
    with pytest.raises(CommandError, match=r"body\.a\.size_distribution: 'uniform' cannot be exported"):
        deck_of(dataclasses.replace(record, scene=scene))


def test_effects_on_contacts_and_flight_are_not_exported():
    scene = record_of(cone(20.0, 0.05), np.zeros(1), np.zeros(1), 0.03).scene
    EXPORTS["yade"].check(scene)
    drag = scene.with_effect(EFFECTS["air_drag"](strength=0.3))
    for engine in ("liggghts", "yade"):
        refusal = rf"effect\.air_drag\.strength: 0\.3 cannot be exported to {engine}; allowed: 0"
        with pytest.raises(CommandError, match=refusal):
            EXPORTS[engine].check(drag)


def test_rolling_resistance_goes_where_the_same_law_is():
    scene = load_scene("seed_pour")
    rolls = scene.with_effect(EFFECTS["rolling_resistance"](rolling_friction=0.3))
    EXPORTS["liggghts"].check(rolls)
    path = r"effect\.rolling_resistance\.rolling_friction"
    with pytest.raises(CommandError, match=rf"{path}: 0\.3 cannot be exported to yade; allowed: 0"):
        EXPORTS["yade"].check(rolls)
    damped = scene.with_effect(EFFECTS["rolling_resistance"](rolling_friction=0.3, rolling_damping=0.1))
    with pytest.raises(CommandError, match=r"rolling_damping: 0\.1 cannot be exported; allowed: 0"):
        EXPORTS["liggghts"].check(damped)


def test_effects_of_the_set_up_are_carried_out_first():
    scene = record_of(cone(20.0, 0.05), np.zeros(1), np.zeros(1), 0.03).scene
    EXPORTS["yade"].check(scene.with_effect(EFFECTS["plate_tilt"](tilt_x=2.0)))
    with pytest.raises(CommandError, match=r"size_distribution: 'log_normal' cannot be exported"):
        EXPORTS["yade"].check(scene.with_effect(EFFECTS["size_dispersion"](spread=0.1)))


def test_a_clump_rule_of_no_other_program_is_not_exported():
    scene = record_of(cone(20.0, 0.05), np.zeros(1), np.zeros(1), 0.03).scene
    local = dataclasses.replace(scene, contact=ContactModel(clump_rule="local_mass"))
    with pytest.raises(
        CommandError, match=r"contact\.clump_rule: 'local_mass' cannot be exported to yade; allowed: body"
    ):
        EXPORTS["yade"].check(local)


def test_a_law_goes_where_the_engine_has_it():
    scene = load_scene("funnel")
    linear = dataclasses.replace(scene, contact=ContactModel(law="linear_spring_dashpot"))
    EXPORTS["liggghts"].check(linear)
    with pytest.raises(
        CommandError,
        match=r"contact\.law: 'linear_spring_dashpot' cannot be exported to yade; allowed: hertz_mindlin$",
    ):
        EXPORTS["yade"].check(linear)
    foreign = dataclasses.replace(scene, contact=ContactModel(law="magnetic"))
    for engine in ("liggghts", "yade"):
        with pytest.raises(CommandError, match=rf"contact\.law: 'magnetic' cannot be exported to {engine}; allowed"):
            EXPORTS[engine].check(foreign)


@pytest.mark.parametrize(
    ("contact", "law", "dashpot"),
    [
        (ContactModel(), "not so here (contact.tangential_law = mindlin_rescale)", "here for both"),
        (ContactModel(tangential_law="mindlin", tangential_dashpot="uncapped"), "as here", "here as well"),
        (ContactModel(law="linear_spring_dashpot"), "contact.law = linear_spring_dashpot", "here for both"),
    ],
)
def test_the_readme_of_a_deck_says_which_tangential_law_was_used_here(contact, law, dashpot):
    text = _differences("liggghts", contact)
    assert law in text
    assert dashpot in text


def test_a_restitution_that_liggghts_cannot_have_is_refused_before_the_pour():
    scene = with_values(load_scene("funnel"), {"pair.seed.seed.restitution": 0.1})
    EXPORTS["yade"].check(scene)
    with pytest.raises(CommandError, match=r"^restitution 0\.1: LIGGGHTS needs more than 0\.05"):
        EXPORTS["liggghts"].check(scene)


@pytest.mark.parametrize(("settings", "longest"), [((), 8), (("--set", "numerics.duration=3s"), 3)])
def test_a_time_beyond_the_end_of_the_pour_is_refused_where_nothing_simulates_on(settings, longest, tmp_path):
    line = refused(explorer("export", "funnel", tmp_path / "new", "--to", "paraview", "--time", 100, *settings))
    assert line == f"--time 100: the pour for --to paraview lasts {longest} s at most; allowed: up to that"
    assert not (tmp_path / "new").exists()
    assert [name for name, one in EXPORTS.items() if one.goes_on] == ["liggghts", "yade"]


def test_a_characteristic_velocity_that_liggghts_refuses_is_refused_before_the_pour():
    slow = {"contact.law": "linear_spring_dashpot", "contact.characteristic_velocity": 0.005}
    with pytest.raises(CommandError, match=r"characteristic_velocity: 0\.005 m/s; allowed by LIGGGHTS: from 0\.01 on"):
        EXPORTS["liggghts"].check(with_values(load_scene("funnel"), slow))
    EXPORTS["liggghts"].check(with_values(load_scene("funnel"), slow | {"contact.characteristic_velocity": 0.01}))


@pytest.mark.parametrize(("to", "duration"), [("yade", 0.0), ("paraview", 0.05)])
def test_a_time_and_a_duration_of_the_file_go_together(to, duration, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(EXPORTS[to], "write", lambda folder, order: asked.append(order) or "done")
    line = ("export", "funnel", tmp_path / "new", "--to", to, "--time", 0.1, "--set", "numerics.duration=0.15s")
    result = explorer(*line, *settings({**TINY, "numerics.max_time": "0.2s", "insertion.rate": "1kg/s"}))
    assert result.exit_code == 0, result.output
    numerics = asked[0].scene.numerics
    assert (numerics.max_time, numerics.duration) == (0.1, 0.1 if duration else 0.0)


@pytest.mark.parametrize("time", ["0.05", "inf", "nan"])
def test_a_time_that_no_pour_has_is_refused_by_its_own_name(time, tmp_path):
    line = refused(explorer("export", "funnel", tmp_path / "new", "--to", "yade", "--time", time))
    assert "--time" in line
    assert "--set" not in line


def test_a_time_that_the_rig_cannot_have_names_the_option(tmp_path):
    line = refused(explorer("export", "rotating_drum", tmp_path / "new", "--to", "paraview", "--time", 1))
    assert line.startswith("--time 1: numerics.max_time: 1 s is not longer than the")
