"""Choosers of rig and material, and a shape from the browser: a new pour, or one line and nothing changed."""

from pathlib import Path

import pytest
from viser import UploadedFile

from explorer.scene.file import load_scene
from explorer.scene.source import command_line, material_source
from explorer.scene.text import material_toml
from explorer.viewer.actions import Actions
from explorer.viewer.panel import Now
from explorer.viewer.pour.scene_panel import NO_SCENE, OWN, ScenePanel
from solver.assets import asset_path, shipped_assets
from solver.rigs import RIGS
from solver.scenes.scene import with_rig, with_values
from tests.explorer.beads import bead_scene
from tests.explorer.files.test_uploads import stl
from tests.explorer.viewer.page_session import PageSession, event, finished, page_context
from tests.solver.rigs.test_mesh_funnel import cone, exported

SOURCE = material_source("sunflower_extract")


class Bench:
    def __init__(self, server, data):
        self.session, self.actions = PageSession(SOURCE), Actions()
        page = page_context(server, self.session, self.actions.post, data)
        self.panel, self.background, self.folder = ScenePanel(page), page.background, page.uploads

    def pour(self):
        self.actions.post(self.panel._pour)
        return finished(self.actions, self.background)

    def upload(self, name, content, button="_upload"):
        event(getattr(self.panel, button), UploadedFile(name, content))
        return finished(self.actions, self.background)


@pytest.fixture
def bench(server, tmp_path, monkeypatch):
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path / "cache"))
    return Bench(server, tmp_path)


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("material", ["sunflower_extract", "nine_sphere_seed"])
def test_every_rig_and_shipped_material_can_be_poured(bench, rig, material):
    bench.panel._rig.value, bench.panel._material.value = rig, material
    assert bench.pour() == ""
    assert bench.session.now.scene == load_scene(rig, material)
    assert bench.session.source.scene == bench.session.now.scene
    # As another browser sees it.
    bench.panel._rig.value, bench.panel._material.value = "funnel", OWN
    bench.panel.show(Now(bench.session.status()))
    assert (bench.panel._rig.value, bench.panel._material.value) == (rig, material)


@pytest.mark.parametrize("name", shipped_assets("scenes"))
def test_a_prepared_scene_is_poured_and_has_a_command_line(bench, name):
    event(bench.panel._prepared, name)
    assert finished(bench.actions, bench.background) == ""
    assert bench.session.now.scene == load_scene(name)
    assert bench.panel._prepared.value == NO_SCENE
    line = command_line(bench.session.source, bench.session.now.scene, 1)
    assert line == f"explorer simulate {name} --seed 1"
    bench.panel.show(Now(bench.session.status()))


def test_only_listed_scenes_are_poured(bench):
    event(bench.panel._prepared, "../materials/nine_sphere_seed")
    assert "there is none of that name" in finished(bench.actions, bench.background)
    assert bench.session.asked == []


def test_a_file_of_ones_own_is_poured(bench, tmp_path):
    scene = with_values(SOURCE.scene, {"pair.seed.seed.static_friction": 0.2})
    (tmp_path / "own.toml").write_text(material_toml(scene))
    bench.panel._material.value, bench.panel._file.value = OWN, f" {tmp_path / 'own.toml'} "
    assert bench.pour() == ""
    assert bench.session.now.scene == scene


def test_a_material_from_the_browser_is_poured_in_its_own_rig(bench):
    scene = with_values(with_rig(SOURCE.scene, "lifting_cylinder"), {"contact.clump_rule": "local_mass"})
    content = material_toml(scene).encode()
    assert bench.upload("../../my own.toml", content, "_sent") == ""
    assert bench.session.now.scene == scene
    bench.panel.show(Now(bench.session.status()))
    assert (bench.panel._rig.value, bench.panel._material.value) == ("lifting_cylinder", OWN)
    assert Path(bench.panel._file.value).parent == bench.folder
    assert Path(bench.panel._file.value).read_bytes() == content


def test_a_bad_material_from_the_browser_changes_nothing(bench):
    assert "names the file" in bench.upload("x.toml", b'format = 1\n[[body]]\nfile = "/etc/passwd"\n', "_sent")
    assert bench.session.asked == []
    assert list(bench.folder.iterdir()) == []


@pytest.mark.parametrize(
    ("rig", "file", "words"),
    [
        ("funnel", "", "name a file"),
        ("funnel", "/nowhere/own.toml", "neither a file"),
        ("<script>", "x", "allowed are funnel"),
        ("inclined_plane", "x", "allowed are funnel"),
    ],
)
def test_what_cannot_be_poured_is_one_line_and_changes_nothing(bench, rig, file, words):
    bench.panel._rig.value, bench.panel._material.value, bench.panel._file.value = rig, OWN, file
    notice = bench.pour()
    assert words in notice
    assert "\n" not in notice
    assert bench.session.asked == []


def test_bodies_that_do_not_fit_into_the_rig_are_refused(bench, tmp_path):
    big = with_values(SOURCE.scene, {"rig.outlet_diameter": "60mm"})
    text = material_toml(big).replace("diameter = 0.06", "diameter = 0.004")
    (tmp_path / "narrow.toml").write_text(text)
    bench.panel._material.value, bench.panel._file.value = OWN, str(tmp_path / "narrow.toml")
    assert "narrow.toml" in bench.pour()
    assert bench.session.asked == []


def test_a_mesh_becomes_the_shape_of_the_chosen_body(bench):
    bench.session.start(with_values(bead_scene(), {"body.spheres": "coarse"}), 5)
    bench.panel.show(Now(bench.session.status()))
    assert bench.panel._body.options == ("bead",)
    assert bench.upload("box.stl", stl()) == ""
    assert bench.session.now.seed == 5
    assert bench.session.now.scene.bodies[0].shape.kind == "mesh"
    # It is a material of one's own now, and can be poured in another rig.
    bench.panel.show(Now(bench.session.status()))
    assert bench.panel._material.value == OWN
    assert material_source(bench.panel._file.value).scene == bench.session.now.scene
    assert bench.session.source.scene == bench.session.now.scene


def test_a_bad_mesh_changes_nothing(bench):
    bench.session.start(bead_scene(), 1)
    bench.panel.show(Now(bench.session.status()))
    before = (list(bench.session.asked), bench.session.now)
    assert "not watertight" in bench.upload("open.stl", stl(holes=2))
    bench.panel._unit.value = "league"
    assert "allowed are" in bench.upload("box.stl", stl())
    assert (bench.session.asked, bench.session.now) == before


def test_a_mesh_becomes_the_funnel_and_a_bad_one_changes_nothing(bench):
    bench.session.start(with_values(bead_scene(), {"body.spheres": "coarse"}), 5)
    bench.panel.show(Now(bench.session.status()))
    hopper = asset_path("meshes", "square_hopper").read_bytes()
    assert bench.upload("hopper.stl", hopper, "_funnel") == ""
    assert (bench.session.now.seed, bench.session.now.scene.rig.name) == (5, "mesh_funnel")
    bench.panel.show(Now(bench.session.status()))
    assert (bench.panel._rig.value, bench.panel._material.value) == ("mesh_funnel", OWN)
    before = (list(bench.session.asked), bench.session.now)
    assert "narrower than a body" in bench.upload("narrow.stl", exported(cone(outlet=4.0)), "_funnel")
    assert (bench.session.asked, bench.session.now) == before
