"""Meshes and materials from a browser: a scene that every command takes, or one line."""

import pytest
import trimesh

from explorer.errors import CommandError
from explorer.files.uploads import FEED_SHARE, funnel_source, shaped_source, uploaded_material
from explorer.scene.file import load_scene
from explorer.scene.text import material_toml
from solver.assets import asset_path
from solver.scenes.scene import with_values
from solver.shapes.solid import mass_properties
from tests.explorer.beads import bead_scene
from tests.explorer.files.test_uploads import stl
from tests.solver.rigs.test_mesh_funnel import cone, exported

pytestmark = pytest.mark.usefixtures("own_cache")


SCENE = with_values(bead_scene(), {"pair.bead.bead.static_friction": 0.123, "body.spheres": "coarse"})


def test_a_mesh_becomes_the_shape_of_a_body_and_a_material_that_every_command_takes(tmp_path):
    source = shaped_source(SCENE, "bead", "../my box.STL", stl(), None, tmp_path)
    body = source.scene.bodies[0]
    assert mass_properties(body.shape, 1000.0).volume == pytest.approx(12e-3 * 10e-3 * 8e-3, rel=1e-6)
    assert source.scene.pairs == SCENE.pairs
    assert source.scene.rig == SCENE.rig
    assert load_scene(*source.arguments) == source.scene
    assert {path.parent for path in tmp_path.rglob("*")} == {tmp_path}
    # Its spheres are fitted by now.
    assert body.clump.mass == pytest.approx(body.mass)


def test_the_unit_is_taken_as_told(tmp_path):
    source = shaped_source(SCENE, "bead", "box.stl", stl((1.2, 1.0, 0.8)), "cm", tmp_path)
    assert max(source.scene.bodies[0].extents) == pytest.approx(0.012, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "content", "unit", "words"),
    [
        ("open.stl", stl(holes=2), None, "not watertight"),
        ("empty.stl", b"", None, "0 bytes"),
        ("noise.stl", bytes(range(256)) * 9, None, "noise.stl"),
        ("far.stl", stl(), "m", "is it in another unit"),
        ("huge.stl", stl((400.0, 400.0, 400.0)), None, r"huge.stl: rig\."),
        ("fine.stl", trimesh.creation.icosphere(5, 6.0).export(file_type="stl"), None, "20480 faces; the page draws"),
        ("evil.exe", stl(), None, "ending in .stl"),
        ("../../x<script>.stl", stl(holes=2), None, "not watertight"),
    ],
)
def test_a_bad_mesh_is_refused_in_one_line_and_leaves_nothing(name, content, unit, words, tmp_path):
    with pytest.raises(CommandError, match=words) as refused:
        shaped_source(SCENE, "bead", name, content, unit, tmp_path)
    assert "\n" not in str(refused.value)
    assert str(tmp_path) not in str(refused.value)
    assert list(tmp_path.iterdir()) == []


def test_a_body_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(CommandError, match="no such body"):
        shaped_source(SCENE, "pebble", "box.stl", stl(), None, tmp_path)


def test_a_mesh_becomes_the_funnel_with_the_feed_drawn_in_and_the_rest_as_it_was(tmp_path):
    scene = with_values(SCENE, {"rig.mass": "12g", "rig.outlet_height": "50mm", "insertion.rate": "3g/s"})
    source = funnel_source(scene, "../my funnel.STL", exported(cone(outlet=20.0, inlet=40.0)), None, tmp_path)
    rig = source.scene.rig
    assert (rig.name, rig.unit, rig.mass, rig.outlet_height) == ("mesh_funnel", "mm", 0.012, 0.05)
    assert source.scene.insertion.rate == pytest.approx(3e-3)
    assert ([body.shape for body in source.scene.bodies], source.scene.pairs) == (
        [body.shape for body in scene.bodies],
        scene.pairs,
    )
    assert source.scene.insertion.region_radius == pytest.approx(FEED_SHARE * 0.02, rel=0.02)
    assert load_scene(*source.arguments) == source.scene
    assert {path.parent for path in tmp_path.rglob("*")} == {tmp_path}
    # The shipped one is wide enough for the usual feed.
    hopper = funnel_source(scene, "h.stl", asset_path("meshes", "square_hopper").read_bytes(), "mm", tmp_path)
    assert hopper.scene.insertion.region_radius == scene.insertion.region_radius


@pytest.mark.parametrize(
    ("name", "content", "unit", "words"),
    [
        ("box.stl", stl((80.0, 80.0, 60.0)), None, "blocks the axis"),
        ("narrow.stl", exported(cone(outlet=4.0, inlet=90.0)), None, "too narrow for a body"),
        ("small.stl", exported(cone()), "um", "Is rig.unit = 'um' right"),
        ("large.stl", exported(cone()), "cm", "beyond rig.domain_half_width"),
        ("flat.stl", exported(trimesh.creation.annulus(10.0, 40.0, 1e-9)), None, "no height|no triangle|lets .* pass"),
        ("noise.stl", bytes(range(256)) * 9, None, "noise.stl"),
        ("evil.exe", exported(cone()), None, "ending in .stl"),
    ],
)
def test_a_bad_funnel_is_refused_in_one_line_and_leaves_nothing(name, content, unit, words, tmp_path):
    with pytest.raises(CommandError, match=words) as refused:
        funnel_source(SCENE, name, content, unit, tmp_path)
    assert "\n" not in str(refused.value)
    assert str(tmp_path) not in str(refused.value)
    assert list(tmp_path.iterdir()) == []


MATERIAL = with_values(load_scene("sunflower_extract"), {"pair.seed.seed.static_friction": 0.123})
WHOLE = material_toml(MATERIAL)


def test_a_material_is_kept_as_it_came_and_is_what_every_command_takes(tmp_path):
    content = WHOLE.encode()
    source = uploaded_material("../../my beads.TOML", content, tmp_path)
    assert load_scene(*source.arguments) == source.scene == MATERIAL
    (path,) = tmp_path.iterdir()
    assert path.read_bytes() == content
    assert uploaded_material("my beads.toml", content, tmp_path).scene == MATERIAL


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("own.txt", WHOLE, "ending in .toml"),
        ("own.toml", "", "0 bytes"),
        ("own.toml", "format = ", "own.toml: "),
        ("own.toml", "format = 1\n", "own.toml: "),
        ("own.toml", "a = " + "[" * 5000, "own.toml: "),
        ("own.toml", "\udcff", "UTF-8"),
        ("own.toml", WHOLE.replace("format = 1", "format = 2"), "format"),
        ("own.toml", WHOLE.replace("restitution", "bounciness"), "unknown key"),
        ("own.toml", WHOLE.replace("shape = {", 'shape = { mesh = "/etc/passwd", '), "names the file '/etc/passwd'"),
        ("own.toml", WHOLE + '\n[[body]]\nfile = "../secret.toml"\n', "names the file '../secret.toml'"),
        ("own.toml", WHOLE.replace("[rig]", '[rig]\nmesh = "~/x.stl"'), "names the file '~/x.stl'"),
        ("own.toml", 'body = { mesh = "x.stl" }', "names the file 'x.stl'"),
    ],
)
def test_a_bad_material_is_refused_in_one_line_and_leaves_nothing(name, text, words, tmp_path):
    with pytest.raises(CommandError, match=words) as refused:
        uploaded_material(name, text.encode(errors="surrogateescape"), tmp_path)
    assert "\n" not in str(refused.value)
    assert str(tmp_path) not in str(refused.value)
    assert list(tmp_path.iterdir()) == []
