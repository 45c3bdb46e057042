"""A material of another program's input: what a browser sent is kept as the command keeps it, and told, and poured."""

import io
import zipfile
from dataclasses import replace
from html import unescape

import pytest

from explorer.export.material_table import write_material_table
from explorer.scene.file import load_scene
from explorer.scene.source import material_source
from explorer.viewer.actions import Actions
from explorer.viewer.panels import PANELS
from explorer.viewer.pour.import_panel import PROGRAMS, ImportPanel
from tests.explorer.command_line import explorer
from tests.explorer.imported.test_imported import EDEM, LIGGGHTS, YADE
from tests.explorer.viewer.page_session import PageSession, finished, page_context

TEXTS = {"liggghts": LIGGGHTS, "yade": YADE, "edem": EDEM}
CHOICES = {program: choice for choice, program in PROGRAMS.items()}


class Form:
    """The form with a person at it."""

    def __init__(self, server, folder):
        self.actions, self.folder = Actions(), folder / "project"
        self.session = PageSession(material_source("sunflower_extract"))
        page = page_context(server, self.session, self.actions.post, folder / "data")
        page = replace(page, project=replace(page.project, folder=self.folder))
        self.background, self.panel = page.background, ImportPanel(page)

    def send(self, program, name, content):
        """The notice, "" where it is kept."""
        self.panel._program.value = CHOICES[program]
        self.actions.post(lambda: self.panel._take(name, content))
        return finished(self.actions, self.background)

    @property
    def told(self):
        return unescape(self.panel._told.content)


@pytest.fixture
def form(server, tmp_path):
    return Form(server, tmp_path)


def test_the_page_has_it():
    assert ImportPanel in PANELS.values()


@pytest.mark.parametrize("program", TEXTS)
def test_what_was_sent_is_kept_and_told_as_the_command_does(form, tmp_path, program):
    form.panel._name.value = "mine"
    assert form.send(program, "in.beads", TEXTS[program].encode()) == ""
    (tmp_path / "in.beads").write_text(TEXTS[program])
    said = explorer("new", "material", "mine", f"--from-{program}", tmp_path / "in.beads", "--out", tmp_path).stdout
    assert (form.folder / "mine.toml").read_text() == (tmp_path / "mine.toml").read_text()
    notes = [line.removeprefix("note: ") for line in said.splitlines() if line.startswith("note: ")]
    assert notes
    for note in notes:
        assert note in form.told
    assert str(form.folder / "mine.toml") in form.told


def test_it_is_called_as_its_file_is_and_poured_by_a_press(form):
    assert not form.panel._pour_it.visible
    assert form.send("yade", "my beads.py", YADE.encode()) == ""
    assert form.panel._pour_it.visible
    form.actions.post(form.panel._pour)
    assert finished(form.actions, form.background) == ""
    assert form.session.asked == ["start"]
    assert form.session.now.scene == load_scene("funnel", str(form.folder / "my_beads.toml"))


def test_a_folder_of_our_export_comes_as_an_archive(form, tmp_path):
    (tmp_path / "export").mkdir()
    write_material_table(tmp_path / "export", load_scene("funnel", "sunflower_extract"))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for file in (tmp_path / "export").iterdir():
            archive.write(file, f"table/{file.name}")
    assert form.send("edem", "table.zip", packed.getvalue()) == ""
    assert "E = 2 G (1 + nu)" in form.told
    assert "petiole" in (form.folder / "table.toml").read_text()


@pytest.mark.parametrize(
    ("program", "name", "content", "words"),
    [
        ("liggghts", "in.nothing", b"units si\n", "in.nothing: says no material in liggghts's words"),
        ("yade", "a.py", b"x = (", "a.py: "),
        ("edem", "a.csv", b"", "0 bytes; allowed"),
        ("edem", "a.zip", b"no archive", "cannot be unpacked"),
        ("edem", "a.csv", b"\xff\xfe\x00", "is not text"),
        ("liggghts", "../../in.beads", LIGGGHTS.encode(), ""),
    ],
)
def test_what_cannot_be_read_is_one_line_with_the_name_that_was_sent(form, program, name, content, words):
    notice = form.send(program, name, content)
    assert words in notice
    assert "\n" not in notice
    assert "/tmp" not in notice
    kept = sorted(path.name for path in form.folder.rglob("*")) if form.folder.exists() else []
    assert kept == ([] if words else ["in.toml"])


def test_a_file_is_not_overwritten_and_a_name_is_one(form):
    assert form.send("edem", "maize.csv", EDEM.encode()) == ""
    assert "exists already" in form.send("edem", "maize.csv", EDEM.encode())
    form.panel._name.value = "../maize"
    assert "letters, digits" in form.send("edem", "maize.csv", EDEM.encode())
    form.panel._program._impl.value = "Excel"  # as a browser that keeps to no list
    form.actions.post(lambda: form.panel._take("a.xls", b"x"))
    assert "allowed are LIGGGHTS" in finished(form.actions, form.background)
