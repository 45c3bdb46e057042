"""`explorer shape`: the table, the number that is taken, the file that a scene takes in, and refusals."""

import re
import tomllib

import numpy as np
import pytest
import trimesh

from explorer.scene.file import load_scene
from explorer.scene.meshes import body_triangles
from solver.shapes.solid import Solid, mass_properties
from tests.explorer.command_line import TINY, explorer, refused, settings
from tests.solver.meshes import bent_rod, saved

MATERIAL = """
format = 1
[materials.grain]
density = 800.0
shear_modulus = "40MPa"
poisson_ratio = 0.3
[materials.steel]
youngs_modulus = 2.0e11
poisson_ratio = 0.3
[[body]]
file = "bodies/rod.toml"
material = "grain"
[pair.grain.grain]
static_friction = 0.6
restitution = 0.3
[pair.grain.steel]
static_friction = 0.6
restitution = 0.3
"""


@pytest.fixture(scope="module")
def rod(tmp_path_factory):
    return saved(bent_rod(bend=8.0, radius=1.5), tmp_path_factory.mktemp("mesh") / "rod.stl")


def table_of(text):
    """Rows of numbers of the printed table, by their first cell."""
    lines = [line.split() for line in text.splitlines() if re.match(r"\s+(mesh|\d+)\s", line)]
    return {line[0]: [float(cell) for cell in line[1:] if cell != "-"] for line in lines}


def test_the_table_stands_beside_the_true_solid(rod):
    result = explorer("shape", rod, "--most", 4, "--spheres", 3, "--density", "0.8g/cm3")
    assert result.exit_code == 0, result.output
    rows = table_of(result.stdout)
    assert list(rows) == ["mesh", "1", "2", "3", "4"]
    true = mass_properties(Solid("mesh", file=str(rod), unit="mm"), 800.0)
    # four printed digits
    assert rows["mesh"][1] == pytest.approx(1e9 * true.volume, rel=1e-3)
    assert rows["mesh"][2] == pytest.approx(1e3 * true.mass, rel=1e-3)
    assert rows["mesh"][3:6] == pytest.approx(1e9 * true.inertia, rel=1e-3)
    rms, largest, covered, volume, mass = rows["4"][:5]
    assert rms < largest
    assert covered < 100.0
    assert mass == pytest.approx(0.8e-3 * volume, rel=1e-3)
    assert "coordinates in mm, which the file does not say: --unit" in result.stdout
    assert "3 spheres taken: --spheres" in result.stdout


def test_the_body_file_is_poured_as_the_mesh(rod, taichi, tmp_path):
    """The scene has the mesh's own mass and inertia at its density, draws the mesh, and runs."""
    (tmp_path / "bodies").mkdir()
    out = tmp_path / "bodies" / "rod.toml"
    result = explorer("shape", rod, "--most", 8, "--error", "0.35mm", "--out", out)
    assert result.exit_code == 0, result.output
    (tmp_path / "bent.toml").write_text(MATERIAL)
    scene = load_scene(str(tmp_path / "bent.toml"))
    (body,) = scene.bodies
    solid = Solid("mesh", file=str(rod), unit="mm")
    true = mass_properties(solid, 800.0)
    # nine digits in the file
    assert body.mass == pytest.approx(true.mass, rel=1e-8)
    assert body.clump.inertia == pytest.approx(true.inertia, rel=1e-8)
    taken = int(re.search(r"(\d+) spheres taken", result.stdout)[1])
    assert len(body.clump.radii) == taken
    assert table_of(result.stdout)[str(taken)][0] <= 0.35
    assert body.clump.fit.surface_rms <= 0.35e-3
    drawn = body_triangles(body)
    assert np.ptp(drawn.vertices, axis=0) == pytest.approx(true.extents, rel=1e-6)
    poured = explorer("simulate", tmp_path / "bent.toml", *settings({**TINY, "rig.mass": "0.5g"}))
    assert poured.exit_code == 0, poured.output


@pytest.mark.slow
def test_the_fewest_are_searched_between_the_powers_of_two(rod):
    result = explorer("shape", rod, "--most", 16, "--error", "0.135mm")
    assert result.exit_code == 0, result.output
    rows = {int(n): numbers[0] for n, numbers in table_of(result.stdout).items() if n != "mesh"}
    taken = int(re.search(r"(\d+) spheres taken", result.stdout)[1])
    assert rows[taken] <= 0.135
    assert taken not in (1, 2, 4, 8, 16)
    assert all(rms > 0.135 for number, rms in rows.items() if number < taken)


def test_units_of_the_formats(tmp_path):
    """A GLB is in metres by its definition; the others are what is said, and millimetres unsaid."""
    metres = saved(trimesh.creation.box((0.012, 0.010, 0.008)), tmp_path / "box.glb")
    inches = saved(trimesh.creation.box((1.2, 1.0, 0.8)), tmp_path / "box.obj")
    for arguments in ((metres,), (inches, "--unit", "cm")):
        result = explorer("shape", *arguments, "--most", 1)
        assert result.exit_code == 0, result.output
        assert "12 × 10 × 8 mm" in result.stdout
        assert "which the file does not say" not in result.stdout


def test_without_a_wish_the_standard_is_taken_or_the_best(tmp_path):
    ball = saved(trimesh.creation.icosphere(subdivisions=3, radius=4.0), tmp_path / "ball.ply")
    result = explorer("shape", ball, "--most", 2, "--out", tmp_path / "ball.toml")
    assert "1 spheres taken: the fewest tried" in result.stdout
    (body,) = tomllib.loads((tmp_path / "ball.toml").read_text())["body"]
    assert (body["name"], body["mesh"], body["unit"]) == ("ball", "ball.ply", "mm")
    assert body["sphere_radii"] == pytest.approx([4e-3], rel=1e-2)
    cube = saved(trimesh.creation.box((5, 5, 5)), tmp_path / "cube.ply")
    assert "are not reached" in explorer("shape", cube, "--most", 2).stdout


def test_a_limit_that_is_not_reached_is_refused(tmp_path):
    cube = saved(trimesh.creation.box((5, 5, 5)), tmp_path / "cube.ply")
    result = explorer("shape", cube, "--most", 2, "--error", "0.01mm", "--out", tmp_path / "cube.toml")
    assert result.exit_code == 2
    assert "--error 0.01 mm: not reached with 2 spheres; the smallest is 0.7" in result.stderr
    assert not (tmp_path / "cube.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["absent.stl"], ["absent.stl", "no such file"]),
        (["open.stl"], ["open.stl", "not watertight", "3 edges"]),
        (["text.txt"], ["text.txt", ".stl, .obj, .ply, .glb"]),
        (["box.stl", "--unit", "m"], ["box.stl", "12000 mm long", "--unit"]),
        (["box.stl", "--unit", "inch"], ["inch", "m, cm, mm"]),
        (["box.stl", "--spheres", "0"], ["--spheres 0", "1 … 128"]),
        (["box.stl", "--most", "1000"], ["--most 1000", "1 … 128"]),
        (["box.stl", "--spheres", "4", "--error", "0.1mm"], ["exclude each other"]),
        (["box.stl", "--error", "-1mm"], ["--error", "positive"]),
        (["box.stl", "--error", "2 kg"], ["--error", "kg"]),
        (["box.stl", "--density", "0"], ["density"]),
        (["box.stl", "--density", "heavy"], ["--density", "heavy"]),
        (["box.stl", "--name", "a.b"], ["--name", "a.b"]),
        (["box.stl", "--smallest", "2"], ["--smallest 2", "0.1 … 1"]),
        (["box.stl", "--out", "box.json"], ["box.json", ".toml"]),
        (["box.stl", "--out", "there.toml"], ["there.toml", "exists already"]),
    ],
)
def test_shape_refuses(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    box = trimesh.creation.box((12, 10, 8))
    saved(box, tmp_path / "box.stl")
    saved(trimesh.Trimesh(box.vertices, box.faces[1:], process=False), tmp_path / "open.stl")
    for name in ("text.txt", "there.toml"):
        (tmp_path / name).write_text("")
    before = sorted(tmp_path.iterdir())
    line = refused(explorer("shape", *arguments))
    assert all(word in line for word in words), line
    assert sorted(tmp_path.iterdir()) == before


def test_a_body_may_have_a_name_of_any_letters(tmp_path):
    trimesh.creation.box((12.0, 8.0, 6.0)).export(tmp_path / "😀.stl")
    out = tmp_path / "body.toml"
    result = explorer("shape", tmp_path / "😀.stl", "--spheres", 1, "--most", 1, "--out", out)
    assert result.exit_code == 0, result.output
    (body,) = tomllib.loads(out.read_text(encoding="utf-8"))["body"]
    assert (body["name"], body["mesh"]) == ("😀", "😀.stl")


def test_the_name_of_a_file_with_blanks_and_dots_is_made_one_of_a_body(tmp_path):
    trimesh.creation.box((12.0, 8.0, 6.0)).export(tmp_path / "my grain.v2.stl")
    result = explorer("shape", tmp_path / "my grain.v2.stl", "--spheres", 1, "--most", 1, "--out", tmp_path / "b.toml")
    assert result.exit_code == 0, result.output
    (body,) = tomllib.loads((tmp_path / "b.toml").read_text(encoding="utf-8"))["body"]
    assert body["name"] == "my_grain_v2"
