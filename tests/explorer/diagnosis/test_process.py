"""A diagnosis in the background and its panel, with a small program in place of the command line."""

import json
import os
import shutil
import sys
from types import SimpleNamespace

import pytest

from explorer.background.command_process import BackgroundError, CommandStatus
from explorer.background.progress import StageProgress
from explorer.diagnosis.process import DiagnoseProcess, Question
from explorer.diagnosis.result import DiagnosisResult
from explorer.errors import CommandError
from explorer.priority import BACKGROUND
from explorer.report.content import Word
from explorer.scene.file import material_scene
from explorer.scene.source import material_source
from explorer.viewer.actions import Actions
from explorer.viewer.board.board import board_json
from explorer.viewer.board.diagnosis_board import diagnosis_board
from explorer.viewer.panel import Now
from explorer.viewer.study.diagnosis_panel import OWN, DiagnosisPanel, fold_beside_narrow
from explorer.viewer.study.process_view import CANCEL, CLEAR, CONTINUE, PAUSE, QUEUE, RESUME, START
from solver import EFFECTS, AssetNotFoundError, with_values
from solver.assets import measurement_folder
from tests.explorer.background.waiting import only_folder, wait_for
from tests.explorer.diagnosed import result_of_case, typed
from tests.explorer.viewer.page_session import PageSession, finished, page_context
from tests.explorer.viewer.study_panel_at_hand import board_at

PROGRAM = """
import json, os, pathlib, sys, time
arguments = sys.argv[1:]
out = pathlib.Path(arguments[arguments.index("--out") + 1])
out.mkdir(parents=True, exist_ok="--resume" in arguments)
(out / "arguments.json").write_text(json.dumps(arguments))
(out / "niceness").write_text(str(os.nice(0)))
with (out / "progress.jsonl").open("a") as progress:
    for left in (2, 1, 0):
        line = "base model: 3 settings" if left == 0 else None
        event = {"time": 1, "stage": "base model", "done": 3 - left, "planned": 3, "eta_s": left, "line": line}
        progress.write(json.dumps(event) + "\\n")
        progress.flush()
BEHAVIOUR
(out / "diagnosis.json").write_text('{"verdict": "no_missing_effect"}')
"""


def diagnosis(tmp_path, behaviour=""):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.replace("BEHAVIOUR", behaviour))
    return DiagnoseProcess(tmp_path / "out", tmp_path / "runs.sqlite", (sys.executable, str(program)))


def test_a_diagnosis_runs_to_its_end_at_lower_priority(tmp_path):
    process = diagnosis(tmp_path)
    assert process.status() == CommandStatus("idle")
    assert process.out is None
    assert process.finished() == ()
    process.start(Question("trefoil_1"))
    wait_for(lambda: process.status().state != "running")
    status = process.status()
    assert (status.state, status.stage, status.done, status.planned) == ("finished", "base model", 3, 3)
    assert status.lines == ("base model: 3 settings",)
    folder = only_folder(tmp_path)
    assert status.message == f"report: {folder}/report.html"
    assert process.out == folder
    assert process.finished() == (folder,)
    data = str(measurement_folder("trefoil_1").absolute())
    arguments = json.loads((folder / "arguments.json").read_text())
    assert arguments == ["diagnose", data, "--out", str(folder), "--apply", "--store", str(tmp_path / "runs.sqlite")]
    assert folder.name.startswith("trefoil_1-")
    assert int((folder / "niceness").read_text()) == min(19, os.nice(0) + BACKGROUND)


def test_cancel_and_resume_also_from_a_later_page(tmp_path):
    process = diagnosis(tmp_path, "time.sleep(0 if '--resume' in arguments else 60)")
    process.start(Question("trefoil_1"))
    wait_for(lambda: process.status().done == 3)
    with pytest.raises(BackgroundError, match="a diagnosis is running already"):
        process.start(Question("trefoil_1"))
    with pytest.raises(BackgroundError, match="a diagnosis is running already"):
        process.resume(Question("trefoil_1"))
    process.cancel()
    wait_for(lambda: process.status().state != "running")
    assert process.status().state == "cancelled"
    assert process.finished() == ()
    later = diagnosis(tmp_path)
    with pytest.raises(BackgroundError, match="no diagnosis of trefoil_2 has been stopped"):
        later.resume(Question("trefoil_2"))
    later.resume(Question("trefoil_1"))
    wait_for(lambda: later.status().state != "running")
    assert later.status().state == "finished"
    assert json.loads((only_folder(tmp_path) / "arguments.json").read_text())[-1] == "--resume"
    with pytest.raises(BackgroundError, match="no diagnosis of trefoil_1 has been stopped"):
        later.resume(Question("trefoil_1"))


def test_a_diagnosis_that_fails_says_why(tmp_path):
    process = diagnosis(tmp_path, "sys.exit('error: condition fit: rate: -1')")
    process.start(Question(str(measurement_folder("trefoil_2"))))
    wait_for(lambda: process.status().state != "running")
    assert process.status().state == "failed"
    assert process.status().message == "diagnose ended with exit code 1: error: condition fit: rate: -1"


def test_data_that_are_not_there_are_refused_before_a_start(tmp_path):
    process = diagnosis(tmp_path)
    with pytest.raises(AssetNotFoundError, match=r"shipped: .*trefoil_1"):
        process.start(Question("no such data"))
    with pytest.raises(BackgroundError, match="choose measured data"):
        process.start(Question("  "))
    assert process.status().state == "idle"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("question", "trouble"),
    [
        (Question("trefoil_1", ("drag",)), "effects: 'drag' is not one of rolling_resistance"),
        (
            Question("trefoil_1", budget=20),
            "budget: 20 pours; 23 directions of effects in 1 fitted conditions take at least 58",
        ),
    ],
)
def test_a_question_that_cannot_be_asked_is_refused(tmp_path, question, trouble):
    process = diagnosis(tmp_path)
    for ask in (process.start, process.queue, process.resume):
        with pytest.raises(ValueError, match=trouble):
            ask(question)
    assert not (tmp_path / "out").exists()


def test_a_queued_diagnosis_starts_after_the_one_before_with_its_own_effects(tmp_path):
    go = tmp_path / "go"
    # The first one ends when the others have been asked for, however slow that is.
    wait = f"while '--budget' not in arguments and not os.path.exists({str(go)!r}): time.sleep(0.02)"
    process = diagnosis(tmp_path, wait)
    process.queue(Question("trefoil_1"))  # nothing runs: at once
    process.queue(Question("trefoil_2", ("air_drag", "twisting"), 300))
    process.queue(Question("trefoil_1", budget=190))
    assert process.waiting() == ("trefoil_2, 2 effects, about 300 pours", "trefoil_1, about 190 pours")
    go.touch()
    wait_for(
        lambda: process.status().state == "finished" and not process.waiting() and len(process.finished()) == 3, 120.0
    )
    asked = [json.loads((folder / "arguments.json").read_text()) for folder in reversed(process.finished())]
    assert [one[one.index("--apply") + 1 : one.index("--store")] for one in asked] == [
        [],
        ["--effects", "air_drag,twisting", "--budget", "300"],
        ["--budget", "190"],
    ]
    process.queue(Question("trefoil_1"))
    process.queue(Question("trefoil_2"))
    process.clear_queue()
    assert process.waiting() == ()
    process.close()


class FakeDiagnosis:
    """Keeps what it was asked; its status and its folder are what the test says."""

    def __init__(self):
        self.asked, self.now, self.out = [], CommandStatus("idle"), None

    def start(self, question):
        self.asked.append(("start", question))

    def queue(self, question):
        self.asked.append(("queue", question))

    def clear_queue(self):
        self.asked.append("clear queue")

    def waiting(self):
        return ("trefoil_1, 2 effects",)

    def cancel(self):
        self.asked.append("cancel")

    def pause(self):
        self.asked.append("pause")

    def go_on(self):
        self.asked.append("go on")

    def resumable(self, question):
        return True

    def resume(self, question):
        self.asked.append(("resume", question))

    def status(self):
        return self.now

    def finished(self):
        return ()


def press(panel, button):
    click = type("Event", (), {"client_id": 0, "target": type("Group", (), {"value": button})})
    for callback in panel._view._buttons._impl.update_cb:
        callback(click)


def board(panel):
    """What the board of ``panel`` draws."""
    return board_at(panel, "/diagnosis/page.json")


def test_the_panel_asks_and_shows(server, tmp_path):
    process, actions = FakeDiagnosis(), Actions()
    panel = DiagnosisPanel(page_context(server, post=actions.post, data=tmp_path, diagnosis=process))
    panel._data.value = "trefoil_2"
    for button in (START, PAUSE, CANCEL, "Delete everything"):
        press(panel, button)
    actions.carry_out()
    panel._data.value = OWN
    panel._folder.value = "/home/me/my data"
    process.now = CommandStatus("paused")
    press(panel, RESUME)
    press(panel, CONTINUE)
    actions.carry_out()
    mine = Question("/home/me/my data")
    assert process.asked == [("start", Question("trefoil_2")), "pause", "cancel", ("resume", mine), "go on"]
    stages = (StageProgress("base model", 30, 30, "*64* settings"), StageProgress("screening", 5, 20))
    process.now = CommandStatus("running", "screening", 5, 20, 125.0, stages=stages)
    panel.show(Now(None, notice="no such folder"))
    assert panel._view._bar.value == 25.0
    text = panel._view._text.content
    assert "Known of this stage: 5 of 20 pours, time left 2 min 05 s" in text
    assert "no such folder" in text
    assert [(one["name"], one["count"], one["mark"], one["found"]) for one in board(panel)["stages"]] == [
        ("base model", "30 of 30", "done", "*64* settings"),
        ("screening", "5 of 20", "▶", ""),
    ]
    for act in (panel._show_piles, panel._pour_corrected, panel._calibrate_corrected, panel._record_order):
        with pytest.raises(CommandError, match="no finished diagnosis yet"):
            act()
    process.now = CommandStatus("finished", message="report: /home/me/out/report.html")
    process.out = tmp_path
    (tmp_path / "diagnosis.json").write_text(json.dumps(result_of_case("effect")))
    panel.show(Now(None))
    assert "/home/me/out/report.html" in panel._view._text.content
    assert panel._record_order() == (tmp_path, ["diagnose", "data/made up"])
    shown = board(panel)
    assert shown["banner"]["headline"].startswith(Word.EFFECT_FOUND)
    assert "Residuals before and after" in [chart["title"] for chart in shown["charts"]]


def test_an_uploaded_data_set_can_be_diagnosed(server, tmp_path):
    process, actions = FakeDiagnosis(), Actions()
    panel = DiagnosisPanel(page_context(server, post=actions.post, data=tmp_path, diagnosis=process))
    kept = tmp_path / "uploads" / "mine-0123456789ab"
    shutil.copytree(measurement_folder("trefoil_1"), kept)
    panel.show(Now(None))
    assert "mine-0123456789ab" in panel._data.options
    panel._data.value = "mine-0123456789ab"
    press(panel, START)
    actions.carry_out()
    assert process.asked == [("start", Question(str(kept)))]


def test_effects_budget_and_queue_are_asked_for_on_the_page(server, tmp_path):
    process, actions = FakeDiagnosis(), Actions()
    panel = DiagnosisPanel(page_context(server, post=actions.post, data=tmp_path, diagnosis=process))
    boxes = panel._candidates._boxes
    assert tuple(boxes) == tuple(EFFECTS)
    for name in EFFECTS:
        boxes[name].value = name in ("air_drag", "twisting")
    panel._candidates._pours.value = 300
    press(panel, QUEUE)
    press(panel, CLEAR)
    actions.carry_out()
    assert process.asked == [("queue", Question("trefoil_2", ("air_drag", "twisting"), 300)), "clear queue"]
    panel.show(Now(None))
    assert "Waiting: trefoil" in panel._view._text.content
    for box in boxes.values():
        box.value = False
    with pytest.raises(ValueError, match="none is chosen"):
        panel._question()


def test_a_file_that_is_no_diagnosis_is_one_line(server, tmp_path):
    process, actions = FakeDiagnosis(), Actions()
    panel = DiagnosisPanel(page_context(server, post=actions.post, data=tmp_path, diagnosis=process))
    (tmp_path / "diagnosis.json").write_text(json.dumps({"schema": DiagnosisResult.SCHEMA, "verdict": "<script>"}))
    process.out = tmp_path
    panel.show(Now(None))
    assert panel._trouble.content.endswith("diagnosis.json: statement: is missing")
    content = result_of_case("effect")
    content["names"] = []
    (tmp_path / "diagnosis.json").write_text(json.dumps(content))
    panel.show(Now(None))
    shown = board(panel)
    assert shown["title"] == "This result cannot be shown"
    assert shown["charts"] == []


def test_a_diagnosis_of_an_older_version_is_one_line(server, tmp_path):
    process, actions = FakeDiagnosis(), Actions()
    panel = DiagnosisPanel(page_context(server, post=actions.post, data=tmp_path, diagnosis=process))
    (tmp_path / "diagnosis.json").write_text('{"schema": 1, "verdict": "no_missing_effect", "gates": []}')
    process.out = tmp_path
    panel.show(Now(None))
    assert "made by an older version of the program" in panel._trouble.content
    assert "\n" not in panel._trouble.content


def test_the_answer_holds_probabilities_and_errors_before_after_and_by_noise_alone():
    for case, role in (("effect", "holdout"), ("no holdout", "fit")):
        content = result_of_case(case)
        shown = json.loads(board_json(diagnosis_board(typed(content), None)))
        answers, errors = shown["tables"]
        first = content["effects"][0]
        assert (first["name"], content["verdict"]) == ("adhesion_sjkr", "effect:adhesion_sjkr")
        assert answers["rows"][0] == ["adhesion sjkr", f"{100.0 * first['probability']:.1f} %"]
        assert errors["title"] == f"Error on {'held-out' if role == 'holdout' else 'fitted'} data"
        assert errors["header"] == ["Observable", "Before", "After", "Noise floor"]
        assert len(errors["rows"]) == len(content["error"][role])


def test_a_pour_of_an_answer_leaves_a_way_back_to_one_s_own(server):
    session = PageSession(material_source("sunflower_extract"))
    own, other = session.now.scene, material_scene("nine_sphere_seed")
    panel = DiagnosisPanel(page_context(server, session, diagnosis=FakeDiagnosis()))
    with pytest.raises(CommandError, match="your own pour is on the screen"):
        panel._back()
    session.restart(with_values(own, {"rig.mass": "20g"}), 7)
    mine = session.now.scene
    # One model, then the other in its place: what comes back is the person's own, with its seed and its source.
    panel._pour(other)
    panel._pour(with_values(other, {"rig.mass": "10g"}))
    assert session.now.scene != mine
    # The answer may be gone, as when another diagnosis starts; the way back is not.
    panel._offer_piles()
    assert panel._piles.visible
    panel._back()
    assert (session.now.scene, session.now.seed, session.source) == (mine, 7, material_source("sunflower_extract"))
    panel._offer_piles()
    assert not panel._piles.visible


def test_the_answer_s_buttons_pour_and_calibrate_the_corrected_model(server, tmp_path):
    process, actions, started = FakeDiagnosis(), Actions(), []
    study = SimpleNamespace(start=lambda profile, file: started.append((profile, file)))
    page = page_context(server, post=actions.post, data=tmp_path, study=study, diagnosis=process)
    panel = DiagnosisPanel(page)
    process.out = tmp_path
    (tmp_path / "diagnosis.json").write_text(json.dumps(result_of_case("effect")))
    panel.show(Now(None))
    acts = {one["label"]: one["command"] for one in board(panel)["acts"]}
    assert tuple(acts) == (
        *("Show side by side", "Pour the corrected model", "Calibrate the corrected model"),
        "What else is missing?",
    )

    def press_on_the_board(label):
        page.channel.take(json.dumps(acts[label]))
        return actions.carry_out()

    said = press_on_the_board("Calibrate the corrected model")
    assert said.endswith(f"{tmp_path} holds no corrected_study.toml: run it with --apply")
    (tmp_path / "corrected_study.toml").touch()
    assert press_on_the_board("Calibrate the corrected model") == ""
    assert started == [("quick", tmp_path / "corrected_study.toml")]
    assert press_on_the_board("What else is missing?") == ""
    assert process.asked == [("start", Question("data/made up", given=str(tmp_path)))]
    for label in ("Show side by side", "Pour the corrected model"):
        page.channel.take(json.dumps(acts[label]))
        assert "not there any more" in finished(actions, page.background)  # the data of this made-up result
    (tmp_path / "diagnosis.json").write_text(json.dumps(result_of_case("nothing")))
    panel.show(Now(None))
    assert [one["label"] for one in board(panel)["acts"]] == ["Show side by side"]


def test_a_diagnosis_that_goes_on_from_another_names_it_and_is_none_to_resume(tmp_path):
    process = diagnosis(tmp_path, "time.sleep(60)")
    process.start(Question("trefoil_1", given="results/first"))
    wait_for(lambda: process.status().done == 3)
    process.cancel()
    wait_for(lambda: not process.status().alive)
    folder = only_folder(tmp_path)
    arguments = json.loads((folder / "arguments.json").read_text())
    assert arguments[arguments.index("--given") + 1] == "results/first"
    # Resumed by its data's name it would be another question.
    assert not process.resumable(Question("trefoil_1"))


@pytest.mark.parametrize(("width", "folded"), [(390, True), (1200, False)])
def test_the_study_panel_makes_room_for_three_piles_in_a_narrow_picture(server, monkeypatch, width, folded):
    page, done = page_context(server), []
    client = SimpleNamespace(camera=SimpleNamespace(image_width=width))
    monkeypatch.setattr(server, "get_clients", lambda: {0: client})
    monkeypatch.setattr(type(page.study_panel), "minimize", lambda panel: done.append(panel))
    fold_beside_narrow(page)
    assert done == [page.study_panel] * folded
