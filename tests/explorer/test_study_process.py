"""The child process of a study, with a small program in place of the command line."""

import json
import os
import sys

import pytest

from explorer.command_process import BackgroundError, CommandStatus, advanced
from explorer.study_process import CalibrationProcess
from tests.explorer.background import only_folder, wait_for

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
    return CalibrationProcess(
        tmp_path / "my study.toml", tmp_path / "out", tmp_path / "runs.sqlite", (sys.executable, str(program))
    )


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
    assert int((folder / "niceness").read_text()) == min(19, os.nice(0) + 10)


def test_cancel_and_resume(tmp_path):
    process = study(tmp_path, "time.sleep(0 if '--resume' in arguments else 60)")
    process.start("standard")
    wait_for(lambda: process.status().done == 3)
    assert process.status().state == "running"
    with pytest.raises(BackgroundError, match="already"):
        process.start("quick")
    process.cancel()
    wait_for(lambda: process.status().state != "running")
    assert process.status().state == "cancelled"
    process.resume()
    wait_for(lambda: process.status().state != "running")
    assert process.status().state == "finished"
    assert json.loads((only_folder(tmp_path) / "arguments.json").read_text())[-1] == "--resume"


def test_a_study_that_ignores_cancel_is_ended(tmp_path, monkeypatch):
    monkeypatch.setattr("explorer.command_process.CANCEL_WAIT", 0.2)
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


def test_above_the_error_limit_is_a_finished_study(tmp_path):
    process = study(tmp_path, "sys.exit(3)")
    process.start("quick")
    wait_for(lambda: process.status().state != "running")
    assert process.status().state == "finished"
    assert process.status().message.startswith("above the error limit")


def test_what_cannot_be_started_or_resumed(tmp_path):
    process = study(tmp_path)
    with pytest.raises(BackgroundError, match="profile: 'fast' is not one of quick, standard, full"):
        process.start("fast")
    with pytest.raises(BackgroundError, match="nothing to resume"):
        process.resume()
    process.cancel()
    assert process.status().state == "idle"


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


def test_a_study_that_another_page_runs_is_not_resumed(tmp_path):
    first, second = study(tmp_path, "time.sleep(60)"), study(tmp_path, "time.sleep(60)")
    first.start("quick")
    wait_for(lambda: first.status().done == 3)
    with pytest.raises(BackgroundError, match="started from another page"):
        second.resume()
    first.close()


@pytest.mark.parametrize("line", [b"", b"{", b"[]", b'{"stage": "x"}', b"\xff\xfe\n", b"3"])
def test_a_line_that_is_no_event_changes_nothing(line):
    status = CommandStatus("running", "ascent", 2, 9)
    assert advanced(status, line) == status
