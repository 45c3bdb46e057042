"""Presets: the shipped ones fit every material, own ones come back as saved, bad files are refused in one line."""

from dataclasses import replace

import pytest

from explorer.errors import CommandError
from explorer.scene.presets import OWN_MARK, preset_names, preset_path, preset_values, read_preset, save_preset
from explorer.scene.source import differences
from solver import ParameterError, asset_path, load_material, parameters, with_values
from solver.assets import shipped_assets
from tests.explorer.beads import bead_scene

SCENE = load_material("sunflower_extract")
SCENES = {"sunflower": SCENE, "nine": load_material("nine_sphere_seed"), "beads": bead_scene()}


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", shipped_assets("presets"))
def test_a_shipped_preset_changes_live_parameters_of_every_material(name, scene):
    preset = read_preset(asset_path("presets", name))
    assert preset.title
    assert preset.about
    values = preset_values(preset, SCENES[scene])
    known = parameters(SCENES[scene])
    assert all(known[path].live for path in values)
    assert with_values(SCENES[scene], values) != SCENES[scene]


def test_a_handful_is_shipped():
    assert {"frictionless", "sticky", "rough"} <= set(shipped_assets("presets"))


def test_a_star_stands_for_one_name():
    values = preset_values(read_preset(asset_path("presets", "frictionless")), SCENE)
    assert values == {f"pair.{pair.a}.{pair.b}.static_friction": 0.0 for pair in SCENE.pairs}


def test_what_is_saved_comes_back(tmp_path):
    changed = with_values(SCENE, {"pair.seed.seed.static_friction": 1 / 3, "body.spheres": "coarse", "rig.mass": "12g"})
    path = save_preset("My try 1", tmp_path / "presets", differences(SCENE, changed))
    assert preset_names(tmp_path / "presets")[-1] == f"My try 1{OWN_MARK}"
    assert preset_path(f"My try 1{OWN_MARK}", tmp_path / "presets") == path
    assert with_values(SCENE, preset_values(read_preset(path), SCENE)) == changed


def test_a_body_of_any_name_is_saved(tmp_path):
    beads = SCENES["beads"]
    (body,) = beads.bodies
    pairs = tuple(replace(p, **{end: "😀" for end in "ab" if getattr(p, end) == body.name}) for p in beads.pairs)
    scene = replace(beads, bodies=(replace(body, name="😀"),), pairs=pairs)
    changed = with_values(scene, {"body.😀.size_distribution": "uniform", "body.😀.size_spread": 0.1})
    path = save_preset("odd", tmp_path, differences(scene, changed))
    assert with_values(scene, preset_values(read_preset(path), scene)) == changed


@pytest.mark.parametrize("name", ["", "../evil", "a/b", ".hidden", "x" * 41, "<b>", "a\nb"])
def test_names_that_are_no_file_names_are_refused(name, tmp_path):
    with pytest.raises(CommandError, match="letters, digits"):
        save_preset(name, tmp_path, differences(SCENE, with_values(SCENE, {"rig.mass": "12g"})))
    assert list(tmp_path.iterdir()) == []


def test_nothing_changed_is_nothing_to_save(tmp_path):
    with pytest.raises(CommandError, match="nothing differs"):
        save_preset("same", tmp_path, differences(SCENE, SCENE))


@pytest.mark.parametrize("name", ["../../etc/passwd", f"../x{OWN_MARK}", "none of these"])
def test_only_listed_presets_are_read(name, tmp_path):
    with pytest.raises(CommandError, match="no such preset"):
        preset_path(name, tmp_path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("format = 2\n[values]\n", "format: 2; allowed: 1"),
        ("format = 1\n", r"values: missing; needed: path → value"),
        ("format = 1\nvalue = 3\n[values]\n", "value: unknown key"),
        ("format = 1\nvalues = 3\n", "values: 3; allowed: a table"),
        ("format = 1\n[values\n", "preset.toml"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(text, words, tmp_path):
    file = tmp_path / "preset.toml"
    file.write_text(text)
    with pytest.raises(ParameterError, match=words) as refused:
        read_preset(file)
    assert "\n" not in str(refused.value)
    assert str(file) in str(refused.value)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ('"pair.seed.wood.static_friction" = 0.1', "no such pair"),
        ('"pair.*.wood.static_friction" = 0.1', "no parameter of this scene"),
        ('"pair.*.*.static_friction" = 9', "outside 0 … 3"),
        ('"pair.*.*.static_friction" = "much"', "not a number"),
        ('"pair.*.*.static_friction" = [1]', "not a number"),
    ],
)
def test_values_that_do_not_fit_are_refused(row, words, tmp_path):
    file = tmp_path / "preset.toml"
    file.write_text(f"format = 1\n[values]\n{row}\n")
    with pytest.raises(ParameterError, match=words):
        preset_values(read_preset(file), SCENE)


def test_tables_within_tables_are_paths_too(tmp_path):
    file = tmp_path / "preset.toml"
    file.write_text("format = 1\n[values.pair.seed.seed]\nstatic_friction = 0.2\n")
    assert preset_values(read_preset(file), SCENE) == {"pair.seed.seed.static_friction": 0.2}
