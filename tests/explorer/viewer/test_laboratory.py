"""The tab "Laboratory": a press shows the answer, uploads are offered and kept, what is wrong is one line."""

import io
import re
import shlex
import zipfile
from dataclasses import replace
from html import unescape

import numpy as np
import openpyxl
import pytest

import solver
from doe.designs import DESIGNS
from doe.laboratory import TESTS
from doe.laboratory.analysis import template_of
from doe.measurement import load_measurement
from explorer.files.uploads import kept_measurements
from explorer.laboratory.command_results import CommandResult, template_file
from explorer.laboratory.run import LabOrder, run_lab
from explorer.scene.source import material_source
from explorer.viewer.actions import Actions
from explorer.viewer.laboratory.analysis_panel import AnalysisPanel
from explorer.viewer.laboratory.answer_view import answer_html
from explorer.viewer.laboratory.audit_panel import AuditPanel
from explorer.viewer.laboratory.bench_panel import BenchPanel
from explorer.viewer.laboratory.design_panel import DesignPanel
from explorer.viewer.laboratory.inputs import positive
from explorer.viewer.laboratory.laboratory_panel import LaboratoryPanel
from explorer.viewer.laboratory.measured_data_panel import BALANCES, NOTHING, PHOTOGRAPHS, MeasuredDataPanel
from explorer.viewer.laboratory.photograph_panel import NO_BOARD, PhotographPanel
from explorer.viewer.laboratory.rig_panel import RigPanel
from explorer.viewer.panel import Now
from explorer.viewer.study.reports_panel import NONE, ReportsPanel
from solver import load_material, with_values
from solver.assets import asset_path
from tests.explorer.command_line import explorer
from tests.explorer.measured.test_balance import BEGINS, MASS, steady, write
from tests.explorer.viewer.page_session import PageSession, finished, page_context
from tests.explorer.viewer.person import Person
from tests.solver.photograph.rendered import save
from tests.solver.photograph.staged import Stage, staged
from tests.solver.photograph.test_checkerboard import LOOK
from tests.solver.photograph.test_checkerboard import board as checkerboard

pytestmark = pytest.mark.usefixtures("unprinted")


PANELS = (
    *(BenchPanel, RigPanel, PhotographPanel, DesignPanel, AnalysisPanel, AuditPanel, MeasuredDataPanel),
    *(LaboratoryPanel, ReportsPanel),
)


class Room:
    """Panels over one background, as in the tab, and a person at each of them."""

    def __init__(self, server, folder):
        self.actions, self.folder = Actions(), folder
        self.session = PageSession(material_source("sunflower_extract"))
        self.page = page_context(server, self.session, self.actions.post, folder)
        self.panels, self._places = {}, {}
        for kind in PANELS:
            with server.gui.add_folder(kind.name) as self._places[kind]:
                self.panels[kind] = kind(self.page)

    def at(self, kind):
        return Person(self._places[kind], lambda: finished(self.actions, self.page.bench_work))

    def show(self, kind, notice=""):
        self.panels[kind].show(Now(self.session.now, notice=notice))


@pytest.fixture
def room(server, tmp_path):
    return Room(server, tmp_path / "uploads")


@pytest.fixture
def bench(room):
    return room.at(BenchPanel)


@pytest.fixture
def design(room):
    return room.at(DesignPanel)


@pytest.fixture
def analysis(room):
    return room.at(AnalysisPanel)


@pytest.fixture
def photograph(room):
    return room.at(PhotographPanel)


def test_every_shipped_bench_test_is_a_choice_and_an_answer(bench):
    for test in bench.options("Test"):
        assert bench.enter("Test", test) == ""
        assert bench.press("Evaluate") == ""
        assert f"explorer lab {test} {test}" in bench.text
        assert not bench.control("Download the files").disabled


def test_the_choice_of_tests_is_the_list_of_tests_and_each_comes_with_its_examples(bench):
    assert bench.options("Test") == tuple(TESTS)
    for test in TESTS:
        assert bench.enter("Test", test) == ""
        assert bench.value("Readings") == test
    bench.enter("Test", "rebound")
    assert bench.options("Readings") == ("rebound", "rebound_glass_acrylic")


def test_the_sheet_of_a_test_is_what_the_command_prints():
    name, content = template_file("sieve")
    assert (name, content.decode()) == ("sieve_sheet.csv", template_of("sieve"))


def test_a_pour_starts_with_what_was_measured(room, bench):
    bench.enter("Test", "inclined_plane")
    assert bench.press("Pour with these parameters") == ""
    assert room.session.asked == ["start"]
    assert room.session.source.material.endswith(".toml")


def test_bad_readings_are_one_line_and_the_pour_stays(room, bench):
    assert bench.enter("Test", "inclined_plane") == ""
    assert bench.upload("Upload: readings", "mine.csv", b"a,b,replicate,angle_deg\nx,y,1,steep\n") == ""
    for button in ("Evaluate", "Pour with these parameters"):
        notice = bench.press(button)
        assert "steep" in notice
        assert "\n" not in notice
    assert room.session.asked == []


@pytest.mark.parametrize(("name", "content"), [("readings.exe", b"x"), ("readings.csv", b"")])
def test_what_cannot_be_kept_is_refused(room, bench, name, content):
    assert "allowed" in bench.upload("Upload: readings", name, content)
    assert not room.folder.exists() or not list(room.folder.iterdir())


def test_a_design_asks_for_what_it_takes(design):
    labels = {
        "runs": "Size",
        "centre": "Centre runs",
        "fraction": "Fraction P",
        "generators": "Generators",
        "nonregular": "Nonregular",
        "fold": "Fold over",
        "alpha": "Axial points",
        "lattice": "Degree of the lattice",
        "model": "Model",
        "constraints": "Constraints",
        "kept": "Finished runs",
    }
    for name, kind in DESIGNS.items():
        assert design.enter("Design", name) == ""
        shown = set(design.labels)
        # All that the command's design takes; levels are those of the file of factors. Blocks go with every design.
        assert {key for key, label in labels.items() if label in shown} == set(kind.options) - {"blocks", "levels"}
        assert {"Blocks", "Runs of each row", "Seed"} <= shown
        assert " ".join(kind.doc.split()) in design.text
    design.enter("Design", "box-behnken")
    design.enter("Blocks", "2")
    assert "allowed: none, as no number of blocks is orthogonal" in design.press("Make the sheet")


@pytest.mark.parametrize(
    ("kind", "entered", "words"),
    [
        (
            "central-composite",
            {"Axial points": "face-centred", "Centre runs": "3"},
            "--centre 3 --alpha face-centred",
        ),
        ("factorial", {"Fraction P": "1", "Seed": "7"}, "--fraction 1 --seed 7"),
        ("d-optimal", {"Size": "12", "Constraints": "shear_modulus + 60*restitution <= 90"}, "'shear_modulus + 60"),
        ("i-optimal", {"Model": "linear", "Runs of each row": "2"}, "--replicates 2 --model linear"),
        ("box-behnken", {"Runs of each row": "2", "Blocks": "2"}, "--replicates 2 --blocks 2"),
    ],
)
def test_what_stands_in_the_form_is_in_the_command_that_repeats_it(design, kind, entered, words):
    design.enter("Design", kind)
    for label, value in entered.items():
        design.enter(label, value)
    assert design.press("Make the sheet") == ""
    assert words in design.text


def test_a_form_left_as_it_is_asks_for_what_the_command_does(design):
    def command():
        assert design.press("Make the sheet") == ""
        return command_in(design)

    assert command() == "explorer design box-behnken --factors sunflower_extract --out runs.csv"
    # What was entered for another design is no part of this one.
    design.enter("Design", "central-composite")
    design.enter("Axial points", "inscribed")
    design.enter("Design", "lhs")
    assert command() == "explorer design lhs --factors sunflower_extract --out runs.csv"


@pytest.mark.parametrize(
    ("label", "entered", "words"),
    [
        ("Centre runs", "-1", "Centre runs '-1'; allowed: a whole number, 0 … 1000, or an empty field"),
        ("Seed", "1.5", "Seed '1.5'; allowed: a whole number, 0 and more"),
        ("Runs of each row", "many", "Runs of each row 'many'"),
        ("Blocks", "1", "2 … 512"),
    ],
)
def test_a_number_that_the_command_refuses_is_refused(design, label, entered, words):
    design.enter(label, entered)
    notice = design.press("Make the sheet")
    assert words in notice
    assert "\n" not in notice


def test_runs_are_added_to_a_sheet_that_was_sent(design):
    sheet = asset_path("runs", "sunflower_extract").read_bytes()
    design.enter("Design", "d-optimal")
    assert design.upload("Upload: finished runs", "first.csv", sheet) == ""
    design.enter("Size", "3")
    assert design.press("Make the sheet") == ""
    assert "20 rows × 1 = 20 runs" in design.text
    assert design.press("Download the files") == ""
    (content,) = design.browser.sent.values()
    assert content.decode().count("24.") > 0  # results of the finished runs


@pytest.mark.parametrize(
    ("choice", "name", "head"), [(1, "runs.csv", "\ufeff# design".encode()), (2, "runs.xlsx", b"PK")]
)
def test_a_sheet_is_made_for_the_spreadsheet_that_opens_it_and_comes_back_filled(design, analysis, choice, name, head):
    design.enter("Sheet as", design.options("Sheet as")[choice])
    assert design.press("Make the sheet") == ""
    assert design.press("Download the files") == ""
    ((taken, content),) = design.browser.sent.items()
    assert taken == name
    assert content.startswith(head)
    assert analysis.upload("Upload: sheet", name, filled(content, name)) == ""
    assert analysis.press("Analyse") == ""
    assert re.search(r"total +[\d.]+ +16\b", analysis.text)  # degrees of freedom of 17 runs


def filled(content, name):
    """A sheet with 24, 25, … for results."""
    if name.endswith(".csv"):
        lines = content.decode().splitlines()
        runs = next(k for k, line in enumerate(lines) if line.startswith("row;")) + 1
        return "\n".join([*lines[:runs], *(f"{line}{24 + k},5" for k, line in enumerate(lines[runs:]))]).encode()
    book = openpyxl.load_workbook(io.BytesIO(content))
    rows = [row for row in book.active.iter_rows() if isinstance(row[0].value, int | float)]
    for k, row in enumerate(rows):
        row[-1].value = 24.5 + k
    sent = io.BytesIO()
    book.save(sent)
    return sent.getvalue()


def test_the_factors_file_to_edit_is_the_chosen_one(design):
    assert design.press("Factors file to edit") == ""
    assert design.browser.sent == {"sunflower_extract.toml": asset_path("designs", "sunflower_extract").read_bytes()}


def test_a_mixture_is_asked_for_its_lattice(design):
    part = '[[factor]]\nname = "%s"\nlow = 0\nhigh = 100\nunit = "%%"\n'
    design.enter("Design", "mixture")
    assert "high minus low differs" in design.press("Make the sheet")  # the shipped factors are no parts
    blend = "".join(part % one for one in ("sand", "clay", "silt"))
    assert design.upload("Upload: factors", "soil.toml", blend.encode()) == ""
    design.enter("Degree of the lattice", "2")
    assert design.press("Make the sheet") == ""
    assert "--lattice 2" in design.text


def test_a_bench_test_asks_for_what_it_takes(bench):
    boxes = {
        "compression": "Compression readings",
        "left_out": "Leave out",
        "twin": "Repeat it on the solver",
        "bias": "Where the formula misses",
    }
    takers = {name: set() for name in boxes}
    for test in TESTS:
        bench.enter("Test", test)
        for name, label in boxes.items():
            takers[name] |= {test} if bench.sees(label) else set()
    assert takers["compression"] == {"shear"}
    assert takers["left_out"] == {"composition"}
    # What the command refuses is not offered.
    for test in TESTS:
        for name, option in (("twin", {"simulate": True}), ("bias", {"bias": True})):
            if test not in takers[name]:
                with pytest.raises(ValueError, match="allowed"):
                    run_lab(LabOrder(test, test, **option), lambda _: None)
    assert len(takers["twin"]) == 6
    assert len(takers["bias"]) == 5


def test_a_photograph_from_the_browser_is_read_and_shown(photograph):
    content = asset_path("photographs", "cone_25_30").read_bytes()
    assert photograph.upload("Upload: photograph", "my pile.JPG", content) == ""
    assert photograph.pictures == []
    assert photograph.press("Read the angle") == ""
    assert "explorer measure" in photograph.text
    assert len(photograph.pictures) == 1
    assert photograph.upload("Upload: photograph", "text.jpg", b"no picture") == ""
    assert "text" in photograph.press("Read the angle")


def test_a_checkerboard_tells_the_lens_of_a_photograph(photograph, tmp_path):
    pile = save(tmp_path / "pile.png", staged(Stage(30.0, fill=0.8, lens=0.1), replace(LOOK, tilt_deg=3.0)))
    board = save(tmp_path / "board.png", checkerboard(0.1))
    for slot, file in (("Upload: photograph", pile), ("Upload: checkerboard", board)):
        assert photograph.upload(slot, file.name, file.read_bytes()) == ""
    assert photograph.press("Read the angle") == ""
    said = photograph.text
    k, low, high = map(float, re.search(r"lens k (\S+) \(95 % (\S+) … (\S+)\): pincushion", said).groups())
    assert low < k < high
    assert (k, high - k) == (pytest.approx(0.1, abs=0.003), pytest.approx(0.0, abs=0.006))
    assert "48; they miss a plane board by 0." in said
    assert "bends the base line" not in said
    words = shlex.split(command_in(photograph))
    assert float(re.search(r"angle of repose (\S+)°", said)[1]) == pytest.approx(30.0, abs=0.5)
    repeated = explorer(*words[1:])
    assert f"k = {k:+.4f}" in repeated.stdout
    # Without one, the base line, which passes the picture's middle here, tells nothing.
    photograph.enter("Checkerboard", NO_BOARD)
    assert photograph.press("Read the angle") == ""
    assert "lens k" not in photograph.text
    assert "--checkerboard" not in command_in(photograph)


def command_in(person):
    """The command line that an answer ends with."""
    return unescape(re.search(r"On the command line:<code[^>]*>(.*?)</code>", person.html, re.DOTALL)[1])


def test_what_is_no_checkerboard_is_refused_in_a_line(photograph):
    content = asset_path("photographs", "cone_25_30").read_bytes()
    assert photograph.upload("Upload: checkerboard", "board.jpg", content) == ""
    line = photograph.press("Read the angle")
    assert "no checkerboard" in line
    assert "\n" not in line
    assert "On the command line" not in photograph.text


def test_an_example_comes_with_its_scale_and_ones_own_photograph_with_what_was_entered(photograph):
    def lengths():
        return photograph.value("Scale [mm per pixel]"), photograph.value("Reference bar [mm]")

    assert lengths() == (0.0, 100.0)
    assert "its bar is 100 mm long" in photograph.text
    assert photograph.enter("Photograph", "trefoil_2_fit_1") == ""
    assert lengths() == (0.2, 0.0)
    assert "a pixel of it is 0.2 mm" in photograph.text
    # The scale of an example is no one's own.
    assert photograph.upload("Upload: photograph", "mine.jpg", b"a picture") == ""
    assert lengths() == (0.0, 0.0)
    assert "lengths stay in pixels" in photograph.text
    photograph.enter("Scale [mm per pixel]", 0.35)
    assert photograph.upload("Upload: photograph", "another.jpg", b"another picture") == ""
    assert lengths()[0] == 0.35
    photograph.enter("Photograph", "cone_25_30")
    assert lengths() == (0.0, 100.0)


def test_a_rig_shows_its_own_parameters_and_the_bodies_that_are_poured(room):
    rig = room.at(RigPanel)
    own = ["Tilt rate [deg/s]", "Body"]
    assert rig.labels[: len(own) + 2] == ["Rig", *own, "Run"]
    assert rig.enter("Rig", "drop_plate_45") == ""
    own = ["Drop height [mm]", "Specimen", "Drops", "Body"]
    assert rig.labels[: len(own) + 2] == ["Rig", *own, "Run"]
    other = material_source("nine_sphere_seed")
    room.session.start(other.scene, 1, other)
    room.show(RigPanel)
    assert rig.options("Body") == tuple(body.name for body in other.scene.bodies)


def test_a_rig_is_run_with_what_is_on_the_screen(room, monkeypatch):
    asked = {}

    def answered(scene, rig, values, seed, folder):
        asked.update(values, scene=scene, rig=rig)
        return CommandResult("0.62 for 0.62", "explorer simulate drop_plate_45")

    monkeypatch.setattr("explorer.viewer.laboratory.rig_panel.rig_result", answered)
    rig = room.at(RigPanel)
    rig.enter("Rig", "drop_plate_45")
    rig.enter("Drop height [mm]", 300.0)
    rig.enter("Body", "petiole")
    assert rig.press("Run") == ""
    assert (asked["rig"], asked["rig.body"], asked["scene"]) == ("drop_plate_45", "petiole", room.session.now.scene)
    assert asked["rig.drop_height"] == pytest.approx(0.3)
    assert "0.62 for 0.62" in rig.text


def test_a_bench_test_is_repeated_on_the_solver_with_the_material_that_is_poured(room, bench, monkeypatch):
    asked = []
    monkeypatch.setattr(
        "explorer.viewer.laboratory.bench_panel.twin_result", lambda order: asked.append(order) or CommandResult("", "")
    )
    now, restitution = room.session.now, "pair.seed.seed.restitution"
    room.session.now = replace(now, scene=with_values(now.scene, {restitution: 0.31}))
    bench.enter("Test", "drop")
    bench.enter("Repeat it on the solver", True)
    assert bench.press("Evaluate") == ""
    bench.enter("Repeat it on the solver", False)
    bench.enter("Where the formula misses", True)
    assert bench.press("Evaluate") == ""
    assert [(one.simulate, one.bias) for one in asked] == [(True, False), (False, True)]
    assert solver.value(load_material(asked[0].material), restitution) == 0.31
    assert asked[1].material is None


def test_a_photograph_is_compared_with_what_is_poured(room, photograph, monkeypatch):
    asked = []

    def answered(read, scene, folder):
        asked.append((read.photo, read.ruler.reference_mm, scene))
        return CommandResult("beside", "explorer measure")

    monkeypatch.setattr("explorer.viewer.laboratory.photograph_panel.compared_result", answered)
    photograph.enter("Reference bar [mm]", 100.0)
    assert photograph.press("Read it beside a pour") == ""
    assert asked == [(photograph.value("Photograph"), 100.0, room.session.now.scene)]


@pytest.mark.parametrize(("entered", "length"), [(0.0, None), (0.2, 0.2), (float("nan"), None), ("wide", None)])
def test_a_length_of_nothing_is_none(entered, length):
    assert positive(entered) == length


def test_a_sheet_is_made_and_a_filled_one_analysed(design, analysis):
    assert design.press("Make the sheet") == ""
    assert "explorer design box-behnken" in design.text

    def analysed(**entered):
        for label, value in entered.items():
            analysis.enter(label.replace("_", " "), value)
        return analysis.press("Analyse")

    assert "every cell is empty" in analysed()  # what was made is chosen, and nobody has filled it in
    error = "Standard_error_of_the_target"
    assert analysed(Sheet="sunflower_extract", Target="24.68", **{error: "0.2"}) == ""
    assert "--target 24.68 --target-error 0.2" in analysis.text
    assert "Contours" in analysis.options("Chart of it")
    assert analysed(Drop_terms="by AICc", Model="quadratic") == ""
    assert "--model quadratic --reduce aicc" in analysis.text
    assert analysed(Terms="A, B") == "Terms: given together with Model; allowed: one of the two"
    assert "target 'steep'" in analysed(Terms="", Target="steep")
    assert "allowed: 0 or more" in analysed(Target="24.68", **{error: "-1"})
    assert "Block shift: no such column for blocks" in analysed(Target="", Block="shift", **{error: ""})


def test_an_audit_of_the_shipped_article_and_of_an_archive(room):
    audit = room.at(AuditPanel)
    folder = asset_path("source_tables", "table1_physical").parent
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for file in folder.iterdir():
            archive.write(file, f"mine/{file.name}")
    assert audit.upload("Upload tables and audit", "mine.zip", packed.getvalue()) == ""
    assert "141 reproduced exactly" in audit.text
    assert "cannot be unpacked" in audit.upload("Upload tables and audit", "mine.zip", b"nothing")
    assert "141 reproduced exactly" in audit.text


def test_names_in_files_that_would_be_marks_on_the_page_are_refused(bench, analysis):
    readings = b"a,b,replicate,angle_deg\n" + b"".join(b"<b>x</b>,y,%d,%d.0\n" % (k, 20 + k) for k in range(4))
    bench.enter("Test", "inclined_plane")
    assert bench.upload("Upload: readings", "mine.csv", readings) == ""
    assert "'<b>x</b>'; allowed: letters, digits" in bench.press("Evaluate")
    assert "<b>x" not in bench.html
    sheet = asset_path("runs", "sunflower_extract").read_text(encoding="utf-8")
    named = sheet.replace("angle_of_repose_deg", "<b>x</b>")
    assert analysis.upload("Upload: sheet", "mine.csv", named.encode()) == ""
    assert "no < > & or quotes" in analysis.press("Analyse")
    assert "<b>x" not in analysis.html


def test_the_tab_tells_what_is_done_and_what_was_refused(room):
    tab = room.at(LaboratoryPanel)
    room.show(LaboratoryPanel, "mine.csv: line 2: <steep>")
    assert "&lt;steep&gt;" in tab.html
    room.page.bench_work.start("auditing", lambda: None, lambda _: None)
    room.show(LaboratoryPanel)
    assert "Busy auditing" in tab.text
    finished(room.actions, room.page.bench_work)


def test_a_command_line_is_selected_as_a_whole():
    html = answer_html(CommandResult("one & two", "explorer audit"))
    assert "one &amp; two" in html
    assert "pre-wrap; overflow-wrap" not in html
    # A line too long for columns is a sentence, and is not cut.
    assert "<div style='white-space:pre-wrap; overflow-wrap" in answer_html(
        CommandResult("word " * 30, "explorer audit")
    )
    assert "user-select:all" in html
    # Columns stay in line, however many there are.
    assert "pre-wrap; overflow-wrap" not in answer_html(CommandResult("seed  shear_modulus  10" * 9, "explorer lab"))
    rows = (("height", "40.0 mm (95 % 39 … 41 mm)"), ("<b>", "&"))
    html = answer_html(CommandResult("", "explorer measure", tables={"a <b>.png": rows}, note="both > 0"))
    # Lines end between words, and not between a number and its unit.
    assert "40.0\u00a0mm (95\u00a0% 39\u00a0… 41\u00a0mm)" in html
    assert "<b>" not in html
    assert "both &gt; 0" in html
    assert "<pre" not in html


def test_another_test_offers_its_own_example(bench):
    assert bench.enter("Test", "drop") == ""
    assert bench.value("Readings") == "drop"
    bench.upload("Upload: readings", "mine.csv", b"x")
    assert bench.value("Readings").endswith(".csv")
    bench.enter("Test", "shear")
    assert bench.value("Readings").endswith(".csv")  # what was sent stays chosen


def test_reports_of_the_laboratory_and_of_commands_are_in_the_room_of_reports(room, analysis, tmp_path):
    reports = room.at(ReportsPanel)
    room.show(ReportsPanel)
    assert reports.options("Report") == (NONE,)
    assert analysis.press("Analyse") == ""
    (folder,) = room.page.project.laboratory.iterdir()
    assert folder.name in analysis.text
    room.show(ReportsPanel)
    assert reports.options("Report") == (folder.name,)
    address = reports.html.split('href="')[1].split('"')[0]
    assert room.page.pages.page(address).body == (folder / "report.html").read_bytes()
    # Beside a project's file, where its commands leave their folders.
    own = tmp_path / "lentils"
    (own / "audit_2").mkdir(parents=True)
    (own / "audit_2" / "report.html").write_text("<p>an audit</p>")
    project = replace(room.page.project, folder=own)
    assert [one.name for one in project.reports] == ["audit_2", folder.name]


def test_measured_data_become_a_choice_of_the_diagnosis(room, tmp_path):
    """Angles, then a balance's curves of another set-up: the folder is that of the command line that is shown."""
    data, uploads = room.at(MeasuredDataPanel), room.page.uploads
    data.enter("Data set", "lot_7")
    data.enter("Angles [°]", "24.1, 25.0, 26.2")
    data.enter("Set-up", "rig.outlet_height=60mm")
    assert data.press("Save the data") == ""
    assert kept_measurements(uploads) == {"lot_7": uploads / "lot_7"}
    (first,) = load_measurement(uploads / "lot_7").fit
    assert first.offered["angle_of_repose_deg"].values.tolist() == [24.1, 25.0, 26.2]
    assert "role: A is fitted" in data.text
    assert "In the list of Diagnose: lot_7." in data.text
    # The same again by the command line.
    words = shlex.split(command_in(data))[1:]
    words[words.index("--out") + 1] = str(tmp_path / "again")
    assert explorer(*words).exit_code == 0
    again = (tmp_path / "again/lot_7/measurement.toml").read_text(encoding="utf-8")
    assert again == (uploads / "lot_7/measurement.toml").read_text(encoding="utf-8")
    data.enter("Set-up's name", "B")
    data.enter("Angles [°]", "")
    data.enter("Flow began at [s]", f"{BEGINS}, {BEGINS}")
    data.enter("Set-up", f"rig.mass={MASS}")
    time = np.arange(0.0, 8.0, 0.05)
    for k in range(2):
        content = write(tmp_path / "b.csv", time, steady(time) + 1e-6 * k * time).read_bytes()
        assert data.upload(BALANCES.label, f"b{k}.csv", content) == ""
    assert re.search(r"balance: b0-\w+\.csv, b1-\w+\.csv(?=<)", data.html)
    assert data.press("Save the data") == ""
    measurement = load_measurement(uploads / "lot_7")
    assert [(one.name, one.role) for one in measurement.conditions] == [("A", "holdout"), ("B", "fit")]
    assert NOTHING in data.html


LABELS = {"angles": "Angles [°]", "name": "Data set", "set_up": "Set-up", "lag": "Lag of the balance [s]"}


def test_measured_data_that_do_not_fit_are_refused_in_one_line(room):
    data, uploads = room.at(MeasuredDataPanel), room.page.uploads

    def refused(**entered):
        for label, value in entered.items():
            data.enter(LABELS[label], value)
        return data.press("Save the data")

    assert "nothing was measured: give Angles, or Add a photograph, " in refused()
    assert "use the command line for a file" in refused(angles="angles.csv")
    assert "letters, digits" in refused(angles="24,25", name="../lot")
    assert "rig.mesh: allowed here: the study's own" in refused(name="lot", set_up="rig.mass=12g rig.mesh=/etc/passwd")
    assert "Lag of the balance 'long'" in refused(set_up="", lag="long")
    data.upload(PHOTOGRAPHS.label, "a.jpg", b"no picture")
    assert "a-" in refused(lag="")
    assert "a-" in data.html
    data.press("Take the files off")
    assert NOTHING in data.html
    assert kept_measurements(uploads) == {}
