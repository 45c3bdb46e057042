"""A scene written as a material file and read back is the same scene, to the last bit."""

from dataclasses import replace

import pytest
import trimesh

from explorer.diagnosis.corrected import corrected_scene, corrected_toml
from explorer.scene.file import load_scene
from explorer.scene.text import material_toml
from solver import load_material, value, with_rig, with_settings, with_values
from solver.assets import measurement_folder, shipped_assets
from solver.effects import EFFECTS
from solver.shapes.clump_error import ClumpFit
from solver.shapes.solid import Solid
from tests.doe.measurement.folders import MATERIAL
from tests.explorer.diagnosed import CASES, PARAMETERS, diagnosed

TREFOIL = measurement_folder("trefoil_1") / "material.toml"


def read_back(text, tmp_path, name="written.toml"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return load_scene(str(path))


@pytest.mark.parametrize("name", [*shipped_assets("materials"), str(TREFOIL)])
def test_every_shipped_material_comes_back(name, tmp_path):
    scene = load_material(name)
    assert read_back(material_toml(scene), tmp_path) == scene


def test_another_rig_its_settings_and_awkward_numbers_come_back(tmp_path):
    scene = with_rig(load_material(str(TREFOIL)), "rotating_drum")
    third = {"rig.speed_rpm": 10.0 / 3.0, "numerics.rayleigh_fraction": 0.1 + 0.2, "insertion.rate": 1e-3 / 7.0}
    scene = with_values(with_settings(scene, {"insertion.protocol": "fill_then_open"}), third)
    assert read_back(material_toml(scene), tmp_path) == scene


@pytest.mark.parametrize(
    "values",
    [
        {"law": "linear_spring_dashpot", "characteristic_velocity": 1.0 / 3.0},
        {"clump_rule": "local_mass_shared"},
        {"tangential_law": "mindlin", "tangential_dashpot": "uncapped"},
    ],
)
def test_every_convention_of_contact_comes_back(values, tmp_path):
    usual = load_material(str(TREFOIL))
    assert "[contact]" not in material_toml(usual)
    scene = with_values(usual, {f"contact.{name}": chosen for name, chosen in values.items()})
    assert read_back(material_toml(scene), tmp_path) == scene


@pytest.mark.parametrize("effect", EFFECTS)
def test_every_effect_comes_back(effect, tmp_path):
    kind = EFFECTS[effect]
    amplitudes = {f"effect.{effect}.{name}": 0.3 * kind.strongest for name in kind.amplitudes}
    scene = with_values(load_material(str(TREFOIL)), dict(amplitudes))
    assert scene.effects
    assert read_back(material_toml(scene), tmp_path) == scene


def test_names_and_titles_may_hold_anything(tmp_path):
    scene = replace(load_material(str(TREFOIL)), title='a "quoted"\\ title\nin two lines, 日本')
    text = material_toml(scene, "first\n\nthird")
    assert text.startswith("# first\n#\n# third\n")
    assert read_back(text, tmp_path) == scene


def test_a_corrected_model_that_is_not_established_says_so():
    texts = {case: corrected_toml(*diagnosed(**CASES[case])) for case in ("effect", "ambiguous", "not carried over")}
    assert "NOT ESTABLISHED: this is twisting, one of several answers." in texts["ambiguous"]
    assert "[effect.twisting]" in texts["ambiguous"]
    assert "NOT ESTABLISHED" not in texts["effect"]
    assert "[effect." not in texts["not carried over"]


@pytest.mark.parametrize("case", ["effect", "two amplitudes", "pair", "nothing", "unexplained"])
def test_the_corrected_model_is_what_the_diagnosis_confirmed(case, tmp_path):
    measurement, found = diagnosed(**CASES[case])
    scene = read_back(corrected_toml(measurement, found), tmp_path)
    assert scene == corrected_scene(measurement, found)
    first = measurement.fit[0].scene
    assert (scene.insertion, scene.numerics) == (first.insertion, first.numerics)
    assert scene.rig == first.rig
    assert [value(scene, p.path) for p in PARAMETERS] == list(found.after.model.theta)
    on = {effect.name: tuple(getattr(effect, name) for name in effect.amplitudes) for effect in scene.effects}
    assert on == {name: tuple(map(float, amplitudes)) for name, amplitudes in found.after.model.effects}
    assert bool(on) == found.verdict.kind.startswith("effect")


def test_a_mesh_is_found_from_anywhere(tmp_path, monkeypatch):
    trimesh.creation.box((12.0, 8.0, 6.0)).export(tmp_path / "box.stl")
    (tmp_path / "own.toml").write_text(
        MATERIAL.replace("{ sphere = 12e-3 }", '{ mesh = "box.stl", unit = "mm" }'), encoding="utf-8"
    )
    scene = load_material(str(tmp_path / "own.toml"))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert read_back(material_toml(scene), tmp_path / "elsewhere") == scene


def test_declared_spheres_keep_their_mesh_density_and_fit(tmp_path):
    trimesh.creation.box((12.0, 8.0, 6.0)).export(tmp_path / "box.stl")
    scene = load_material(str(TREFOIL))
    (body,) = scene.bodies
    shape = replace(
        body.shape,
        density=300.0,
        drawn=Solid("mesh", file=str(tmp_path / "box.stl"), unit="mm"),
        fit=ClumpFit(
            n_spheres=3,
            volume_ratio=0.97,
            covered_ratio=0.9,
            surface_rms=1e-4,
            surface_max=3e-4,
            extent_errors=(0.01, 0.02, 1.0 / 3.0),
            smallest_radius=3e-3,
        ),
    )
    scene = replace(scene, bodies=(replace(body, shape=shape),))
    assert read_back(material_toml(scene), tmp_path) == scene


@pytest.mark.parametrize("name", ["my bead", 'a"b', "a/b", "two\nlines", "𝛼", "😀", "\x7f"])
def test_names_of_any_letters_come_back(name, tmp_path):
    """Also those that JSON writes as two halves, which TOML has not."""
    scene = load_material("glass_beads")
    (body,), bead = scene.bodies, scene.material("bead")
    pairs = tuple(replace(p, a=p.a.replace("bead", name), b=p.b.replace("bead", name)) for p in scene.pairs)
    scene = replace(
        scene,
        title=name,
        materials=tuple(replace(one, name=name) if one is bead else one for one in scene.materials),
        bodies=(replace(body, name=name, material=name),),
        pairs=pairs,
    )
    assert read_back(material_toml(scene), tmp_path) == scene
