"""A grain by its sizes: closed forms of its mass, a material that is read back, and what of it is still assumed."""

import math
from pathlib import Path

import pytest

from explorer.errors import CommandError
from explorer.scene.file import load_scene
from explorer.scene.grain import SHAPES, Grain, grain_scene, write_grain
from explorer.scene.starter_files import starter_scene
from solver import value
from solver.scenes.scene import body_counts
from solver.shapes.solid import ShapeError

STARTER = starter_scene(Path("any.toml"))
LENGTHS = {"sphere": (6e-3,), "rod (cylinder)": (3e-3, 15e-3)}
FLAT = (12e-3, 7e-3, 3e-3)
VOLUMES = {
    "seed (ellipsoid)": math.pi / 6 * 12e-3 * 7e-3 * 3e-3,
    "sphere": math.pi / 6 * 6e-3**3,
    "plate (box)": 12e-3 * 7e-3 * 3e-3,
    "rod (cylinder)": math.pi / 4 * 3e-3**2 * 15e-3,
}


def grain(shape, name="lentil", density=1300.0, friction=0.45, wall=0.3, number=80):
    return Grain(name, shape, LENGTHS.get(shape, FLAT), density, friction, wall, number)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_grain_has_the_mass_of_its_solid_and_as_many_are_poured_as_asked(shape):
    scene = grain_scene(grain(shape))
    assert scene.bodies[0].mass == pytest.approx(1300.0 * VOLUMES[shape], rel=1e-9)
    assert body_counts(scene) == (80,)
    assert value(scene, "pair.grain.grain.static_friction") == 0.45
    assert value(scene, "pair.grain.steel.static_friction") == 0.3
    assert scene.contact == STARTER.contact
    assert set(STARTER.assumed) - set(scene.assumed) == {
        "materials.grain.density",
        "body.grain.shape",
        "pair.grain.grain.static_friction",
        "pair.grain.steel.static_friction",
    }


def test_what_was_left_as_in_the_starter_stays_assumed():
    scene = grain_scene(Grain("x", "seed (ellipsoid)", (18e-3, 8e-3, 4e-3), 500.0, 0.6, 0.4, 100))
    assert scene.assumed == STARTER.assumed


@pytest.mark.parametrize("shape", SHAPES)
def test_a_kept_grain_is_a_material_that_every_command_takes(shape, tmp_path):
    path = write_grain(tmp_path / "new", grain(shape))
    assert path == tmp_path / "new" / "lentil.toml"
    assert load_scene(str(path)) == grain_scene(grain(shape))
    with pytest.raises(CommandError, match="exists already"):
        write_grain(tmp_path / "new", grain(shape, density=900.0))
    assert load_scene(str(path)) == grain_scene(grain(shape))


@pytest.mark.parametrize("name", ["", "../lentil", "a/b", "a.b", ".."])
def test_no_name_leads_out_of_the_folder(name, tmp_path):
    with pytest.raises(CommandError, match="letters, digits"):
        write_grain(tmp_path / "inside", grain("sphere", name))
    assert list(tmp_path.iterdir()) == []


def test_a_grain_that_cannot_be_is_refused():
    with pytest.raises(ShapeError):
        grain_scene(Grain("x", "sphere", (0.0,), 500.0, 0.6, 0.4, 100))
