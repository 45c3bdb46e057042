"""A photograph made the target on the page: the laboratory, the state line, the room Calibrate, a study's board."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from doe.provenance import PouredPile
from doe.studies.study import load_study
from explorer.photograph.run import run_measure
from explorer.photograph.target import FOLDER, load_target
from explorer.project.project import load_project, new_project
from explorer.scene.source import material_source
from explorer.study.edit import StudyEdits
from explorer.viewer.actions import Actions
from explorer.viewer.board.board import board_json
from explorer.viewer.board.folder_board import FolderBoard
from explorer.viewer.board.study_board import PHOTOGRAPHED, photographed_of, study_board
from explorer.viewer.laboratory.photograph_panel import PhotographPanel
from explorer.viewer.panel import Now
from explorer.viewer.shell.state_line import StateLine
from explorer.viewer.shell.web_pages import WebPages
from explorer.viewer.study.process_view import START
from explorer.viewer.study.study_panel import StudyPanel
from tests.explorer import reported_studies
from tests.explorer.viewer.page_session import PageSession, finished, page_context
from tests.explorer.viewer.person import Person
from tests.explorer.viewer.study_panel_at_hand import FakeStudy
from tests.solver.photograph.rendered import Look, photograph, solid_cover


def picture(angle, seed=0):
    """A solid with both flanks at ``angle``, as PNG."""
    file = io.BytesIO()
    Image.fromarray(photograph(solid_cover(angle, angle, 110), Look(width=700, seed=seed))).save(file, "PNG")
    return file.getvalue()


USE, ADD, REMOVE = "Use as target", "Add to the target", "Remove the target"


class ProjectPage:
    """Laboratory, Calibrate and state line of a project in ``folder``, as after a start of the server."""

    def __init__(self, server, folder):
        self.project = load_project(folder)
        study = FakeStudy()
        study.study_file = self.project.study
        self.actions, self.session = Actions(), PageSession(material_source("sunflower_extract"))
        page = page_context(server, self.session, self.actions.post, folder / "data", study, FakeStudy())
        self.page = replace(page, project=self.project)
        self._panels, places = [StateLine(self.page)], []
        for kind in (PhotographPanel, StudyPanel):
            with server.gui.add_folder(kind.name) as place:
                self._panels.append(kind(self.page))
            places.append(place)
        self.photograph, self.calibrate = (Person(place, self.done) for place in places)
        self.show()

    def show(self):
        for panel in self._panels:
            panel.show(Now(self.session.now))

    def done(self):
        notice = finished(self.actions, self.page.bench_work)
        self.show()
        return notice

    def read(self, content, name="pile.png", scale=0.5):
        assert self.photograph.upload("Upload: photograph", name, content) == ""
        self.photograph.enter("Scale [mm per pixel]", scale)
        return self.photograph.press("Read the angle")

    @property
    def measured(self):
        steps = {one["name"]: one for one in self.page.channel.told["project"]["steps"]}
        return steps["Measured"]

    @property
    def disabled(self):
        return [self.photograph.control(label).disabled for label in (USE, ADD, REMOVE)]


@pytest.fixture
def folder(tmp_path):
    new_project(tmp_path / "lentil")
    return tmp_path / "lentil"


def test_what_was_read_becomes_the_target_and_is_there_after_a_restart(server, folder):
    page = ProjectPage(server, folder)
    assert (page.measured["state"], page.measured["said"]) == ("assumed", "17.00° ± 2.00°")
    assert "17.00° ± 2.00° SD \\(assumed, n = 10\\)" in page.calibrate.text
    assert page.disabled == [True, True, True]
    assert page.read(picture(27.0)) == ""
    assert page.disabled == [False, True, True]
    assert page.photograph.press(USE) == ""
    target = load_target(folder / FOLDER)
    assert (target.n, target.mean) == (1, pytest.approx(27.0, abs=0.15))
    for shown in (page, ProjectPage(server, folder)):
        assert shown.measured["state"] == "assumed"  # one pile: how piles differ is not measured
        assert shown.measured["said"] == f"{target.mean:.2f}° (standard error {target.sd:.2f}°) · photograph"
        assert "how piles differ among each other is in neither" in shown.measured["hint"]
        assert "read off pile.png" in shown.calibrate.text
        # The answer and the target give the same two numbers the same names.
        shown_twice = f"{target.mean:.2f}° (95 % {target.mean - 2 * target.sd:.2f} … "
        shown_twice += f"{target.mean + 2 * target.sd:.2f}°; standard error {target.sd:.2f}°)"
        assert shown_twice in shown.measured["hint"]
        assert shown_twice in page.photograph.text
        assert "One photograph" in shown.photograph.text
        assert shown.disabled[2] is False
    assert (folder / FOLDER / target.result.piles[0].name).read_bytes() == picture(27.0)


def test_a_photograph_is_read_once_for_its_answer_and_its_target(server, folder, monkeypatch):
    readings = []

    def counted(order):
        readings.append(order)
        return run_measure(order)

    monkeypatch.setattr("explorer.laboratory.command_results.run_measure", counted)
    page = ProjectPage(server, folder)
    assert page.read(picture(27.0)) == ""
    assert page.photograph.press(USE) == ""
    assert page.photograph.press(REMOVE) == ""
    assert page.photograph.press(USE) == ""
    assert len(readings) == 1


def test_more_piles_are_added_and_the_target_removed(server, folder):
    page = ProjectPage(server, folder)
    for k, (angle, button) in enumerate(((24.0, USE), (27.0, ADD), (30.0, ADD)), start=1):
        assert page.read(picture(angle, k), f"pile {k}.png") == ""
        assert page.photograph.press(button) == ""
    target = load_target(folder / FOLDER)
    # Of 24, 27 and 30: mean 27, SD 3.
    assert (target.n, target.mean, target.sd) == (3, pytest.approx(27.0, abs=0.15), pytest.approx(3.0, abs=0.2))
    assert page.measured["said"] == f"27.0° (standard deviation {target.sd:.1f}°) · 3 photographs"
    assert "standard error of the mean" in page.calibrate.text
    assert "is in the target already" in page.photograph.press(ADD)
    assert load_target(folder / FOLDER).n == 3
    assert page.photograph.press(USE) == ""  # the last one alone
    assert load_target(folder / FOLDER).mean == pytest.approx(30.0, abs=0.15)
    assert page.photograph.press(REMOVE) == ""
    assert not (folder / FOLDER).exists()
    assert (page.measured["state"], page.disabled) == ("assumed", [False, True, True])
    assert "From the study's file" in page.calibrate.text


def test_what_shows_no_pile_is_refused_in_a_line(server, folder):
    page = ProjectPage(server, folder)
    assert "read a photograph first" in page.photograph.send(USE, True)
    blank = io.BytesIO()
    Image.fromarray(np.full((200, 300), 150, dtype=np.uint8)).save(blank, "PNG")
    assert page.read(blank.getvalue(), "blank.png") == ""
    notice = page.photograph.press(USE)
    assert "no angle: blank" in notice
    assert "\n" not in notice
    assert not (folder / FOLDER).exists()
    assert page.measured["state"] == "assumed"


def test_what_is_kept_is_what_was_read_and_not_what_is_chosen_since(server, folder):
    page = ProjectPage(server, folder)
    assert page.read(picture(24.0), "first.png") == ""
    page.photograph.upload("Upload: photograph", "second.png", picture(30.0))
    page.photograph.enter("Scale [mm per pixel]", 0.0)
    assert page.photograph.press(USE) == ""
    target = load_target(folder / FOLDER)
    assert (target.mean, target.result.piles[0].unit) == (pytest.approx(24.0, abs=0.15), "m")


def test_the_boxes_of_the_target_are_hidden_while_photographs_hold(server, folder):
    page = ProjectPage(server, folder)
    goal = page.calibrate.within("Ranges and target of the next study")
    boxes = ["Target: mean [°]", "Target: SD [°]", "Target: counts as met within ± [°]", "Target: measured piles"]
    shown = [label for label in goal.labels if label.startswith("Target: ")]
    assert shown == boxes

    def asked():
        page.calibrate.send("Study", START)
        return page.page.study.asked[-1][2]

    goal.enter(boxes[0], 20.0)
    goal.enter(boxes[2], 1.5)
    assert asked() == StudyEdits({}, {"mean": 20.0, "margin": 1.5})
    page.read(picture(27.0))
    page.photograph.press(USE)
    assert asked() == StudyEdits({}, {"margin": 1.5})
    assert [label for label in goal.labels if label.startswith("Target: ")] == [boxes[2]]
    page.photograph.press(REMOVE)
    assert [label for label in goal.labels if label.startswith("Target: ")] == boxes
    assert asked().target == {"mean": 20.0, "margin": 1.5}


def test_a_study_of_another_observable_refuses_before_anything_is_kept(server, folder):
    page = ProjectPage(server, folder)
    study = folder / "lentil_study.toml"
    text = study.read_text()
    assert "angle_of_repose_deg" in text
    study.write_text(text.replace('observable = "angle_of_repose_deg"', 'observable = "bulk_density_kg_m3"'))
    assert load_study(str(study)).targets[0].observable == "bulk_density_kg_m3"
    page.read(picture(27.0))
    assert "a photograph gives angle_of_repose_deg" in page.photograph.press(USE)
    assert not (folder / FOLDER).exists()


@pytest.fixture(scope="module")
def study_folder(tmp_path_factory):
    """Output of a study against a cone of 40 mm, with piles of 38 mm at its optimum."""
    from tests.explorer.command_line import explorer

    folder = tmp_path_factory.mktemp("study")
    done = explorer("measure", "cone_25_30", "--reference-length", 100, "--target", folder / FOLDER)
    assert done.exit_code == 0, done.output
    u = np.linspace(-0.08, 0.08, 41)
    top = np.clip(0.038 - 0.5 * np.abs(u), 0.0, None)
    piles = [PouredPile(name, 6, tuple(u), tuple(top), tuple(0.001 + 0 * u)) for name in ("reference", "optimum")]
    result = reported_studies.result_of_case("planted") | {"piles": [pile.to_dict() for pile in piles]}
    (folder / "result.json").write_text(json.dumps(result))
    return folder


def charts(board):
    return {chart["title"]: chart for chart in json.loads(board_json(board))["charts"]}


def test_a_board_lays_the_photograph_behind_measured_and_poured_outlines(study_folder):
    result = reported_studies.typed(json.loads((study_folder / "result.json").read_text()))
    target = photographed_of(study_folder)
    found = charts(study_board(result, None, "", target))
    assert next(iter(found)) == PHOTOGRAPHED
    spec, caption = found[PHOTOGRAPHED]["spec"], found[PHOTOGRAPHED]["caption"]
    traces = {trace["name"]: trace for trace in spec["data"]}
    assert traces["optimum, n = 6"]["y"] == pytest.approx([1e3 * z for z in result.piles[1].mean])
    assert {"reference ± sd", "optimum ± sd"} <= {name.replace(", n = 6", "") for name in traces}
    measured = traces["cone_25_30.jpg"]
    # The cone is 40 mm high, with flanks of 25° and 30°.
    assert max(measured["y"]) == pytest.approx(40.0, abs=0.5)
    assert max(measured["x"]) - min(measured["x"]) == pytest.approx(
        40.0 * sum(1 / np.tan(np.radians([25, 30]))), rel=0.05
    )
    (image,) = spec["layout"]["images"]
    assert image["source"].startswith("data:image/jpeg;base64,")
    assert image["layer"] == "below"
    # It reaches around the outline, and below the plate.
    assert image["x"] < min(measured["x"])
    assert image["x"] + image["sizex"] > max(measured["x"])
    assert image["y"] > 40.0
    assert image["y"] - image["sizey"] < 0.0
    assert "Behind: cone_25_30.jpg" in caption
    assert f"{1e3 * result.study.profile.mass:g} g were poured" in caption


def test_a_board_has_that_chart_only_where_there_are_both(study_folder, tmp_path):
    result = reported_studies.typed(json.loads((study_folder / "result.json").read_text()))
    target = photographed_of(study_folder)
    assert PHOTOGRAPHED not in charts(study_board(result, None))
    assert PHOTOGRAPHED not in charts(study_board(replace(result, piles=()), None, "", target))
    without_scale = replace(target, result=replace(target.result, piles=(replace(target.result.piles[0], unit="px"),)))
    assert PHOTOGRAPHED not in charts(study_board(result, None, "", without_scale))
    assert photographed_of(tmp_path) is None
    pages = WebPages("test")
    shown = json.loads(pages.page(FolderBoard(study_folder, pages).address).body)
    assert shown["charts"][0]["title"] == PHOTOGRAPHED
