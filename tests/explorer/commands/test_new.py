"""`explorer new`: the files that it writes run as they are."""

import json
import tomllib

import pytest
import trimesh

from doe.studies.study import load_study
from explorer.scene.file import load_scene
from explorer.scene.starter_files import study_text
from solver import RIGS, load_material, observable_names, value
from solver.assets import asset_path, shipped_assets
from tests.explorer.command_line import TINY, explorer, refused, settings


def test_material_and_study_run(taichi, tmp_path):
    result = explorer("new", "study", "pellets", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in tmp_path.iterdir()) == ["pellets.toml", "pellets_study.toml"]
    assert str(tmp_path / "pellets_study.toml") in result.stdout
    poured = explorer("simulate", tmp_path / "pellets_study.toml", *settings(TINY))
    assert poured.exit_code == 0, poured.output
    assert "time_limit" in poured.stdout


def test_the_grains_of_the_template_come_to_rest(taichi, tmp_path):
    """Grains that are nearly round roll off the plate, since nothing resists rolling: no pile, and no study of one."""
    assert explorer("new", "study", "pellets", "--out", tmp_path).exit_code == 0
    quick = settings({"body.spheres": "coarse", "rig.mass": "12g"})
    poured = explorer("simulate", tmp_path / "pellets_study.toml", "--json", *quick)
    assert json.loads(poured.stdout)["outcome"] == "at_rest"


@pytest.mark.parametrize("name", ["lentil", "lentil_study"])
def test_a_study_is_named_with_or_without_its_ending(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = explorer("new", "study", name)
    assert result.stdout.splitlines() == [
        "wrote lentil.toml",
        "wrote lentil_study.toml",
        "try it: explorer calibrate --headless --study lentil_study.toml --profile quick --out results/lentil",
    ]
    assert load_study("lentil_study.toml").scene.title == "lentil"
    # A second one would have to overwrite the first.
    assert refused(explorer("new", "study", name)) == "lentil_study.toml: exists already; choose another name"


def test_a_material_in_place_of_a_study_is_told_by_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert explorer("new", "material", "lentil").exit_code == 0
    for command in (("calibrate", "--headless"), ("serve",)):
        line = refused(explorer(*command, "--study", "lentil.toml"))
        assert line.startswith("lentil.toml is a material, not a study; ")
        assert "`explorer new study lentil`" in line
    assert [path.name for path in tmp_path.iterdir()] == ["lentil.toml"]


def test_a_file_that_is_not_a_material_is_not_taken_for_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert explorer("new", "study", "lentil").exit_code == 0
    (tmp_path / "lentil_study.toml").rename(tmp_path / "bean.toml")
    before = (tmp_path / "bean.toml").read_text()
    assert "bean.toml exists and is not a material" in refused(explorer("new", "study", "bean"))
    assert (tmp_path / "bean.toml").read_text() == before
    assert not (tmp_path / "bean_study.toml").exists()


def test_material_can_become_a_mesh(tmp_path):
    """The commented line of the template, uncommented, with a user's own STL beside it."""
    assert explorer("new", "material", "bolts", "--out", tmp_path).exit_code == 0
    trimesh.creation.box((0.012, 0.009, 0.006)).export(tmp_path / "grain.stl")
    path = tmp_path / "bolts.toml"
    text = path.read_text()
    ellipsoid = "shape = { ellipsoid = [0.018, 0.008, 0.004] }\n"
    assert ellipsoid in text
    path.write_text(
        text.replace(ellipsoid, "").replace('# shape = { mesh = "grain.stl" }', 'shape = { mesh = "grain.stl" }')
    )
    (body,) = load_scene(str(path)).bodies
    # STL holds single precision
    assert body.extents == pytest.approx((0.012, 0.009, 0.006), rel=1e-6)


def test_what_is_assumed_exists(tmp_path):
    assert explorer("new", "material", "pellets", "--out", tmp_path).exit_code == 0
    table = tomllib.loads((tmp_path / "pellets.toml").read_text())
    for path in table["assumed"]:
        kind, name, *rest = path.split(".")
        entry = next(body for body in table["body"] if body["name"] == name) if kind == "body" else table[kind][name]
        for key in rest:
            entry = entry[key]


@pytest.mark.parametrize("material", [None, *shipped_assets("materials")])
def test_study_is_about_its_material(material, tmp_path):
    chosen = ["--material", material] if material else []
    assert explorer("new", "study", "own", "--out", tmp_path, *chosen).exit_code == 0
    path = tmp_path / "own_study.toml"
    study = load_study(str(path))
    assert 3 <= len(study.factors) <= 8
    assert len(study.assumptions) == 4
    assert study.targets[0].sd_source == "assumed"
    assert set(study.profiles) == {"quick", "standard", "full"}
    scene = load_scene("funnel", material or str(tmp_path / "own.toml"))
    for factor in study.factors:
        low, reference, high = map(float, (factor.low, factor.reference, factor.high))
        assert low < reference < high
        # six printed digits
        assert value(scene, factor.path) == pytest.approx(reference, rel=1e-5)


@pytest.mark.parametrize("material", shipped_assets("materials"))
def test_a_material_of_one_s_own_starts_as_any_shipped_one(material, tmp_path):
    assert explorer("new", "material", "own", "--like", material, "--out", tmp_path).exit_code == 0
    path = tmp_path / "own.toml"
    assert load_material(str(path)) == load_material(material)
    # and keeps where the numbers come from
    shipped = tomllib.loads(asset_path("materials", material).read_text(encoding="utf-8"))
    assert tomllib.loads(path.read_text(encoding="utf-8")).get("measured") == shipped.get("measured")


@pytest.mark.parametrize("rig", RIGS)
def test_a_study_is_of_the_rig_in_its_material_file(rig, tmp_path):
    assert explorer("new", "material", "own", "--out", tmp_path).exit_code == 0
    path = tmp_path / "own.toml"
    path.write_text(path.read_text() + f'\n[rig]\nname = "{rig}"\n\n[insertion]\ndrop_speed = 0.4\n')
    assert explorer("new", "study", "own", "--out", tmp_path).exit_code == 0
    study = load_study(str(tmp_path / "own_study.toml"))
    assert study.scene.rig.name == rig
    assert value(study.scene, "insertion.drop_speed") == 0.4
    assert study.targets[0].observable in observable_names(study.scene)
    # No profile pours another mass than the rig states, and no reference repeats what is stated elsewhere.
    assert {profile.mass for profile in study.profiles.values()} == {None}
    assert study.replaced == ()


def test_a_study_follows_its_material_until_it_states_a_reference(tmp_path):
    assert explorer("new", "study", "own", "--out", tmp_path).exit_code == 0
    material, file = tmp_path / "own.toml", tmp_path / "own_study.toml"
    material.write_text(material.read_text().replace("static_friction = 0.60", "static_friction = 0.55"))
    file.write_text(file.read_text().replace("outlet_height = 0.065 ", "outlet_height = 0.070 "))
    study = load_study(str(file))
    assert value(study.scene, "pair.grain.grain.static_friction") == study.factors[0].reference == 0.55
    assert value(study.scene, "rig.outlet_height") == study.assumptions[0].reference == 0.070
    text = file.read_text()
    for end in ("high = 0.72\n", "high = 0.07475\n"):
        text = text.replace(end, f"{end}reference = 0.06\n" if "0.07" in end else f"{end}reference = 0.65\n")
    file.write_text(text)
    assert load_study(str(file)).replaced == (
        "pair.grain.grain.static_friction: 0.65, the reference of X1, counts instead of 0.55 in own.toml",
        "rig.outlet_height: 0.06, the reference of outlet_height, counts instead of 0.07 in [rig]",
    )
    # Left out, it must lie within the range as well.
    material.write_text(material.read_text().replace("static_friction = 0.55", "static_friction = 0.80"))
    file.write_text(file.read_text().replace("reference = 0.65\n", ""))
    line = refused(explorer("calibrate", "--headless", "--study", file, "--out", tmp_path / "out"))
    assert "X1 (pair.grain.grain.static_friction): reference 0.8 is outside 0.48 … 0.72" in line


def test_template_has_no_blank_left(tmp_path):
    text = study_text(tmp_path / "own_study.toml", "sunflower_extract", load_scene("funnel"))
    assert "@" not in text


def test_existing_files_are_left_alone(tmp_path):
    assert explorer("new", "material", "pellets", "--out", tmp_path).exit_code == 0
    path = tmp_path / "pellets.toml"
    path.write_text(path.read_text().replace("500.0", "1300.0"))
    mine = path.read_text()
    assert "exists already" in refused(explorer("new", "material", "pellets", "--out", tmp_path))
    # a study takes the material that is there
    assert explorer("new", "study", "pellets", "--out", tmp_path).exit_code == 0
    assert path.read_text() == mine
    assert value(load_scene(str(tmp_path / "pellets_study.toml")), "material.grain.density") == 1300.0
    assert "exists already" in refused(explorer("new", "study", "pellets", "--out", tmp_path))


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["material", "../pellets"], "letters, digits"),
        (["material", ""], "letters, digits"),
        (["rig", "pellets"], "No such command 'rig'"),
        (["study", "pellets", "--material", "gold"], "gold"),
        (["material", "pellets", "--material", "sunflower_extract"], "--material"),
    ],
)
def test_new_refuses(arguments, word, tmp_path):
    assert word in refused(explorer("new", *arguments, "--out", tmp_path))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("kind", "option"),
    [("material", "--condition"), ("study", "--scan-unit"), ("project", "--lag"), ("study", "--like")],
)
def test_an_option_of_another_kind_is_refused(kind, option, tmp_path):
    line = refused(explorer("new", kind, "lentil", "--out", tmp_path, option, "1"))
    assert line.startswith(f"No such option: {option}")
    assert list(tmp_path.iterdir()) == []
