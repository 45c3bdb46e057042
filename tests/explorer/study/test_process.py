"""The child process of a study, with a small program in place of the command line."""

import json
import os
import shutil
import sys
import time

import pytest

from doe.studies.study import load_study
from explorer.background import command_process
from explorer.background.command_process import HERE, BackgroundError, CommandStatus, PourPlace, advanced
from explorer.background.events import ProgressEvent, StageProgress, failures, given_up, with_event
from explorer.background.orders import MOST_WAITING
from explorer.photograph.target import load_target, remove_target
from explorer.priority import BACKGROUND
from explorer.study import process as study_process
from explorer.study.edit import StudyEdits
from explorer.study.process import CalibrationProcess
from solver import asset_path
from tests.explorer.background.waiting import only_folder, wait_for
from tests.explorer.command_line import explorer
from tests.explorer.viewer.study_panel_at_hand import study_with_own_profiles

PROGRAM = """
import json, pathlib, sys, time
arguments = sys.argv[1:]
out = pathlib.Path(arguments[arguments.index("--out") + 1])
out.mkdir(parents=True, exist_ok="--resume" in arguments)
(out / "arguments.json").write_text(json.dumps(arguments))
(out / "niceness").write_text(str(__import__("os").nice(0)))
with (out / "progress.jsonl").open("a") as progress:
    for k in range(1, 4):
        line = "screening: done" if k == 3 else None
        event = {"time": k, "stage": "screening", "done": k, "planned": 3, "eta_s": 3.0 - k, "line": line}
        progress.write(json.dumps(event) + "\\n")
        progress.flush()
BEHAVIOUR
"""


def study(tmp_path, behaviour=""):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.replace("BEHAVIOUR", behaviour))
    file = tmp_path / "my study.toml"
    if not file.exists():
        shutil.copy(asset_path("studies", "sunflower_extract"), file)
    return CalibrationProcess(file, tmp_path / "out", tmp_path / "runs.sqlite", (sys.executable, str(program)))


def test_a_study_runs_to_its_end_at_lower_priority(tmp_path):
    process = study(tmp_path)
    assert process.status() == CommandStatus("idle")
    process.start("quick")
    wait_for(lambda: process.status().state != "running")
    status = process.status()
    assert (status.state, status.stage, status.done, status.planned) == ("finished", "screening", 3, 3)
    assert status.lines == ("screening: done",)
    assert status.message.endswith("report.html")
    folder = only_folder(tmp_path)
    arguments = json.loads((folder / "arguments.json").read_text())
    expected = ["calibrate", "--headless", "--study", str(tmp_path / "my study.toml"), "--profile", "quick"]
    assert arguments == [*expected, "--out", str(folder), "--store", str(tmp_path / "runs.sqlite")]
    assert int((folder / "niceness").read_text()) == min(19, os.nice(0) + BACKGROUND)


def test_cancel_and_resume(tmp_path):
    process = study(tmp_path, "time.sleep(0 if '--resume' in arguments else 60)")
    process.start("standard")
    wait_for(lambda: process.status().done == 3)
    assert process.status().state == "running"
    with pytest.raises(BackgroundError, match="already"):
        process.start("quick")
    process.cancel()
    wait_for(lambda: process.status().state != "running")
    assert (process.status().state, process.status().message) == ("cancelled", "")
    process.resume()
    wait_for(lambda: process.status().state != "running")
    assert process.status().state == "finished"
    assert json.loads((only_folder(tmp_path) / "arguments.json").read_text())[-1] == "--resume"


def test_a_study_that_ignores_cancel_is_ended(tmp_path, monkeypatch):
    monkeypatch.setattr("explorer.background.command_process.CANCEL_WAIT", 0.2)
    deaf = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); (out / 'deaf').touch(); time.sleep(60)"
    process = study(tmp_path, deaf)
    process.start("quick")
    wait_for(lambda: process.status().done == 3 and (only_folder(tmp_path) / "deaf").exists())
    process.close()
    assert process.status().state == "cancelled"


def test_a_study_that_fails_says_why(tmp_path):
    process = study(tmp_path, "sys.exit('error: body.seed: no such body')")
    process.start("quick")
    wait_for(lambda: process.status().state != "running")
    status = process.status()
    assert status.state == "failed"
    assert status.message == "calibrate ended with exit code 1: error: body.seed: no such body"


def test_a_study_that_was_killed_says_so_and_not_its_last_line_as_the_reason(tmp_path):
    process = study(tmp_path, "print('scan: 3 of 90 runs', flush=True); import signal; signal.raise_signal(9)")
    process.start("quick")
    wait_for(lambda: process.status().state != "running")
    killed = "calibrate was ended from outside, or for want of memory (signal 9); its last line: scan: 3 of 90 runs"
    assert process.status().message == killed


def test_a_study_whose_output_was_taken_away_fails_in_one_line(tmp_path):
    process = study(tmp_path, "pathlib.Path(f'{out}.log').unlink(); sys.exit(1)")
    process.start("quick")
    wait_for(lambda: process.status().state != "running")
    log = f"{process.out}.log"
    assert process.status().message == f"calibrate ended with exit code 1: {log}: No such file or directory"


def test_above_the_error_limit_is_a_finished_study(tmp_path):
    process = study(tmp_path, "sys.exit(3)")
    process.start("quick")
    wait_for(lambda: process.status().state != "running")
    assert process.status().state == "finished"
    assert process.status().message.startswith("above the error limit")


def test_what_cannot_be_started_or_resumed(tmp_path):
    process = study(tmp_path)
    with pytest.raises(ValueError, match=r"my study\.toml: profile: 'fast' is not one of quick, standard, full$"):
        process.start("fast")
    with pytest.raises(BackgroundError, match="nothing to resume"):
        process.resume()
    process.cancel()
    assert process.status().state == "idle"


def test_profiles_are_those_of_the_study_file_whatever_their_names(tmp_path):
    study_with_own_profiles(tmp_path)
    process = study(tmp_path, "time.sleep(0 if '--resume' in arguments else 60)")
    with pytest.raises(ValueError, match=r"'quick' is not one of first look, thesis-2, fine$"):
        process.start("quick")
    process.start("first look")
    wait_for(lambda: process.status().done == 3)
    process.queue("thesis-2", StudyEdits(target={"mean": 26.0}))
    assert process.waiting() == ("thesis-2, changed",)
    process.clear_queue()
    process.close()
    later = study(tmp_path, "pass")
    later.resume()
    wait_for(lambda: later.status().state == "finished")
    arguments = json.loads((only_folder(tmp_path) / "arguments.json").read_text())
    assert arguments[arguments.index("--profile") + 1] == "first look"


def test_a_later_page_resumes_the_newest_study_that_has_no_result(tmp_path):
    folder = tmp_path / "out"
    named = ("my study-quick-20260102-101010", "my study-full-20260101-101010", "my study-full-20260103-101010")
    for name in (*named, "my study-full-late", "another-quick-20270101-000000"):
        (folder / name).mkdir(parents=True)
    (folder / named[2] / "result.json").touch()  # the newest is finished
    process = study(tmp_path)
    process.resume()
    wait_for(lambda: process.status().state != "running")
    arguments = json.loads((folder / named[0] / "arguments.json").read_text())
    assert arguments[arguments.index("--profile") + 1] == "quick"
    assert arguments[-1] == "--resume"


def test_a_study_that_has_finished_is_not_resumed_but_the_one_that_was_stopped_before_it(tmp_path):
    stopped = tmp_path / "out" / "my study-full-20260101-101010"
    stopped.mkdir(parents=True)
    process = study(tmp_path, "(out / 'result.json').touch()")
    process.start("quick")
    wait_for(lambda: process.status().state == "finished")
    assert process.resumable()
    process.resume()
    wait_for(lambda: process.status().state == "finished")
    arguments = json.loads((stopped / "arguments.json").read_text())
    assert arguments[arguments.index("--profile") + 1] == "full"
    assert not process.resumable()
    with pytest.raises(BackgroundError, match="nothing to resume"):
        process.resume()


def test_a_study_that_another_page_runs_is_not_resumed(tmp_path):
    first, second = study(tmp_path, "time.sleep(60)"), study(tmp_path, "time.sleep(60)")
    first.start("quick")
    wait_for(lambda: first.status().done == 3)
    with pytest.raises(BackgroundError, match="another page's command is running"):
        second.resume()
    # The folder of the other page's study is not taken for its own.
    assert second.out is None
    first.close()


@pytest.mark.parametrize("line", [b"", b"{", b"[]", b'{"stage": "x"}', b"\xff\xfe\n", b"3"])
def test_a_line_that_is_no_event_changes_nothing(line):
    status = CommandStatus("running", "ascent", 2, 9)
    assert advanced(status, line) == status


def running(process):
    return process.status().done == 3 and process.status().state == "running"


def ticks(folder):
    return len((folder / "ticks").read_text())


# A worker of the command writes: what stands still has to be all of it.
TICKING = """
import os, subprocess
worker = "import os, sys, time; parent = os.getppid()\\nwhile os.getppid() == parent:\\n"
worker += " open(sys.argv[1], 'a').write('.'); time.sleep(0.01)"
subprocess.Popen([sys.executable, "-c", worker, str(out / "ticks")]).wait()
"""


def test_a_paused_study_stands_still_and_goes_on(tmp_path):
    process = study(tmp_path, TICKING)
    process.start("quick")
    wait_for(lambda: (process.out / "ticks").exists())
    process.pause()
    assert process.status().state == "paused"
    assert process.status().alive
    folder = only_folder(tmp_path)
    time.sleep(0.1)
    still = ticks(folder)
    time.sleep(0.3)
    assert ticks(folder) == still
    with pytest.raises(BackgroundError, match="already"):
        process.start("quick")
    process.go_on()
    assert process.status().state == "running"
    wait_for(lambda: ticks(folder) > still)
    process.pause()
    process.cancel()  # a study that stands still could not hear it
    wait_for(lambda: not process.status().alive)
    assert process.status().state == "cancelled"


def test_a_page_that_closes_ends_a_paused_study(tmp_path):
    process = study(tmp_path, "time.sleep(60)")
    process.start("quick")
    wait_for(lambda: running(process))
    process.pause()
    process.close()
    assert process.status().state == "cancelled"


def test_a_worker_that_lingers_does_not_stand_in_the_way_of_going_on(tmp_path, monkeypatch):
    # A busy machine lets it linger for longer.
    monkeypatch.setattr(command_process, "LOCK_WAIT", 60.0)
    lingering = "import subprocess; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(0.5)'])"
    process = study(tmp_path, lingering)
    process.start("quick")
    wait_for(lambda: not process.status().alive)
    process._process.resume(process.out, process._arguments(process.out))
    wait_for(lambda: not process.status().alive)
    assert process.status().state == "finished"


def test_a_queued_study_starts_after_the_one_before(tmp_path):
    process = study(tmp_path, "time.sleep(60 if 'quick' in arguments else 0)")
    process.queue("quick")  # nothing runs: at once
    assert process.waiting() == ()
    wait_for(lambda: running(process))
    process.queue("standard")
    process.queue("full")
    assert process.waiting() == ("standard", "full")
    process.cancel()
    wait_for(lambda: process.status().state == "cancelled")
    assert process.waiting() == ("standard", "full")  # who cancels wants quiet
    process.start("standard")
    wait_for(lambda: process.status().state == "finished" and process.waiting() == () and "-full-" in process.out.name)
    names = sorted(folder.name.split("-")[1] for folder in (tmp_path / "out").glob("*/"))
    assert names == ["full", "quick", "standard", "standard"]


def test_a_failed_study_does_not_hold_up_the_queue_and_it_can_be_cleared(tmp_path):
    process = study(tmp_path, "time.sleep(0.3); sys.exit(1 if 'quick' in arguments else 0)")
    process.start("quick")
    process.queue("standard")
    process.queue("full")
    process.clear_queue()
    assert process.waiting() == ()
    process.queue("standard")
    wait_for(lambda: process.status().state == "finished")
    assert "-standard-" in process.out.name


def test_a_line_that_is_full_takes_no_more(tmp_path):
    process = study(tmp_path, "time.sleep(60)")
    process.start("quick")
    for _ in range(MOST_WAITING):
        process.queue("standard")
    with pytest.raises(BackgroundError, match="already waiting"):
        process.queue("full")
    assert process.waiting() == ("standard",) * MOST_WAITING
    process.close()


def test_an_order_that_cannot_begin_waits_on_and_says_so(tmp_path, monkeypatch):
    process = study(tmp_path, "time.sleep(0.3)")
    process.start("quick")
    process.queue("standard")

    def refused(folder, stem):
        raise OSError("No space left on device")

    with monkeypatch.context() as full:
        full.setattr(study_process, "new_folder", refused)
        wait_for(lambda: process.status().state == "failed")
    assert process.waiting() == ("standard",)
    # Whoever asks first, everybody is told, and that what waits needs another start.
    for _ in range(2):
        assert process.status().state == "failed"
        assert process.status().message == (
            "the next one cannot start: No space left on device; the queue waits for another start"
        )
    with pytest.raises(BackgroundError, match="nothing to try again"):
        process.retry()
    process.start("quick")
    assert process.status().state == "running"
    wait_for(lambda: process.status().state == "finished" and process.waiting() == ())
    assert "-standard-" in process.out.name


def test_an_order_that_could_not_begin_is_told_no_more_when_the_queue_is_cleared(tmp_path, monkeypatch):
    process = study(tmp_path, "time.sleep(0.3)")
    process.start("quick")
    process.queue("standard")
    monkeypatch.setattr(study_process, "new_folder", lambda folder, stem: (_ for _ in ()).throw(OSError("full")))
    wait_for(lambda: process.status().state == "failed")
    process.clear_queue()
    assert process.status().state == "finished"


def test_a_changed_study_has_its_own_file_in_its_folder(tmp_path):
    process = shipped(tmp_path)
    edits = StudyEdits({"X4": {"low": 30e6}}, {"mean": 26.0})
    process.start("quick", edits)
    wait_for(lambda: process.status().state == "finished")
    folder = only_folder(tmp_path)
    file = folder / "sunflower_extract_changed.toml"
    arguments = json.loads((folder / "arguments.json").read_text())
    assert arguments[arguments.index("--study") + 1] == str(file)
    changed = load_study(str(file))
    assert (changed.factors[3].low, changed.targets[0].mean) == (30e6, 26.0)
    # found again by a later page, file and all
    later = shipped(tmp_path)
    later.resume()
    wait_for(lambda: later.status().state == "finished")
    arguments = json.loads((folder / "arguments.json").read_text())
    assert arguments[arguments.index("--study") + 1] == str(file)


def test_studies_pour_on_the_scheduler_of_the_server_until_another_place_is_chosen(tmp_path):
    process, place = study(tmp_path), PourPlace("tcp://127.0.0.1:9")
    process._place = place
    process.start("quick")
    wait_for(lambda: process.status().state == "finished")
    asked = only_folder(tmp_path) / "arguments.json"
    assert json.loads(asked.read_text())[-2:] == ["--scheduler", "tcp://127.0.0.1:9"]
    with pytest.raises(BackgroundError, match=r"'tcp://evil:1' is not one of tcp://127.0.0.1:9, this machine$"):
        place.choose("tcp://evil:1")
    place.choose(HERE)
    process.resume()
    wait_for(lambda: process.status().state == "finished")
    assert "--scheduler" not in json.loads(asked.read_text())


def test_a_change_that_is_not_allowed_starts_nothing(tmp_path):
    process = shipped(tmp_path)
    with pytest.raises(ValueError, match=r"^changed study: X4 .*low 9e\+07 is not below high 7\.05e\+07$"):
        process.start("quick", StudyEdits({"X4": {"low": 90e6}}))
    assert not (tmp_path / "out").exists()
    assert process.status().state == "idle"


def test_photographs_that_are_the_target_go_with_the_study_that_was_ordered(tmp_path):
    target = tmp_path / "target"
    assert explorer("measure", "cone_25_30", "--reference-length", 100, "--target", target).exit_code == 0
    shutil.copy(asset_path("studies", "sunflower_extract"), tmp_path / "mine.toml")
    program = tmp_path / "program.py"
    # The folder is there before the command, with the photographs in it.
    text = PROGRAM.replace('exist_ok="--resume" in arguments', "exist_ok=True")
    program.write_text(text.replace("BEHAVIOUR", "time.sleep(0 if '--resume' in arguments else 60)"))

    def page():
        command = (sys.executable, str(program))
        return CalibrationProcess(tmp_path / "mine.toml", tmp_path / "out", tmp_path / "runs", command, target)

    process = page()
    process.start("quick")
    wait_for(lambda: process.status().done == 3)
    kept = load_target(target)
    remove_target(target)  # of no concern to what was ordered
    folder = only_folder(tmp_path)
    arguments = json.loads((folder / "arguments.json").read_text())
    assert arguments[arguments.index("--target") + 1] == str(folder / "target")
    assert load_target(folder / "target").result == kept.result
    process.close()
    later = page()  # the page was started again
    later.resume()
    wait_for(lambda: later.status().state == "finished")
    arguments = json.loads((folder / "arguments.json").read_text())
    assert ("--target" in arguments, arguments[-1]) == (True, "--resume")


def test_a_damaged_target_is_told_before_a_study_starts(tmp_path):
    (tmp_path / "photograph.json").write_text("{}")
    file = asset_path("studies", "sunflower_extract")
    process = CalibrationProcess(file, tmp_path / "out", target=tmp_path)
    with pytest.raises(ValueError, match=r"photograph\.json"):
        process.start("quick")
    assert not (tmp_path / "out").exists()


def shipped(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.replace("BEHAVIOUR", "").replace('exist_ok="--resume" in arguments', "exist_ok=True"))
    return CalibrationProcess(
        asset_path("studies", "sunflower_extract"),
        tmp_path / "out",
        tmp_path / "runs.sqlite",
        (sys.executable, str(program)),
    )


FAILING = """
with (out / "progress.jsonl").open("a") as progress:
    for attempt in range(6 if "--tries" in arguments else 3):
        run = {"stage": "screening", "label": "row 2", "replicate": 0, "attempt": attempt, "seed": 10 + attempt,
               "outcome": "jammed", "message": "4 g stay", "valid": False}
        if attempt == 5:
            run |= {"outcome": "at_rest", "message": "", "valid": True}
        event = {"time": 1, "stage": "screening", "done": 3, "planned": 3, "eta_s": None, "line": None,
                 "stages": {"pilot": [0, 5], "screening": [3, 3]}, "run": run}
        progress.write(json.dumps(event) + "\\n")
"""


def test_a_retry_gives_more_seeds_to_replicates_without_a_valid_run(tmp_path):
    process = study(tmp_path, FAILING.replace("\\\\n", "\\n"))
    process.start("quick")
    wait_for(lambda: process.status().state == "finished")
    status = process.status()
    assert [stage.name for stage in status.stages] == ["screening", "pilot"]
    found = failures(status.tried)
    assert [(one.run.seed, one.replaced_by and one.replaced_by.seed) for one in found] == [
        (12, None),
        (11, 12),
        (10, 11),
    ]
    assert [run.seed for run in given_up(status.tried, 3)] == [12]
    process.retry()
    wait_for(lambda: process.status().state == "finished")
    arguments = json.loads((only_folder(tmp_path) / "arguments.json").read_text())
    assert arguments[-3:] == ["--tries", "6", "--resume"]
    last = failures(process.status().tried)[0]
    assert (last.run.seed, last.replaced_by.outcome) == (14, "at_rest")
    with pytest.raises(BackgroundError, match="nothing to try again"):
        process.retry()


def test_a_finding_is_kept_with_its_stage():
    counts = {"scan": (4, 4), "ascent": (0, 16)}
    stages = with_event((), ProgressEvent(stage="scan", done=9, planned=20, line="first", stages=counts))
    assert stages == (StageProgress("scan", 4, 4, "first"), StageProgress("ascent", 0, 16))
    counts |= {"ascent": (1, 16)}
    stages = with_event(stages, ProgressEvent(stage="ascent", done=10, planned=20, stages=counts))
    assert stages == (StageProgress("scan", 4, 4, "first"), StageProgress("ascent", 1, 16))


def test_a_command_that_counts_its_present_stage_only_has_a_row_for_each():
    stages = ()
    for name, done, line in (("compiling", 0, None), ("base", 1, None), ("base", 2, "ok"), ("base", 2, "really")):
        planned = 2 if name == "base" else 0
        stages = with_event(stages, ProgressEvent(stage=name, done=done, planned=planned, line=line))
    assert stages == (StageProgress("base", 2, 2, "ok; really"),)


def test_another_study_is_started_from_a_copy_and_resumed(tmp_path):
    process, folder = shipped(tmp_path), tmp_path / "diagnosis"
    folder.mkdir()
    text = asset_path("studies", "sunflower_extract").read_text(encoding="utf-8")
    named = text.replace('material = "sunflower_extract"', 'material = "corrected.toml"')
    assert named != text
    (folder / "corrected_study.toml").write_text(named, encoding="utf-8")
    shutil.copy(asset_path("materials", "sunflower_extract"), folder / "corrected.toml")
    process.start("quick", file=folder / "corrected_study.toml")
    wait_for(lambda: process.status().state == "finished")
    out = only_folder(tmp_path)
    assert out.name.startswith("corrected_study-quick-")
    copy = out / "corrected_study_changed.toml"
    # Where the copy stands, its material is still the one beside the original.
    assert load_study(str(copy)).scene == load_study(str(folder / "corrected_study.toml")).scene
    process.resume()
    wait_for(lambda: process.status().state == "finished")
    arguments = json.loads((out / "arguments.json").read_text())
    assert arguments[arguments.index("--study") + 1] == str(copy)
    assert arguments[-1] == "--resume"


def test_a_study_whose_file_cannot_be_read_is_not_resumable(tmp_path):
    process = study(tmp_path)
    assert not process.resumable()
    (tmp_path / "my study.toml").write_text("format = ")
    assert not process.resumable()
