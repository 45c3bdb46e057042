"""The form of a grain: what stands in it is poured and kept, or refused in one line with nothing changed."""

from dataclasses import replace

import pytest

from explorer.scene.file import load_scene
from explorer.scene.grain import Grain, grain_scene
from explorer.scene.source import command_line, material_source
from explorer.viewer.actions import Actions
from explorer.viewer.panels import PANELS
from explorer.viewer.pour.grain_panel import GrainPanel
from tests.explorer.viewer.page_session import PageSession, finished, page_context
from tests.explorer.viewer.person import Person

NAME, DENSITY, POUR, KEEP = "Name of the grain", "Density [kg/m3]", "Pour this grain", "Keep as a file"


class Form:
    """The form with a person at it."""

    def __init__(self, server, folder, project=None):
        self.session, actions = PageSession(material_source("sunflower_extract")), Actions()
        page = page_context(server, self.session, actions.post, folder / "data")
        page = replace(page, project=replace(page.project, folder=project))
        with server.gui.add_folder("A grain of your own") as place:
            GrainPanel(page)
        self.person = Person(place, lambda: finished(actions, page.background))

    @property
    def sizes(self):
        """Names of the sizes that it asks for."""
        return [label.removesuffix(" [mm]") for label in self.person.labels if label.endswith("[mm]")]

    @property
    def grain(self):
        """The grain that stands in it."""
        read = self.person.value
        lengths = tuple(1e-3 * read(f"{name} [mm]") for name in self.sizes)
        friction = (read(f"Friction {where}") for where in ("between grains", "on funnel and plate"))
        return Grain(read(NAME).strip(), read("Shape"), lengths, read(DENSITY), *friction, read("Grains"))


@pytest.fixture
def form(server, tmp_path, monkeypatch):
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path / "cache"))
    return Form(server, tmp_path)


def test_the_page_has_it():
    assert GrainPanel in PANELS.values()


def test_it_asks_for_the_sizes_that_the_shape_has(form):
    assert form.sizes == ["Length", "Width", "Thickness"]
    assert form.person.enter("Shape", "sphere") == ""
    assert form.sizes == ["Diameter"]
    assert form.person.enter("Shape", "rod (cylinder)") == ""
    assert form.sizes == ["Diameter", "Length"]


def test_what_stands_in_it_is_poured_and_has_a_command_line(form):
    for label, entered in (("Shape", "sphere"), ("Diameter [mm]", 5.0), ("Grains", 60)):
        assert form.person.enter(label, entered) == ""
    assert form.person.press(POUR) == ""
    scene = form.session.now.scene
    assert scene == grain_scene(form.grain)
    assert scene.bodies[0].shape.dimensions == (0.005,)
    assert material_source(form.session.source.material).scene == scene
    assert command_line(form.session.source, scene, 1).endswith("--seed 1")


@pytest.mark.parametrize("project", [True, False])
def test_it_is_kept_in_the_project_or_with_the_users_data(server, tmp_path, project):
    form = Form(server, tmp_path, tmp_path / "project" if project else None)
    form.person.enter(NAME, " my_lentil ")
    assert form.person.press(KEEP) == ""
    path = (tmp_path / "project" if project else tmp_path / "data" / "materials") / "my_lentil.toml"
    assert load_scene(str(path)) == grain_scene(form.grain)
    assert str(path) in form.person.text
    assert "exists already" in form.person.press(KEEP)


@pytest.mark.parametrize(
    ("label", "value", "words"),
    [
        (NAME, "../../etc/passwd", "letters, digits"),
        (NAME, "<b>", "letters, digits"),
        ("Shape", "dodecahedron", "allowed: seed"),
        ("Length [mm]", float("inf"), "not a finite number"),
        (DENSITY, float("nan"), "not a finite number"),
    ],
)
def test_what_cannot_be_is_one_line_and_changes_nothing(form, tmp_path, label, value, words):
    form.person.send(label, value)
    for button in (POUR, KEEP):
        notice = form.person.press(button)
        assert words in notice
        assert "\n" not in notice
    assert form.session.asked == []
    assert not (tmp_path / "data").exists()
