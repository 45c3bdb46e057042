"""The tab "Laboratory": a press shows the answer, uploads are offered and kept, what is wrong is one line."""

import html
import io
import re
import shlex
import zipfile
from dataclasses import replace
from html import unescape
from types import SimpleNamespace

import numpy as np
import openpyxl
import pytest
from viser import UploadedFile

from doe.designs import DESIGNS
from doe.laboratory import TESTS
from doe.laboratory.analysis import template_of
from doe.measurement import load_measurement
from explorer.design.run_plan import DesignOrder
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
from explorer.viewer.study.diagnosis_panel import DiagnosisPanel
from explorer.viewer.study.reports_panel import NONE, ReportsPanel
from solver.assets import asset_path
from tests.explorer.command_line import explorer
from tests.explorer.measured.test_balance import BEGINS, MASS, steady, write
from tests.explorer.viewer.page_session import PageSession, event, finished, page_context
from tests.solver.photograph.rendered import save
from tests.solver.photograph.staged import Stage, staged
from tests.solver.photograph.test_checkerboard import LOOK
from tests.solver.photograph.test_checkerboard import board as checkerboard

pytestmark = pytest.mark.usefixtures("unprinted")


class Bench:
    """Panels over one background, as in the tab."""

    def __init__(self, server, folder):
        self.actions, self.folder = Actions(), folder
        self.session = PageSession(material_source("sunflower_extract"))
        page = page_context(server, self.session, self.actions.post, folder)
        self.background = page.bench_work
        self.bench, self.rig, self.photograph = BenchPanel(page), RigPanel(page), PhotographPanel(page)
        self.design, self.analysis = DesignPanel(page), AnalysisPanel(page)
        self.audit, self.reports = AuditPanel(page), ReportsPanel(page)
        self.data = MeasuredDataPanel(page)
        self.page = page

    def do(self, act):
        self.actions.post(act)
        return finished(self.actions, self.background)

    def choose_rig(self, name):
        self.rig._rig.value = name
        event(self.rig._rig, name)
        finished(self.actions, self.background)


@pytest.fixture
def bench(server, tmp_path):
    return Bench(server, tmp_path / "uploads")


def text_of(view):
    return view._text.content


def test_every_shipped_bench_test_is_a_choice_and_an_answer(bench):
    for test in bench.bench._test.options:
        bench.bench._test.value = test
        bench.bench._readings.offer((test,))
        assert bench.do(bench.bench._evaluate) == ""
        assert f"explorer lab {test} {test}" in text_of(bench.bench.view)
        assert not bench.bench.view._take.disabled


def test_the_choice_of_tests_is_the_list_of_tests_and_each_comes_with_its_examples(bench):
    assert tuple(bench.bench._test.options) == tuple(TESTS)
    for test in TESTS:
        bench.bench._test.value = test
        event(bench.bench._test, test)
        assert finished(bench.actions, bench.background) == ""
        assert bench.bench._readings.chosen == test
    bench.bench._test.value = "rebound"
    event(bench.bench._test, "rebound")
    finished(bench.actions, bench.background)
    assert tuple(bench.bench._readings._choice.options) == ("rebound", "rebound_glass_acrylic")


def test_the_sheet_of_a_test_is_what_the_command_prints():
    name, content = template_file("sieve")
    assert (name, content.decode()) == ("sieve_sheet.csv", template_of("sieve"))


def test_a_pour_starts_with_what_was_measured(bench):
    bench.bench._test.value = "inclined_plane"
    bench.bench._readings.offer(("inclined_plane",))
    assert bench.do(bench.bench._pour) == ""
    assert bench.session.asked == ["start"]
    assert bench.session.source.material.endswith(".toml")


def test_bad_readings_are_one_line_and_the_pour_stays(bench):
    slot = bench.bench._readings
    bench.actions.post(lambda: slot.take("mine.csv", b"a,b,replicate,angle_deg\nx,y,1,steep\n"))
    assert finished(bench.actions, bench.background) == ""
    bench.bench._test.value = "inclined_plane"
    for act in (bench.bench._evaluate, bench.bench._pour):
        notice = bench.do(act)
        assert "steep" in notice
        assert "\n" not in notice
    assert bench.session.asked == []


@pytest.mark.parametrize(("name", "content"), [("readings.exe", b"x"), ("readings.csv", b"")])
def test_what_cannot_be_kept_is_refused(bench, name, content):
    notice = bench.do(lambda: bench.bench._readings.take(name, content))
    assert "allowed" in notice
    assert not bench.folder.exists() or not list(bench.folder.iterdir())


def choose_design(bench, name):
    bench.design._kind.value = name
    event(bench.design._kind, name)
    assert finished(bench.actions, bench.background) == ""


def test_a_design_asks_for_what_it_takes(bench):
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
    for name, design in DESIGNS.items():
        choose_design(bench, name)
        shown = shown_labels(bench.design)
        # All that the command's design takes; levels are those of the file of factors. Blocks go with every design.
        assert {key for key, label in labels.items() if label in shown} == set(design.options) - {"blocks", "levels"}
        assert {"Blocks", "Runs of each row", "Seed"} <= shown
        assert design.doc in unescape(bench.design._for.content)
    choose_design(bench, "box-behnken")
    bench.design._numbers["blocks"].value = "2"
    assert "3 factors; there are none that are orthogonal" in bench.do(bench.design._make)


def shown_labels(panel):
    """Labels of what a panel shows."""
    handles = [one for one in (*vars(panel).values(), *panel._numbers.values()) if getattr(one, "visible", False)]
    return {getattr(getattr(one, "_choice", one), "label", "") for one in handles}


@pytest.mark.parametrize(
    ("kind", "entered", "words"),
    [
        ("central-composite", {"alpha": "face-centred", "centre": "3"}, "--centre 3 --alpha face-centred"),
        ("factorial", {"fraction": "1", "seed": "7"}, "--fraction 1 --seed 7"),
        ("d-optimal", {"runs": "12", "constraints": "shear_modulus + 60*restitution <= 90"}, "'shear_modulus + 60"),
        ("i-optimal", {"model": "linear", "replicates": "2"}, "--replicates 2 --model linear"),
        ("box-behnken", {"replicates": "2", "blocks": "2"}, "--replicates 2 --blocks 2"),
    ],
)
def test_what_stands_in_the_form_is_in_the_command_that_repeats_it(bench, kind, entered, words):
    choose_design(bench, kind)
    for name, value in entered.items():
        bench.design._fields.get(name, bench.design._numbers.get(name)).value = value
    assert bench.do(bench.design._make) == ""
    assert words in unescape(text_of(bench.design.view))


def test_a_form_left_as_it_is_asks_for_what_the_command_does(bench):
    assert bench.design._order() == DesignOrder("box-behnken")
    # What was entered for another design is no part of this one.
    choose_design(bench, "central-composite")
    bench.design._alpha.value = "inscribed"
    choose_design(bench, "lhs")
    assert bench.design._order() == DesignOrder("lhs")


@pytest.mark.parametrize(
    ("entered", "words"),
    [
        ({"centre": "-1"}, "Centre runs '-1': allowed is a whole number, 0 … 1000, or nothing"),
        ({"seed": "1.5"}, "Seed '1.5': allowed is a whole number, 0 and more"),
        ({"replicates": "many"}, "Runs of each row 'many'"),
        ({"blocks": "1"}, "2 … 512"),
    ],
)
def test_a_number_that_the_command_refuses_is_refused(bench, entered, words):
    for name, value in entered.items():
        bench.design._numbers[name].value = value
    notice = bench.do(bench.design._make)
    assert words in notice
    assert "\n" not in notice


def test_runs_are_added_to_a_sheet_that_was_sent(bench):
    sheet = asset_path("runs", "sunflower_extract").read_bytes()
    choose_design(bench, "d-optimal")
    assert bench.do(lambda: bench.design._kept.take("first.csv", sheet)) == ""
    bench.design._numbers["runs"].value = "3"
    assert bench.do(bench.design._make) == ""
    assert "20 rows × 1 = 20 runs" in text_of(bench.design.view)
    (content,) = bench.design.view._answer.files.values()
    assert content.decode().count("24.") > 0  # results of the finished runs


@pytest.mark.parametrize(
    ("choice", "name", "head"), [(1, "runs.csv", "\ufeff# design".encode()), (2, "runs.xlsx", b"PK")]
)
def test_a_sheet_is_made_for_the_spreadsheet_that_opens_it_and_comes_back_filled(bench, choice, name, head):
    bench.design._format.value = bench.design._format.options[choice]
    assert bench.do(bench.design._make) == ""
    ((taken, content),) = bench.design.view._answer.files.items()
    assert taken == name
    assert content.startswith(head)
    assert bench.do(lambda: bench.analysis._filled.take(name, filled(content, name))) == ""
    assert bench.do(bench.analysis._analyse) == ""
    assert re.search(r"total +[\d.]+ +16\b", text_of(bench.analysis.view))  # degrees of freedom of 17 runs


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


def test_the_factors_file_to_edit_is_the_chosen_one(bench):
    assert bench.design._factors_file() == (
        "sunflower_extract.toml",
        asset_path("designs", "sunflower_extract").read_bytes(),
    )


def test_a_mixture_is_asked_for_its_lattice(bench):
    part = '[[factor]]\nname = "%s"\nlow = 0\nhigh = 100\nunit = "%%"\n'
    choose_design(bench, "mixture")
    assert "high less low is not the same" in bench.do(bench.design._make)  # the shipped factors are no parts
    blend = "".join(part % one for one in ("sand", "clay", "silt"))
    assert bench.do(lambda: bench.design._factors.take("soil.toml", blend.encode())) == ""
    bench.design._numbers["lattice"].value = "2"
    assert bench.do(bench.design._make) == ""
    assert "--lattice 2" in text_of(bench.design.view)


def test_a_bench_test_asks_for_what_it_takes(bench):
    panel = bench.bench
    boxes = {"compression": panel._compression, "left_out": panel._left_out, "twin": panel._twin, "bias": panel._bias}
    takers = {name: set() for name in boxes}
    for test in TESTS:
        panel._test.value = test
        event(panel._test, test)
        finished(bench.actions, bench.background)
        for name, box in boxes.items():
            takers[name] |= {test} if box.visible else set()
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


def test_a_photograph_from_the_browser_is_read_and_shown(bench):
    content = asset_path("photographs", "cone_25_30").read_bytes()
    assert bench.do(lambda: bench.photograph._photo.take("my pile.JPG", content)) == ""
    assert bench.do(bench.photograph._read) == ""
    assert "explorer measure" in text_of(bench.photograph.view)
    assert bench.photograph.view._picture is not None
    assert bench.do(lambda: bench.photograph._photo.take("text.jpg", b"no picture")) == ""
    assert "text" in bench.do(bench.photograph._read)


def test_a_checkerboard_tells_the_lens_of_a_photograph(bench, tmp_path):
    panel = bench.photograph
    pile = save(tmp_path / "pile.png", staged(Stage(30.0, fill=0.8, lens=0.1), replace(LOOK, tilt_deg=3.0)))
    board = save(tmp_path / "board.png", checkerboard(0.1))
    for slot, file in ((panel._photo, pile), (panel._board, board)):
        assert bench.do(lambda slot=slot, file=file: slot.take(file.name, file.read_bytes())) == ""
    assert bench.do(panel._read) == ""
    said = unescape(text_of(panel.view)).replace("\u00a0", " ")
    k, low, high = map(float, re.search(r"lens k</th><td[^>]*>(\S+) \(95 % (\S+) … (\S+)\): pincushion", said).groups())
    assert low < k < high
    assert (k, high - k) == (pytest.approx(0.1, abs=0.003), pytest.approx(0.0, abs=0.006))
    assert "48; they miss a plane board by 0." in said
    assert "bends the base line" not in said
    words = shlex.split(panel.view._answer.command)
    assert float(re.search(r"angle of repose</th><td[^>]*>(\S+)°", said)[1]) == pytest.approx(30.0, abs=0.5)
    repeated = explorer(*words[1:])
    assert f"k = {k:+.4f}" in repeated.stdout
    # Without one, the base line, which passes the picture's middle here, tells nothing.
    panel._board._choice.value = NO_BOARD
    assert bench.do(panel._read) == ""
    assert "lens k" not in text_of(panel.view)
    assert "--checkerboard" not in panel.view._answer.command


def test_what_is_no_checkerboard_is_refused_in_a_line(bench):
    panel = bench.photograph
    content = asset_path("photographs", "cone_25_30").read_bytes()
    assert bench.do(lambda: panel._board.take("board.jpg", content)) == ""
    line = bench.do(panel._read)
    assert "no checkerboard" in line
    assert "\n" not in line
    assert panel._shown is None


def test_an_example_comes_with_its_scale_and_ones_own_photograph_with_what_was_entered(bench):
    panel = bench.photograph

    def choose(name):
        event(panel._photo._choice, name)
        assert finished(bench.actions, bench.background) == ""
        return panel._scale.value, panel._bar.value, panel._ruler_said.content

    assert (panel._scale.value, panel._bar.value) == (0.0, 100.0)
    assert "its bar is 100 mm long" in panel._ruler_said.content
    scale, bar, said = choose("trefoil_2_fit_1")
    assert (scale, bar) == (0.2, 0.0)
    assert "a pixel of it is 0.2 mm" in said
    # The scale of an example is no one's own.
    assert bench.do(lambda: panel._photo.take("mine.jpg", b"a picture")) == ""
    assert (panel._scale.value, panel._bar.value) == (0.0, 0.0)
    assert "lengths stay in pixels" in panel._ruler_said.content
    panel._scale.value = 0.35
    assert bench.do(lambda: panel._photo.take("another.jpg", b"another picture")) == ""
    assert panel._scale.value == 0.35
    assert choose("cone_25_30")[:2] == (0.0, 100.0)


def test_a_rig_shows_its_own_parameters_and_the_bodies_that_are_poured(bench):
    panel = bench.rig
    assert {"rig.tilt_rate", "rig.body"} == set(panel._inputs)
    bench.choose_rig("drop_plate_45")
    assert {"rig.drop_height", "rig.specimen", "rig.drops", "rig.body"} == set(panel._inputs)
    other = material_source("nine_sphere_seed")
    bench.session.start(other.scene, 1, other)
    panel.show(Now(bench.session.now))
    assert panel._inputs["rig.body"].options == tuple(body.name for body in other.scene.bodies)


def test_a_rig_is_run_with_what_is_on_the_screen(bench, monkeypatch):
    asked = {}

    def answered(scene, rig, values, seed, folder):
        asked.update(values, scene=scene, rig=rig)
        return CommandResult("0.62 for 0.62", "explorer simulate drop_plate_45")

    monkeypatch.setattr("explorer.viewer.laboratory.rig_panel.rig_result", answered)
    bench.choose_rig("drop_plate_45")
    bench.rig._inputs["rig.drop_height"].value = 300.0
    bench.rig._inputs["rig.body"].value = "petiole"
    assert bench.do(bench.rig._run) == ""
    assert (asked["rig"], asked["rig.body"], asked["scene"]) == ("drop_plate_45", "petiole", bench.session.now.scene)
    assert asked["rig.drop_height"] == pytest.approx(0.3)
    assert "0.62 for 0.62" in text_of(bench.rig.view)


def test_a_bench_test_is_repeated_on_the_solver_with_the_material_that_is_poured(bench, monkeypatch):
    asked = []
    monkeypatch.setattr(
        "explorer.viewer.laboratory.bench_panel.twin_result", lambda order: asked.append(order) or CommandResult("", "")
    )
    bench.bench._test.value = "drop"
    bench.bench._readings.offer(("drop",))
    bench.bench._twin.value = True
    assert bench.do(bench.bench._evaluate) == ""
    bench.bench._twin.value, bench.bench._bias.value = False, True
    assert bench.do(bench.bench._evaluate) == ""
    assert [(one.simulate, one.bias, one.material) for one in asked] == [
        (True, False, "sunflower_extract"),
        (False, True, None),
    ]


def test_a_photograph_is_compared_with_what_is_poured(bench, monkeypatch):
    asked = []

    def answered(read, scene, folder):
        asked.append((read.photo, read.ruler.reference_mm, scene))
        return CommandResult("beside", "explorer measure")

    monkeypatch.setattr("explorer.viewer.laboratory.photograph_panel.compared_result", answered)
    bench.photograph._bar.value = 100.0
    assert bench.do(bench.photograph._compare) == ""
    assert asked == [(bench.photograph._photo.chosen, 100.0, bench.session.now.scene)]


@pytest.mark.parametrize(("entered", "length"), [(0.0, None), (0.2, 0.2), (float("nan"), None), ("wide", None)])
def test_a_length_of_nothing_is_none(entered, length):
    assert positive(entered) == length


def test_a_sheet_is_made_and_a_filled_one_analysed(bench):
    assert bench.do(bench.design._make) == ""
    assert "explorer design box-behnken" in text_of(bench.design.view)
    panel = bench.analysis
    assert "every cell is empty" in bench.do(panel._analyse)  # what was made is chosen, and nobody has filled it in
    panel._filled._choice.value = "sunflower_extract"
    panel._target.value, panel._target_error.value = "24.68", "0.2"
    assert bench.do(panel._analyse) == ""
    assert "--target 24.68 --target-error 0.2" in text_of(panel.view)
    assert "Contours" in panel.view._plots._choice.options
    panel._reduce.value, panel._model.value = "by AICc", "quadratic"
    assert bench.do(panel._analyse) == ""
    assert "--model quadratic --reduce aicc" in text_of(panel.view)
    panel._terms.value = "A, B"
    assert "stands instead of --model" in bench.do(panel._analyse)
    panel._terms.value, panel._target.value = "", "steep"
    assert "target 'steep'" in bench.do(panel._analyse)
    panel._target.value, panel._target_error.value = "24.68", "-1"
    assert "allowed: 0 and more" in bench.do(panel._analyse)
    panel._target.value, panel._target_error.value, panel._block.value = "", "", "shift"
    assert "--block shift: no column of blocks" in bench.do(panel._analyse)


def test_an_audit_of_the_shipped_article_and_of_an_archive(bench):
    folder = asset_path("source_tables", "table1_physical").parent
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for file in folder.iterdir():
            archive.write(file, f"mine/{file.name}")
    assert bench.do(lambda: bench.audit._audit("mine.zip", packed.getvalue())) == ""
    assert "141 reproduced exactly" in text_of(bench.audit.view)
    assert "cannot be unpacked" in bench.do(lambda: bench.audit._audit("mine.zip", b"nothing"))
    assert "141 reproduced exactly" in text_of(bench.audit.view)


def test_text_from_files_is_shown_as_text(bench):
    slot = bench.bench._readings
    readings = b"a,b,replicate,angle_deg\n" + b"".join(b"<b>x</b>,y,%d,%d.0\n" % (k, 20 + k) for k in range(4))
    assert bench.do(lambda: slot.take("mine.csv", readings)) == ""
    bench.bench._test.value = "inclined_plane"
    bench.do(bench.bench._evaluate)
    assert "<b>x" not in text_of(bench.bench.view)


def test_the_tab_tells_what_is_done_and_what_was_refused(server, tmp_path):
    actions = Actions()
    session = PageSession(material_source("sunflower_extract"))
    tab = LaboratoryPanel(page_context(server, session, actions.post, tmp_path))
    tab.show(Now(session.now, notice="mine.csv: line 2: <steep>"))
    assert "&lt;steep&gt;" in tab._state.content
    tab._background.start("auditing", lambda: None, lambda _: None)
    tab.show(Now(session.now))
    assert "Busy auditing" in tab._state.content
    finished(actions, tab._background)


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
    event(bench.bench._test, "drop")
    assert finished(bench.actions, bench.background) == ""
    assert bench.bench._readings.chosen == "drop"
    event(bench.bench._readings.upload, UploadedFile("mine.csv", b"x"))
    finished(bench.actions, bench.background)
    assert bench.bench._readings.chosen.endswith(".csv")
    event(bench.bench._test, "shear")
    finished(bench.actions, bench.background)
    assert bench.bench._readings.chosen.endswith(".csv")  # what was sent stays chosen


def test_reports_of_the_laboratory_and_of_commands_are_in_the_room_of_reports(bench, tmp_path):
    bench.reports.show(Now(bench.session.now))
    assert bench.reports._list.options == (NONE,)
    bench.analysis._analyse()
    assert finished(bench.actions, bench.background) == ""
    (folder,) = bench.page.project.laboratory.iterdir()
    assert folder.name in text_of(bench.analysis.view)
    bench.reports.show(Now(bench.session.now))
    assert bench.reports._list.options == (folder.name,)
    address = bench.reports._frame.content.split('href="')[1].split('"')[0]
    assert bench.page.pages.page(address).body == (folder / "report.html").read_bytes()
    # Beside a project's file, where its commands leave their folders.
    own = tmp_path / "lentils"
    (own / "audit_2").mkdir(parents=True)
    (own / "audit_2" / "report.html").write_text("<p>an audit</p>")
    project = replace(bench.page.project, folder=own)
    assert [one.name for one in project.reports] == ["audit_2", folder.name]


def test_measured_data_become_a_choice_of_the_diagnosis(bench, tmp_path):
    """Angles, then a balance's curves of another set-up: the folder is that of the command line that is shown."""
    panel, uploads = bench.data, bench.page.uploads
    panel._set.value, panel._angles.value = "lot_7", "24.1, 25.0, 26.2"
    panel._changes.value = "rig.outlet_height=60mm"
    assert bench.do(panel._save) == ""
    assert kept_measurements(uploads) == {"lot_7": uploads / "lot_7"}
    (first,) = load_measurement(uploads / "lot_7").fit
    assert first.offered["angle_of_repose_deg"].values.tolist() == [24.1, 25.0, 26.2]
    shown = html.unescape(text_of(panel.view))
    assert "role: A is fitted" in shown
    assert "In the list of Diagnose: lot_7." in shown
    assert "lot_7" in DiagnosisPanel._offered(SimpleNamespace(_shipped=(), _uploads=uploads))
    # The same again by the command line.
    command = re.search(r"(explorer new measurement .*?)</code>", shown)[1]
    words = shlex.split(command)[1:]
    words[words.index("--out") + 1] = str(tmp_path / "again")
    assert explorer(*words).exit_code == 0
    again = (tmp_path / "again/lot_7/measurement.toml").read_text(encoding="utf-8")
    assert again == (uploads / "lot_7/measurement.toml").read_text(encoding="utf-8")
    panel._condition.value, panel._angles.value, panel._starts.value = "B", "", f"{BEGINS}, {BEGINS}"
    panel._changes.value = f"rig.mass={MASS}"
    time = np.arange(0.0, 8.0, 0.05)
    for k in range(2):
        content = write(tmp_path / "b.csv", time, steady(time) + 1e-6 * k * time).read_bytes()
        event(panel.uploads[BALANCES], UploadedFile(f"b{k}.csv", content))
        finished(bench.actions, bench.background)
    assert panel._kept.content.count(".csv") == 2
    assert bench.do(panel._save) == ""
    measurement = load_measurement(uploads / "lot_7")
    assert [(one.name, one.role) for one in measurement.conditions] == [("A", "holdout"), ("B", "fit")]
    assert NOTHING in panel._kept.content


def test_measured_data_that_do_not_fit_are_refused_in_one_line(bench):
    panel, uploads = bench.data, bench.page.uploads
    assert "nothing was measured: give --photo" in bench.do(panel._save)
    panel._angles.value = "angles.csv"
    assert "a file of them goes by the command line" in bench.do(panel._save)
    panel._angles.value, panel._set.value = "24,25", "../lot"
    assert "letters, digits" in bench.do(panel._save)
    panel._set.value, panel._changes.value = "lot", "rig.mass=12g rig.mesh=/etc/passwd"
    assert "rig.mesh: allowed: the study's own" in bench.do(panel._save)
    panel._changes.value, panel._lag.value = "", "long"
    assert "Lag of the balance 'long'" in bench.do(panel._save)
    event(panel.uploads[PHOTOGRAPHS], UploadedFile("a.jpg", b"no picture"))
    finished(bench.actions, bench.background)
    panel._lag.value = ""
    assert "a-" in bench.do(panel._save)
    assert "a-" in panel._kept.content
    bench.do(panel._forget)
    assert NOTHING in panel._kept.content
    assert kept_measurements(uploads) == {}
