"""A page that is killed leaves no command behind that stands still for ever."""

import os
import signal
import subprocess
import sys

import pytest

from explorer.background.command_process import CommandProcess
from tests.explorer.background.waiting import wait_for

TICKING = """
import pathlib, sys, time
with pathlib.Path(sys.argv[2]).open("a") as ticks:
    for _ in range(600):
        print(file=ticks, flush=True)
        time.sleep(0.02)
"""
PAGE = """
import pathlib, sys, time
from explorer.background.command_process import CommandProcess
folder, program = pathlib.Path(sys.argv[1]), (sys.executable, sys.argv[2])
process = CommandProcess("study", {}, program)
process.start(folder / "out", ("tick", str(folder / "ticks")))
(folder / "child").write_text(str(process._process.pid))
while (folder / "ticks").stat().st_size < 3:
    time.sleep(0.02)
process.pause()
print(process.status().state, flush=True)
if sys.argv[3] == "go on":
    process.go_on()
    print(process.status().state, flush=True)
time.sleep(60.0)
"""


@pytest.mark.parametrize("wish", ["stay", "go on"])
def test_a_paused_command_goes_on_when_its_page_is_killed(tmp_path, wish):
    (tmp_path / "ticking.py").write_text(TICKING)
    ticks = tmp_path / "ticks"
    ticks.touch()
    arguments = [sys.executable, "-c", PAGE, str(tmp_path), str(tmp_path / "ticking.py"), wish]
    page = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)
    try:
        assert page.stdout is not None
        assert page.stdout.readline() == "paused\n"
        if wish == "go on":
            assert page.stdout.readline() == "running\n"
        else:
            page.kill()
            page.wait()
        seen = ticks.stat().st_size
        wait_for(lambda: ticks.stat().st_size > seen + 3)
    finally:
        page.kill()
        page.wait()
        os.killpg(int((tmp_path / "child").read_text()), signal.SIGKILL)


def test_a_paused_command_that_is_killed_leaves_no_process_to_wake_it(tmp_path):
    (tmp_path / "ticking.py").write_text(TICKING)
    process = CommandProcess("study", {}, (sys.executable, str(tmp_path / "ticking.py")))
    process.start(tmp_path / "out", ("tick", str(tmp_path / "ticks")))
    wait_for(lambda: (tmp_path / "ticks").exists())
    process.pause()
    waker = process._waker
    os.killpg(process._process.pid, signal.SIGKILL)
    wait_for(lambda: process.status().state == "failed")
    assert waker.returncode is not None
    assert process._waker is None
