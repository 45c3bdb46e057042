"""Bodies of a material file: sizes, declared spheres that follow a density, body files, and what is refused."""

import copy
import tomllib

import numpy as np
import pytest
import trimesh

from solver.assets import asset_path
from solver.params import ParameterError
from solver.scenes.material_file import load_material, scene_from
from solver.scenes.scene import value, with_values
from solver.scenes.sizes import SizeDistribution

PATH = asset_path("materials", "sunflower_extract")
TABLE = tomllib.loads(PATH.read_text())

DUMBBELL = {
    "name": "dumbbell",
    "sphere_centres": [[-2e-3, 0.0, 0.0], [2e-3, 0.0, 0.0]],
    "sphere_radii": [3e-3, 3e-3],
    "mass": 2e-4,
    "inertia": [7e-10, 1.5e-9, 1.5e-9],
}


def scene_with(tmp_path, **plate):
    """The shipped scene with another declaration of its plate."""
    table = copy.deepcopy(TABLE)
    kept = {key: table["body"][1][key] for key in ("name", "material", "mass_fraction")}
    table["body"][1] = {key: entry for key, entry in (kept | plate).items() if entry is not None}
    return scene_from(table, tmp_path / "material.toml")


def declared(**others):
    return {key: entry for key, entry in (DUMBBELL | others).items() if key != "name"}


def body_file(tmp_path, text="", name="dumbbell.toml", **others):
    lines = [f"{key} = {entry!r}" for key, entry in (DUMBBELL | others).items()]
    path = tmp_path / name
    path.write_text("format = 1\n\n[[body]]\n" + "\n".join(lines) + "\n" + text)
    return path


@pytest.mark.parametrize(
    ("others", "key"),
    [
        ({"mass": 1e-300}, "mass"),
        ({"mass": 1e308}, "mass"),
        ({"mass": 0.2}, "mass"),
        ({"density": 1e290}, "mass"),
        ({"inertia": [0.7, 1.5, 1.5]}, "inertia"),
        ({"inertia": [1e-300, 1e-300, 1e-300]}, "inertia"),
        ({"sphere_radii": [1e-300, 3e-3]}, "sphere_radii"),
        ({"sphere_centres": [[0.0, 0.0, 1e308], [0.0, 0.0, 0.0]]}, ""),
    ],
)
def test_numbers_of_another_unit_that_no_body_of_these_spheres_has_are_refused(others, key, tmp_path):
    """Grams for kilograms, g mm² for kg m²; and what would leave a time step of zero."""
    with pytest.raises(ParameterError, match=rf"^body\.plate\.?{key}: .*allowed: ") as refused:
        scene_with(tmp_path, **declared(**others))
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize("diameter", [1e-300, 1e-7, 1e300])
def test_a_solid_of_no_body_s_size_is_refused(diameter, tmp_path):
    with pytest.raises(ParameterError, match=r"^body\.plate: .* m long; allowed: 1e-06 … 100 m$"):
        scene_with(tmp_path, shape={"sphere": diameter})


def test_sizes_stand_in_the_table(tmp_path):
    scene = scene_with(tmp_path, **declared(), size_distribution="log_normal", size_spread="15 %")
    assert scene.bodies[1].sizes == SizeDistribution("log_normal", 0.15)
    assert value(scene, "body.plate.size_spread") == 0.15
    assert scene.bodies[0].sizes == SizeDistribution()


def test_declared_spheres_keep_their_mass_or_follow_the_density(tmp_path):
    kept = scene_with(tmp_path, **declared())
    followed = scene_with(tmp_path, **declared(density=500.0))
    assert kept.bodies[1].mass == 2e-4
    # plates have 679 kg/m³
    assert followed.bodies[1].mass == pytest.approx(2e-4 * 679 / 500)
    assert followed.bodies[1].clump.inertia == pytest.approx(np.array(DUMBBELL["inertia"]) * 679 / 500)
    for scene, factor in ((kept, 1.0), (followed, 2.0)):
        heavier = with_values(scene, {"material.plate.density": 2 * 679.0})
        assert heavier.bodies[1].mass == pytest.approx(factor * scene.bodies[1].mass)


def test_a_body_file_is_taken_in(tmp_path):
    body_file(tmp_path, density=500.0)
    inline = scene_with(tmp_path, **declared(density=500.0))
    (tmp_path / "deeper").mkdir()
    for file, folder in (("dumbbell.toml", tmp_path), ("../dumbbell.toml", tmp_path / "deeper")):
        taken = scene_with(folder, file=file)
        assert taken.bodies == inline.bodies
    sized = scene_with(tmp_path, file="dumbbell.toml", size_distribution="uniform", size_spread=0.1)
    assert sized.bodies[1].sizes == SizeDistribution("uniform", 0.1)
    # its own name, where the table gives none
    assert scene_with_pairs(tmp_path).bodies[0].name == "dumbbell"


def scene_with_pairs(tmp_path):
    table = copy.deepcopy(TABLE)
    table["body"] = [{"file": "dumbbell.toml", "material": "seed"}]
    table["wall"] = "rigid_sieve_plate"
    return scene_from(table, tmp_path / "material.toml")


def test_the_drawn_mesh_and_the_fit_come_with_the_file(tmp_path):
    trimesh.creation.box((10.0, 6.0, 6.0)).export(tmp_path / "box.stl")
    fit = (
        "fit = { volume_ratio = 0.9, covered_ratio = 0.8, surface_rms = 1e-4, surface_max = 3e-4, "
        "extent_errors = [0.0, 0.01, 0.0] }\n"
    )
    body_file(tmp_path, fit, mesh="box.stl", unit="mm")
    (tmp_path / "deeper").mkdir()
    body = scene_with(tmp_path / "deeper", file="../dumbbell.toml").bodies[1]
    assert body.shape.drawn.file == str(tmp_path / "deeper" / ".." / "box.stl")
    assert body.clump.fit.surface_rms == 1e-4
    assert body.clump.fit.n_spheres == 2
    (tmp_path / "box.stl").unlink()
    with pytest.raises(ValueError, match=r"body\.plate: mesh = .*box\.stl': no such file"):
        scene_with(tmp_path, file="dumbbell.toml")


@pytest.mark.parametrize(
    ("plate", "says"),
    [
        (declared(size_distribution="normal"), r"size_distribution: 'normal' is not one of none, uniform"),
        (declared(size_distribution="uniform", size_spread=0.7), r"size_spread: 0\.7 is outside 0 … 0\.5"),
        (declared(size_spread=0.1), "needs size_distribution"),
        (declared(sphere="x"), r"body\.plate\.sphere: unknown key; allowed: name,"),
        (declared(density=-1.0), "density: -1 kg/m3; allowed: more than 0"),
        (declared(fit={"rms": 1.0}), r"fit\.rms: unknown key"),
        (declared(mesh="box.step"), "files ending in"),
        ({"shape": {"box": [1e-2, 1e-2, 5e-3]}, "speres": "fine"}, r"body\.plate\.speres: unknown key"),
        ({"shape": {"box": [1e-2, 1e-2, 5e-3]}, "spheres": 0}, "nor a number from 1 to 128"),
        ({"file": "absent.toml"}, "absent.toml: no such file"),
        (
            {"file": "dumbbell.toml", "mass": 1.0},
            r"body with file = 'dumbbell.toml': mass: not allowed together with file",
        ),
        ({"file": "two.toml"}, r"two.toml: a body file holds format = 1 and one \[\[body\]\]"),
        ({"file": "loop.toml"}, "loop.toml: a body file holds"),
    ],
)
def test_bad_bodies_say_what_is_allowed(plate, says, tmp_path):
    body_file(tmp_path)
    body_file(tmp_path, "[[body]]\nname = 'other'\n", name="two.toml")
    (tmp_path / "loop.toml").write_text("format = 1\n[[body]]\nfile = 'loop.toml'\n")
    with pytest.raises(ValueError, match=says) as error:
        scene_with(tmp_path, **plate)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("number", [7, "7"])
def test_a_number_of_spheres_beside_the_names(number, tmp_path):
    scene = scene_with(tmp_path, shape={"cylinder": [5e-3, 30e-3]}, spheres=number)
    assert scene.bodies[1].spheres == "7"
    assert len(scene.bodies[1].clump.radii) == 7


def test_a_number_of_spheres_is_a_parameter():
    scene = with_values(load_material("sunflower_extract"), {"body.spheres": "5"})
    assert value(scene, "body.spheres") == "5"
    assert [len(body.clump.radii) for body in scene.bodies] == [5, 5, 5]
    for bad in ("0", 2.5, "many", 1000):
        with pytest.raises(ParameterError, match=r"body\.spheres: .* is not one of coarse, standard, fine, nor"):
            with_values(scene, {"body.spheres": bad})


def test_measured_diameters_are_log_normal_sizes(tmp_path):
    scene = scene_with(tmp_path, **declared(), size={"mean": "2mm", "sd": "0.2mm"})
    assert scene.bodies[1].sizes == SizeDistribution("log_normal", 0.1)


def test_sizes_are_stated_once(tmp_path):
    with pytest.raises(ParameterError, match="size: given together with size_distribution or size_spread"):
        scene_with(tmp_path, **declared(), size={"mean": 2e-3, "sd": 2e-4}, size_spread=0.1)
