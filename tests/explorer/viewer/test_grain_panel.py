"""The form of a grain: what stands in it is poured and kept, or refused in one line with nothing changed."""

from dataclasses import replace

import pytest

from explorer.scene.file import load_scene
from explorer.scene.grain import grain_scene
from explorer.scene.source import command_line, material_source
from explorer.viewer.actions import Actions
from explorer.viewer.panels import PANELS
from explorer.viewer.pour.grain_panel import GrainPanel
from tests.explorer.viewer.page_session import PageSession, event, finished, page_context


class Form:
    def __init__(self, server, folder, project=None):
        self.session, self.actions = PageSession(material_source("sunflower_extract")), Actions()
        page = page_context(server, self.session, self.actions.post, folder / "data")
        page = replace(page, project=replace(page.project, folder=project))
        self.panel, self.background = GrainPanel(page), page.background

    def choose(self, shape):
        self.panel._shape.value = shape
        event(self.panel._shape, shape)
        return finished(self.actions, self.background)

    def do(self, act):
        self.actions.post(act)
        return finished(self.actions, self.background)

    @property
    def sizes(self):
        return [name for name, box in self.panel._sizes.items() if box.visible]


@pytest.fixture
def form(server, tmp_path, monkeypatch):
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path / "cache"))
    return Form(server, tmp_path)


def test_the_page_has_it():
    assert GrainPanel in PANELS.values()


def test_it_asks_for_the_sizes_that_the_shape_has(form):
    assert form.sizes == ["Length", "Width", "Thickness"]
    assert form.choose("sphere") == ""
    assert form.sizes == ["Diameter"]
    assert form.choose("rod (cylinder)") == ""
    assert form.sizes == ["Diameter", "Length"]


def test_what_stands_in_it_is_poured_and_has_a_command_line(form):
    form.choose("sphere")
    form.panel._sizes["Diameter"].value = 5.0
    form.panel._number.value = 60
    assert form.do(form.panel._pour) == ""
    scene = form.session.now.scene
    assert scene == grain_scene(form.panel._grain())
    assert scene.bodies[0].shape.dimensions == (0.005,)
    assert material_source(form.session.source.material).scene == scene
    assert command_line(form.session.source, scene, 1).endswith("--seed 1")


@pytest.mark.parametrize("project", [True, False])
def test_it_is_kept_in_the_project_or_with_the_users_data(server, tmp_path, project):
    form = Form(server, tmp_path, tmp_path / "project" if project else None)
    form.panel._name.value = " my_lentil "
    assert form.do(form.panel._keep) == ""
    path = (tmp_path / "project" if project else tmp_path / "data" / "materials") / "my_lentil.toml"
    assert load_scene(str(path)) == grain_scene(form.panel._grain())
    assert str(path) in form.panel._told.content
    assert "exists already" in form.do(form.panel._keep)


@pytest.mark.parametrize(
    ("box", "value", "words"),
    [
        ("_name", "../../etc/passwd", "letters, digits"),
        ("_name", "<b>", "letters, digits"),
        ("_shape", "dodecahedron", "allowed are seed"),
        ("_number", float("nan"), "not a finite number"),
    ],
)
def test_what_cannot_be_is_one_line_and_changes_nothing(form, tmp_path, box, value, words):
    getattr(form.panel, box)._impl.value = value  # as a browser that keeps to no range
    for act in (form.panel._pour, form.panel._keep):
        notice = form.do(act)
        assert words in notice
        assert "\n" not in notice
    assert form.session.asked == []
    assert not (tmp_path / "data").exists()
