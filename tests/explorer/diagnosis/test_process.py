"""A diagnosis in the background and its panel, with a small program in place of the command line."""

import json
import os
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from doe.measurement.load import load_measurement
from explorer.background.command_process import BackgroundError, CommandStatus
from explorer.background.events import StageProgress
from explorer.diagnosis.follow_up_tables import read_follow_up
from explorer.diagnosis.next_folder import write_next
from explorer.diagnosis.process import RESULT, DiagnoseProcess, Question
from explorer.diagnosis.result import DiagnosisResult
from explorer.priority import BACKGROUND
from explorer.report.content import Word
from explorer.scene.file import material_scene
from explorer.scene.source import material_source
from explorer.viewer.actions import Actions
from explorer.viewer.board.board import board_json
from explorer.viewer.board.diagnosis_board import diagnosis_board
from explorer.viewer.output import pile_recording
from explorer.viewer.panel import Now
from explorer.viewer.study import diagnosis_panel
from explorer.viewer.study.diagnosis_panel import OWN, DiagnosisPanel, fold_beside_narrow
from explorer.viewer.study.process_view import CANCEL, CLEAR, CONTINUE, PAUSE, QUEUE, RESUME, START
from solver import EFFECTS, AssetNotFoundError, with_values
from solver.assets import measurement_folder
from tests.explorer.background.waiting import only_folder, wait_for
from tests.explorer.diagnosed import result_of_case, typed
from tests.explorer.diagnosis.test_next_folder import CHECK, fill
from tests.explorer.viewer.page_session import PageSession, finished, page_context
from tests.explorer.viewer.person import Person
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
    with pytest.raises(BackgroundError, match="no diagnosis of trefoil_2 was stopped"):
        later.resume(Question("trefoil_2"))
    later.resume(Question("trefoil_1"))
    wait_for(lambda: later.status().state != "running")
    assert later.status().state == "finished"
    assert json.loads((only_folder(tmp_path) / "arguments.json").read_text())[-1] == "--resume"
    with pytest.raises(BackgroundError, match="no diagnosis of trefoil_1 was stopped"):
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
            "budget: 20 pours; allowed: at least 58 for 23 directions of effects in 1 fitted conditions",
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
        self.asked, self.now, self.out, self.left = [], CommandStatus("idle"), None, Path("stopped")

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

    def stopped(self, question):
        return self.left

    def resume(self, question):
        self.asked.append(("resume", question))

    def status(self):
        return self.now

    def finished(self):
        return ()


class Room:
    """The panel with a diagnosis that only remembers, and a person at its controls."""

    def __init__(self, server, data, session=None, study=None, measured=None):
        self.process, self.actions = FakeDiagnosis(), Actions()
        page = page_context(server, session, self.actions.post, data, study, self.process)
        self.page = replace(page, project=replace(page.project, measured=measured))
        with server.gui.add_folder("diagnosis") as place:
            self.panel = DiagnosisPanel(self.page)
        self.person = Person(place, lambda: finished(self.actions, self.page.background))

    def show(self, notice=""):
        self.panel.show(Now(None, notice=notice))

    def found(self, content):
        """A finished diagnosis: what its file holds."""
        (self.page.data / "diagnosis.json").write_text(content if isinstance(content, str) else json.dumps(content))
        self.process.out = self.page.data
        self.show()


@pytest.fixture
def room(server, tmp_path):
    return Room(server, tmp_path)


def board(panel):
    """What the board of ``panel`` draws."""
    return board_at(panel, "/diagnosis/page.json")


def test_the_piles_of_an_answer_are_recorded_by_its_command(room, tmp_path, monkeypatch):
    ordered = []
    monkeypatch.setattr(pile_recording, "command_output", lambda command, *_: ordered.append(command))
    room.found(result_of_case("effect"))
    room.person.press(pile_recording.RECORD)
    wait_for(lambda: ordered)
    assert ordered[0][:5] == ["diagnose", "data/made up", "--out", str(tmp_path), "--record"]


def test_the_panel_asks_and_shows(room, tmp_path):
    person, process = room.person, room.process
    assert person.value("Measured data") == "trefoil_2"
    for button in (START, PAUSE, CANCEL, "Delete everything"):
        person.send("Diagnosis", button)
    person.enter("Measured data", OWN)
    person.enter("Folder", "/home/me/my data")
    process.now = CommandStatus("paused")
    for button in (RESUME, CONTINUE):
        person.send("Diagnosis", button)
    mine = Question("/home/me/my data")
    assert process.asked == [("start", Question("trefoil_2")), "pause", "cancel", ("resume", mine), "go on"]
    stages = (StageProgress("base model", 30, 30, "*64* settings"), StageProgress("screening", 5, 20))
    process.now = CommandStatus("running", "screening", 5, 20, 125.0, stages=stages)
    room.show("no such folder")
    assert person.progress == [25.0]
    assert "Known of this stage: 5 of 20 pours, time left 2 min 05 s" in person.text
    assert "no such folder" in person.text
    assert [(one["name"], one["count"], one["mark"], one["found"]) for one in board(room.panel)["stages"]] == [
        ("base model", "30 of 30", "done", "*64* settings"),
        ("screening", "5 of 20", "▶", ""),
    ]
    # Nothing is offered before there is an answer, and what a browser sends all the same is refused.
    assert not person.sees("Piles")
    for command in ("show_piles", "pour_corrected", "calibrate_corrected", "ask_further"):
        room.page.channel.take(json.dumps({"do": command}))
        assert "no finished diagnosis yet" in finished(room.actions, room.page.background)
    process.now = CommandStatus("finished", message="report: /home/me/out/report.html", stages=stages)
    room.found(result_of_case("effect"))
    assert "/home/me/out/report.html" in person.text
    shown = board(room.panel)
    assert shown["banner"]["headline"].startswith(Word.EFFECT_FOUND)
    assert "Residuals before and after" in [chart["title"] for chart in shown["charts"]]


def test_an_uploaded_data_set_can_be_diagnosed(room, tmp_path):
    kept = tmp_path / "uploads" / "mine-0123456789ab"
    shutil.copytree(measurement_folder("trefoil_1"), kept)
    room.show()
    room.person.enter("Measured data", "mine-0123456789ab")
    room.person.press(START)
    assert room.process.asked == [("start", Question(str(kept)))]


def test_data_of_one_s_own_that_are_called_like_shipped_ones_stand_beside_them(room, tmp_path):
    kept = tmp_path / "uploads" / "trefoil_2"
    shutil.copytree(measurement_folder("trefoil_1"), kept)
    room.show()
    offered = room.person.options("Measured data")
    assert len(set(offered)) == len(offered)
    for name, data in (("trefoil_2", "trefoil_2"), ("trefoil_2 (own)", str(kept))):
        room.person.enter("Measured data", name)
        room.person.press(START)
        assert room.process.asked.pop() == ("start", Question(data))


def test_the_project_s_measured_data_are_the_first_choice(server, tmp_path):
    room = Room(server, tmp_path, measured=tmp_path / "lot 7")
    room.show()
    assert room.person.options("Measured data")[0] == room.person.value("Measured data") == "lot 7 (project)"
    room.person.press(START)
    assert room.process.asked == [("start", Question(str(tmp_path / "lot 7")))]


def test_a_folder_is_asked_for_where_it_is_what_is_diagnosed(room):
    room.show()
    assert not room.person.sees("Folder")
    room.person.enter("Measured data", "folder below")
    room.show()
    assert room.person.sees("Folder")


def test_effects_budget_and_queue_are_asked_for_on_the_page(room):
    person = room.person.within("Effects in question, and how much is poured")
    boxes = [name.replace("_", " ") for name in EFFECTS]
    assert person.labels[: len(boxes)] == boxes
    for label in boxes:
        person.enter(label, label in ("air drag", "twisting"))
    person.enter("Pours (0: automatic)", 300)
    room.process.now = CommandStatus("running")
    room.show()
    room.person.press(QUEUE)
    room.person.press(CLEAR)
    assert room.process.asked == [("queue", Question("trefoil_2", ("air_drag", "twisting"), 300)), "clear queue"]
    assert "Waiting: trefoil" in room.person.text
    for label in ("air drag", "twisting"):
        person.enter(label, False)
    assert "none is chosen" in room.person.press(QUEUE)


def test_a_file_that_is_no_diagnosis_is_one_line(room):
    room.found({"schema": DiagnosisResult.SCHEMA, "verdict": "<script>"})
    assert "diagnosis.json: statement: is missing" in room.person.text.replace("\\", "")
    content = result_of_case("effect")
    content["names"] = []
    room.found(content)
    shown = board(room.panel)
    assert shown["title"] == "This result cannot be shown"
    assert shown["charts"] == []


def test_a_diagnosis_of_an_older_version_is_one_line(room):
    room.found('{"schema": 1, "verdict": "no_missing_effect", "gates": []}')
    (line,) = [one for one in room.person.html.split("\n") if "made by an older version of the program" in one]
    assert "allowed: " in line


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


def test_a_pour_of_an_answer_leaves_a_way_back_to_one_s_own(server, tmp_path, monkeypatch):
    session = PageSession(material_source("sunflower_extract"))
    own, other = session.now.scene, material_scene("nine_sphere_seed")
    room = Room(server, tmp_path, session)
    models = iter((other, with_values(other, {"rig.mass": "10g"})))
    monkeypatch.setattr(diagnosis_panel, "answer_piles", lambda result: SimpleNamespace(after=next(models)))
    assert not room.person.sees("Piles")
    session.restart(with_values(own, {"rig.mass": "20g"}), 7)
    mine = session.now.scene
    room.found(result_of_case("effect"))
    assert "your own pour is on the screen" in room.person.press("Back to my pour")
    # One model, then the other in its place: what comes back is the person's own, with its seed and its source.
    for _ in range(2):
        assert room.person.press("Pour it") == ""
    assert session.now.scene != mine
    # The answer may be gone, as when another diagnosis starts; the way back is not.
    (tmp_path / "diagnosis.json").unlink()
    room.show()
    assert not room.person.sees("Corrected model")
    assert room.person.press("Back to my pour") == ""
    assert (session.now.scene, session.now.seed, session.source) == (mine, 7, material_source("sunflower_extract"))
    room.show()
    assert not room.person.sees("Piles")


def test_the_answer_s_buttons_pour_and_calibrate_the_corrected_model(server, tmp_path):
    started = []
    study = SimpleNamespace(start=lambda profile, file: started.append((profile, file)))
    room = Room(server, tmp_path, study=study)
    panel, page, actions, process = room.panel, room.page, room.actions, room.process
    room.found(result_of_case("effect"))
    acts = {one["label"]: one["command"] for one in board(panel)["acts"]}
    assert tuple(acts) == (
        *("Show side by side", "Pour the corrected model", "Calibrate the corrected model"),
        "What else is missing?",
    )

    assert "explorer diagnose" not in board(panel)["banner"]["then"]

    def press_on_the_board(label):
        page.channel.take(json.dumps(acts[label]))
        return actions.carry_out()

    said = press_on_the_board("Calibrate the corrected model")
    assert said.endswith(f"{tmp_path} holds no corrected_study.toml: a diagnosis that is started here writes it")
    (tmp_path / "corrected_study.toml").touch()
    assert press_on_the_board("Calibrate the corrected model") == ""
    assert started == [("quick", tmp_path / "corrected_study.toml")]
    assert press_on_the_board("What else is missing?") == ""
    assert process.asked == [("start", Question("data/made up", given=str(tmp_path)))]
    for label in ("Show side by side", "Pour the corrected model"):
        page.channel.take(json.dumps(acts[label]))
        assert "not there any more" in finished(actions, page.background)  # the data of this made-up result
    room.found(result_of_case("nothing"))
    assert [one["label"] for one in board(panel)["acts"]] == ["Show side by side"]
    assert not room.person.sees("Corrected model")


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
    assert process.stopped(Question("trefoil_1")) is None


def test_an_answer_that_is_given_can_be_checked_on_the_page(room, tmp_path):
    content = result_of_case("effect")
    content["next_experiment"] = [CHECK.to_dict()]
    source = measurement_folder("trefoil_2")
    write_next(tmp_path / "next", source, load_measurement(source), CHECK)
    room.found(content)
    room.show()
    told = room.person.within("Follow-up")
    assert "To check it, measure mass and length spread of single bodies" in told.text
    assert "Filled in: 0 of 4 values." in told.text
    assert "under Follow-up" in board(room.panel)["banner"]["then"]
    assert "mean: none is filled in yet" in room.person.press("Answer with the follow-up")


def test_a_follow_up_is_filled_in_and_answered_with_on_the_page(room, tmp_path):
    content = result_of_case("ambiguous")
    content["order"] |= {"effects": ["rolling_resistance", "twisting"], "given": "results/first"}
    room.found(content)
    assert not room.person.sees("Answer with the follow-up")  # that folder is not there
    source, asked = measurement_folder("trefoil_2"), typed(content).next_experiment[0]
    write_next(tmp_path / "next", source, load_measurement(source), asked)
    room.show()
    told, all_of_it = room.person.within("Follow-up"), len(read_follow_up(tmp_path / "next").cells)
    assert "outlet height 120 mm" in told.text.replace("*", "")
    assert f"Filled in: 0 of {all_of_it} values, 0 of 6 scans." in told.text
    assert "Fill it in, in a table" in told.text
    then = board(room.panel)["banner"]["then"]
    assert "under Follow-up" in then
    assert "explorer diagnose" not in then
    assert "value: none is filled in yet" in room.person.press("Answer with the follow-up")
    # Taken along, filled in elsewhere, and sent back with a scan.
    room.person.press("Take the folder along (.zip)")
    ((name, archive),) = room.person.browser.sent.items()
    assert name == f"{tmp_path.name}_follow_up.zip"
    elsewhere = tmp_path / "elsewhere"
    shutil.unpack_archive(_kept(tmp_path / name, archive), elsewhere)
    fill(elsewhere)
    back = Path(shutil.make_archive(str(tmp_path / "back"), "zip", elsewhere)).read_bytes()
    assert room.person.upload("Upload it filled in", "back.zip", back) == ""
    assert room.person.upload("Add a scan", "monday.ply", b"ply") == ""
    room.show()
    assert f"Filled in: {all_of_it} of {all_of_it} values, 1 of 6 scans." in told.text
    assert "monday" not in room.person.press("Answer with the follow-up")
    assert room.process.asked == []  # a scan that is none is said before anything is started
    next((tmp_path / "next/scans").glob("*_1.ply")).unlink()
    assert room.person.press("Answer with the follow-up") == ""
    question = Question(
        "data/made up", ("rolling_resistance", "twisting"), 900, "results/first", str(tmp_path / "next")
    )
    assert room.process.asked == [("start", question)]
    room.found(result_of_case("effect"))
    assert not room.person.sees("Answer with the follow-up")


def _kept(path, content):
    path.write_bytes(content)
    return path


def test_a_diagnosis_with_a_follow_up_names_it_and_is_none_to_resume(tmp_path):
    process = diagnosis(tmp_path, "time.sleep(60)")
    process.start(Question("trefoil_1", given="results/first", follow_up="results/second/next"))
    wait_for(lambda: process.status().done == 3)
    process.queue(Question("trefoil_1", follow_up="results/third/next"))
    assert process.waiting() == ("trefoil_1, with its follow-up",)
    process.clear_queue()
    process.cancel()
    wait_for(lambda: not process.status().alive)
    folder = only_folder(tmp_path)
    assert folder.name.startswith("trefoil_1-followed-")
    arguments = json.loads((folder / "arguments.json").read_text())
    assert arguments[arguments.index("--follow-up") + 1] == "results/second/next"
    assert arguments[arguments.index("--given") + 1] == "results/first"
    assert process.stopped(Question("trefoil_1")) is None


def test_a_cancelled_diagnosis_is_said_to_go_on_only_where_it_is_the_one_to_be_resumed(room):
    process = room.process
    for folder, said in ((process.left, True), (Path("another"), False)):
        process.now, process.out = CommandStatus("cancelled"), folder
        room.show()
        assert "Cancelled. What was poured is kept" in room.person.text
        assert ("*Resume last* goes on" in room.person.text) == said


@pytest.mark.parametrize(("width", "folded"), [(390, True), (1200, False)])
def test_the_study_panel_makes_room_for_three_piles_in_a_narrow_picture(server, monkeypatch, width, folded):
    page, done = page_context(server), []
    client = SimpleNamespace(camera=SimpleNamespace(image_width=width))
    monkeypatch.setattr(server, "get_clients", lambda: {0: client})
    monkeypatch.setattr(type(page.study_panel), "minimize", lambda panel: done.append(panel))
    fold_beside_narrow(page)
    assert done == [page.study_panel] * folded


def test_own_data_of_a_shipped_name_are_not_resumed_as_the_shipped_ones(tmp_path):
    own = tmp_path / "uploads" / "trefoil_2"
    shutil.copytree(measurement_folder("trefoil_2"), own)
    process = diagnosis(tmp_path)
    process.start(Question(str(own)))
    wait_for(lambda: process.status().state == "finished")
    assert process.out.name.startswith("trefoil_2-own-")
    (process.out / RESULT).unlink()
    assert process.stopped(Question(str(own))) == process.out
    assert process.stopped(Question("trefoil_2")) is None
    assert process.stopped(Question(str(measurement_folder("trefoil_2")))) is None
