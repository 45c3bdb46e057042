"""Choosers of rig and material, and a shape from the browser: a new pour, or one line and nothing changed."""

from pathlib import Path

import pytest

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
from tests.explorer.viewer.page_session import PageSession, finished, page_context
from tests.explorer.viewer.person import Person
from tests.solver.rigs.test_mesh_funnel import cone, exported

SOURCE = material_source("sunflower_extract")


MATERIAL, SHAPE, FUNNEL = (f"Upload a {what} and pour" for what in ("material", "body", "funnel"))


class Bench:
    """The panel with a person at it."""

    def __init__(self, server, data):
        self.session, self.actions = PageSession(SOURCE), Actions()
        page = page_context(server, self.session, self.actions.post, data)
        self.folder = page.uploads
        with server.gui.add_folder("Rig and material") as place:
            self.panel = ScenePanel(page)
        self.person = Person(place, lambda: finished(self.actions, page.background))

    def pour(self, **entered):
        """Fill in what is named, and pour. The line of a refusal."""
        for label, value in entered.items():
            self.person.enter(label, value)
        return self.person.press("Pour this")

    def shown(self, *labels):
        """What stands in these controls once the page has followed the pour."""
        self.panel.show(Now(self.session.status()))
        return tuple(self.person.value(label) for label in labels)


@pytest.fixture
def bench(server, tmp_path, monkeypatch):
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path / "cache"))
    return Bench(server, tmp_path)


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("material", ["sunflower_extract", "nine_sphere_seed"])
def test_every_rig_and_shipped_material_can_be_poured(bench, rig, material):
    assert bench.pour(Rig=rig, Material=material) == ""
    assert bench.session.now.scene == load_scene(rig, material)
    assert bench.session.source.scene == bench.session.now.scene
    # As another browser sees it.
    bench.person.enter("Rig", "funnel")
    bench.person.enter("Material", OWN)
    assert bench.shown("Rig", "Material") == (rig, material)


@pytest.mark.parametrize("name", shipped_assets("scenes"))
def test_a_prepared_scene_is_poured_and_has_a_command_line(bench, name):
    assert bench.person.enter("Prepared scene", name) == ""
    assert bench.session.now.scene == load_scene(name)
    assert bench.person.value("Prepared scene") == NO_SCENE
    line = command_line(bench.session.source, bench.session.now.scene, 1)
    assert line == f"explorer simulate {name} --seed 1"
    assert bench.shown("Rig") == (bench.session.now.scene.rig.name,)


def test_only_listed_scenes_are_poured(bench):
    assert "no such scene" in bench.person.send("Prepared scene", "../materials/nine_sphere_seed")
    assert bench.session.asked == []


def test_a_file_of_ones_own_is_poured(bench, tmp_path):
    scene = with_values(SOURCE.scene, {"pair.seed.seed.static_friction": 0.2})
    (tmp_path / "own.toml").write_text(material_toml(scene))
    assert bench.pour(Material=OWN, File=f" {tmp_path / 'own.toml'} ") == ""
    assert bench.session.now.scene == scene


def test_a_material_from_the_browser_is_poured_in_its_own_rig(bench):
    scene = with_values(with_rig(SOURCE.scene, "lifting_cylinder"), {"contact.clump_rule": "local_mass"})
    content = material_toml(scene).encode()
    assert bench.person.upload(MATERIAL, "../../my own.toml", content) == ""
    assert bench.session.now.scene == scene
    assert bench.shown("Rig", "Material") == ("lifting_cylinder", OWN)
    kept = Path(bench.person.value("File"))
    assert kept.parent == bench.folder
    assert kept.read_bytes() == content


def test_a_bad_material_from_the_browser_changes_nothing(bench):
    bad = b'format = 1\n[[body]]\nfile = "/etc/passwd"\n'
    assert "names the file" in bench.person.upload(MATERIAL, "x.toml", bad)
    assert bench.session.asked == []
    assert list(bench.folder.iterdir()) == []


@pytest.mark.parametrize(
    ("rig", "file", "words"),
    [
        ("funnel", "", "name a file"),
        ("funnel", "/nowhere/own.toml", "neither a file"),
        ("<script>", "x", "allowed: funnel"),
        ("inclined_plane", "x", "allowed: funnel"),
    ],
)
def test_what_cannot_be_poured_is_one_line_and_changes_nothing(bench, rig, file, words):
    bench.person.send("Rig", rig)
    notice = bench.pour(Material=OWN, File=file)
    assert words in notice
    assert "\n" not in notice
    assert bench.session.asked == []


def test_bodies_that_do_not_fit_into_the_rig_are_refused(bench, tmp_path):
    big = with_values(SOURCE.scene, {"rig.outlet_diameter": "60mm"})
    text = material_toml(big).replace("diameter = 0.06", "diameter = 0.004")
    (tmp_path / "narrow.toml").write_text(text)
    assert "narrow.toml" in bench.pour(Material=OWN, File=str(tmp_path / "narrow.toml"))
    assert bench.session.asked == []


def test_a_mesh_becomes_the_shape_of_the_chosen_body(bench):
    bench.session.start(with_values(bead_scene(), {"body.spheres": "coarse"}), 5)
    assert bench.shown("Body") == ("bead",)
    assert bench.person.options("Body") == ("bead",)
    assert bench.person.upload(SHAPE, "box.stl", stl()) == ""
    assert bench.session.now.seed == 5
    assert bench.session.now.scene.bodies[0].shape.kind == "mesh"
    # It is a material of one's own now, and can be poured in another rig.
    own, file = bench.shown("Material", "File")
    assert own == OWN
    assert material_source(file).scene == bench.session.now.scene
    assert bench.session.source.scene == bench.session.now.scene


def test_a_bad_mesh_changes_nothing(bench):
    bench.session.start(bead_scene(), 1)
    bench.shown()
    before = (list(bench.session.asked), bench.session.now)
    assert "not watertight" in bench.person.upload(SHAPE, "open.stl", stl(holes=2))
    bench.person.send("Unit", "league")
    assert "allowed: m, cm, mm" in bench.person.upload(SHAPE, "box.stl", stl())
    assert (bench.session.asked, bench.session.now) == before


def test_a_mesh_becomes_the_funnel_and_a_bad_one_changes_nothing(bench):
    bench.session.start(with_values(bead_scene(), {"body.spheres": "coarse"}), 5)
    bench.shown()
    hopper = asset_path("meshes", "square_hopper").read_bytes()
    assert bench.person.upload(FUNNEL, "hopper.stl", hopper) == ""
    assert (bench.session.now.seed, bench.session.now.scene.rig.name) == (5, "mesh_funnel")
    assert bench.shown("Rig", "Material") == ("mesh_funnel", OWN)
    before = (list(bench.session.asked), bench.session.now)
    assert "too narrow for a body" in bench.person.upload(FUNNEL, "narrow.stl", exported(cone(outlet=4.0)))
    assert (bench.session.asked, bench.session.now) == before
