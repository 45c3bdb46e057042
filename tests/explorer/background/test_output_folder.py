"""One command at a time writes in a folder, and a killed one leaves it free."""

import subprocess
import sys

import pytest

from explorer.background.output_folder import ResultFile, checked_folder, kept_for_one
from explorer.errors import CommandError

AT_WORK = """
import sys
from pathlib import Path
from explorer.background.output_folder import kept_for_one
with kept_for_one(Path(sys.argv[1])):
    print("at work", flush=True)
    sys.stdin.read()
"""


def test_a_second_command_is_refused_while_the_first_is_at_work_and_a_killed_one_leaves_the_folder_free(tmp_path):
    folder = tmp_path / "out"
    command = [sys.executable, "-c", AT_WORK, folder]
    first = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert first.stdout.readline() == "at work\n"
    with pytest.raises(CommandError, match=f"--out {folder}: another command is writing there"), kept_for_one(folder):
        pass
    first.kill()
    first.communicate()
    with kept_for_one(folder):
        assert folder.is_dir()
    with kept_for_one(folder):
        pass


def test_an_error_of_the_command_itself_is_not_told_as_that_of_another_one(tmp_path):
    """Such as that of a full pipe that nobody waits for."""
    with pytest.raises(BlockingIOError, match="write could not complete"), kept_for_one(tmp_path / "out"):
        raise BlockingIOError(11, "write could not complete without blocking")


def test_a_result_of_brackets_without_end_is_one_line(tmp_path):
    (tmp_path / "result.json").write_text("[" * 100_000)
    assert ResultFile("result.json").read(tmp_path) is None
    with pytest.raises(CommandError, match=r"result\.json: cannot be read"):
        checked_folder(str(tmp_path), "result.json")
