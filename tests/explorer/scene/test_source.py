"""The command line that repeats a scene: parsed as a shell and typer do, it gives the same scene to the last bit."""

import shlex
from dataclasses import replace

import pytest
import typer
from typer.testing import CliRunner

from explorer.cli import app
from explorer.errors import CommandError
from explorer.scene.file import load_scene, study_path, with_settings
from explorer.scene.source import (
    Difference,
    SceneSource,
    command_line,
    material_source,
    rig_source,
    setting_text,
    study_source,
)
from explorer.scene.text import material_toml
from solver.params import ParameterError
from solver.rigs import RIGS
from solver.scenes.scene import value, with_rig, with_values

SUNFLOWER = material_source("sunflower_extract")


@pytest.fixture
def asked(monkeypatch):
    """What ``explorer simulate`` was about to pour, instead of pouring it."""
    jobs = []

    def pours(asked_for, **_):
        jobs.extend(asked_for)
        raise typer.Exit(0)

    monkeypatch.setattr("explorer.simulation.run_pours", pours)
    return jobs


def repeated(line, asked):
    program, *words = shlex.split(line)
    assert program == "explorer"
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    return asked[-1]


CHANGED = {
    "pair.seed.seed.static_friction": 0.1234567890123,
    "material.seed.shear_modulus": 47.3e6,
    "rig.outlet_height": 0.065,
    "body.spheres": "coarse",
    "effect.rolling_resistance.rolling_friction": 1.0 / 3.0,
    "effect.capillary_bridge.bridge_volume": 2.5e-9,
    "effect.plate_tilt.tilt_x": 1.5,
    "numerics.duration": 2.6,
}


def test_every_kind_of_change_comes_back_to_the_last_bit(asked):
    scene = with_values(SUNFLOWER.scene, CHANGED)
    line = command_line(SUNFLOWER, scene, 7)
    job = repeated(line, asked)
    assert job.scene == scene
    assert job.seed == 7
    # In units that a person reads where these give the same number, and only what was changed.
    assert "material.seed.shear_modulus=47.3MPa" in line
    assert "rig.outlet_height" not in line
    assert line.count("--set") == len(CHANGED) - 1


@pytest.mark.parametrize("rig", RIGS)
def test_every_rig_that_can_be_chosen_is_repeated(rig, asked):
    source = rig_source(rig, "nine_sphere_seed")
    scene = with_values(source.scene, {"pair.seed.seed.restitution": 0.3})
    assert repeated(command_line(source, scene, 1), asked).scene == scene


def test_another_rig_than_the_sources_is_named(asked):
    scene = with_values(with_rig(SUNFLOWER.scene, "lifting_cylinder"), {"rig.lift_speed": 0.02})
    assert repeated(command_line(SUNFLOWER, scene, 1), asked).scene == scene


@pytest.mark.parametrize("share", ["seed", "plate", "petiole"])
def test_a_share_of_the_mass_that_scaled_the_others_is_repeated(share, asked):
    scene = with_values(SUNFLOWER.scene, {f"body.{share}.mass_fraction": 0.4})
    assert repeated(command_line(SUNFLOWER, scene, 1), asked).scene == scene


def test_a_material_by_its_file_with_blanks_in_its_name(asked, tmp_path):
    file = tmp_path / "my seeds.toml"
    file.write_text(material_toml(SUNFLOWER.scene))
    source = rig_source("draw_down_box", str(file))
    assert repeated(command_line(source, source.scene, 3), asked).scene == source.scene


def test_the_shipped_study_is_named_as_briefly_as_it_can_be(asked):
    source = study_source(study_path("sunflower_extract"))
    assert repeated(command_line(source, source.scene, 1), asked).scene == source.scene
    assert len(source.arguments) == 1
    assert source.material == "sunflower_extract"


def test_a_study_of_ones_own_is_named_by_its_path(asked, tmp_path):
    file = tmp_path / "own.toml"
    before = "outlet_height = 0.065"
    text = study_path("sunflower_extract").read_text()
    assert text.count(before) == 1
    file.write_text(text.replace(before, "outlet_height = 0.080"))
    source = study_source(file)
    assert source.arguments == (str(file),)
    assert repeated(command_line(source, source.scene, 1), asked).scene == source.scene


def test_what_no_setting_can_reach_is_refused_in_one_line():
    other = replace(SUNFLOWER.scene, title="another")
    with pytest.raises(CommandError, match="save the scene file instead"):
        command_line(SUNFLOWER, other, 1)
    with pytest.raises(CommandError, match="does not come from a file"):
        command_line(SceneSource((), SUNFLOWER.scene), SUNFLOWER.scene, 1)


@pytest.mark.parametrize(
    ("number", "unit", "text"),
    [
        (0.065, "m", "65mm"),
        (47.3e6, "Pa", "47.3MPa"),
        (0.03, "kg", "30g"),
        (1 / 3, "1", repr(1 / 3)),
        (0.0, "m", "0mm"),
    ],
)
def test_numbers_are_short_where_nothing_is_lost(number, unit, text):
    assert setting_text(Difference("a.b", 1.0, number, unit, live=True)) == f"a.b={text}"


def test_settings_of_the_command_line_are_counted_from_what_was_loaded(asked):
    scene = with_settings(SUNFLOWER.scene, ["rig.mass=12g"])
    line = command_line(SUNFLOWER, scene, 1)
    assert "--set rig.mass=12g" in line
    assert value(repeated(line, asked).scene, "rig.mass") == value(scene, "rig.mass")


def test_a_folder_of_no_finished_calibration_is_told_so_and_hides_no_shipped_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    (tmp_path / "soybean").mkdir()
    with pytest.raises(ParameterError, match=r"^results: the folder holds no result\.json of a finished calibration$"):
        load_scene("results")
    (tmp_path / "results" / "result.json").write_text("{}")
    with pytest.raises(ParameterError, match=r"^results: a folder with a result\.json; allowed here: a rig"):
        load_scene("results")
    assert load_scene("soybean").bodies
