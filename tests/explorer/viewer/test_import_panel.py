"""A material of another program's input: what a browser sent is kept as the command keeps it, and told, and poured."""

import io
import zipfile
from dataclasses import replace

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
from tests.explorer.viewer.person import Person

TEXTS = {"liggghts": LIGGGHTS, "yade": YADE, "edem": EDEM}
CHOICES = {program: choice for choice, program in PROGRAMS.items()}
NAME, UPLOAD, POUR = "Name of the material", "Upload it and read", "Pour this material"


class Form:
    """The form with a person at it."""

    def __init__(self, server, folder):
        actions, self.folder = Actions(), folder / "project"
        self.session = PageSession(material_source("sunflower_extract"))
        page = page_context(server, self.session, actions.post, folder / "data")
        page = replace(page, project=replace(page.project, folder=self.folder))
        with server.gui.add_folder("From other programs") as place:
            ImportPanel(page)
        self.person = Person(place, lambda: finished(actions, page.background))

    def send(self, program, name, content):
        """The notice, "" where it is kept."""
        self.person.enter("File of", CHOICES[program])
        return self.person.upload(UPLOAD, name, content)


@pytest.fixture
def form(server, tmp_path):
    return Form(server, tmp_path)


def test_the_page_has_it():
    assert ImportPanel in PANELS.values()


@pytest.mark.parametrize("program", TEXTS)
def test_what_was_sent_is_kept_and_told_as_the_command_does(form, tmp_path, program):
    form.person.enter(NAME, "mine")
    assert form.send(program, "in.beads", TEXTS[program].encode()) == ""
    (tmp_path / "in.beads").write_text(TEXTS[program])
    said = explorer("new", "material", "mine", f"--from-{program}", tmp_path / "in.beads", "--out", tmp_path).stdout
    assert (form.folder / "mine.toml").read_text() == (tmp_path / "mine.toml").read_text()
    notes = [line.removeprefix("note: ") for line in said.splitlines() if line.startswith("note: ")]
    assert notes
    for note in notes:
        assert note in form.person.text
    assert str(form.folder / "mine.toml") in form.person.text


def test_it_is_called_as_its_file_is_and_poured_by_a_press(form):
    assert not form.person.sees(POUR)
    assert form.send("yade", "my beads.py", YADE.encode()) == ""
    assert form.person.press(POUR) == ""
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
    assert "E = 2 G (1 + nu)" in form.person.text
    assert "petiole" in (form.folder / "table.toml").read_text()


@pytest.mark.parametrize(
    ("program", "name", "content", "words"),
    [
        ("liggghts", "in.nothing", b"units si\n", "in.nothing: no material found in liggghts's syntax"),
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
    form.person.enter(NAME, "../maize")
    assert "letters, digits" in form.send("edem", "maize.csv", EDEM.encode())
    form.person.send("File of", "Excel")
    assert "allowed: LIGGGHTS" in form.person.upload(UPLOAD, "a.xls", b"x")
