"""The workflow in ``examples/ci``, its steps run as they are written."""

import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

WORKFLOW = (Path(__file__).parents[3] / "examples/ci/calibration.yml").read_text(encoding="utf-8")


def step(name):
    """The script of a step."""
    found = re.search(rf"- name: {name}\n(?:        if: .*\n)?        run: \|\n((?:          .*\n)+)", WORKFLOW)
    return "\n".join(line[10:] for line in found[1].splitlines())


def environment(folder):
    """That of the job, in ``folder``, with the explorer of these tests on the path."""
    given = re.search(r"    env:\n((?:      \S.*\n)+)", WORKFLOW)[1]
    own = dict(line.strip().split(": ", 1) for line in given.splitlines())
    own = {name: value.replace("${{ github.workspace }}", str(folder)) for name, value in own.items()}
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return os.environ | own | {"PATH": path, "GITHUB_STEP_SUMMARY": str(folder / "shown.md")}


def run(script, folder):
    return subprocess.run(["bash", "-e", "-c", script], cwd=folder, env=environment(folder), capture_output=True)


def test_the_steps_are_there():
    assert step("Calibrate").startswith("explorer calibrate --headless")
    assert "REPOSE_STORE" in environment(Path())


@pytest.mark.slow
def test_a_second_run_pours_nothing_and_has_not_moved(tmp_path):
    calibrate = step("Calibrate").replace("--study lentil_study.toml", "--study sunflower_extract")
    first = calibrate.replace("--baseline baseline.json ", "")
    assert first != calibrate
    assert run(first, tmp_path).returncode == 0
    (tmp_path / "results/calibration/result.json").rename(tmp_path / "baseline.json")
    (tmp_path / "results/calibration").rename(tmp_path / "accepted")
    again = run(calibrate, tmp_path)
    assert again.returncode == 0, again.stderr.decode()
    assert run(step("Show"), tmp_path).returncode == 0
    assert "nothing has moved" in (tmp_path / "shown.md").read_text(encoding="utf-8")
    suite = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert (suite.get("failures"), int(suite.get("tests")) > 4) == ("0", True)
