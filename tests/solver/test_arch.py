"""The processor is chosen by name, inherited by children, and a missing one is told in one line."""

import os
import subprocess
import sys

import pytest

from solver.arch import ARCHITECTURES, VARIABLE, choose, chosen
from solver.params import ParameterError


def test_the_choice_is_kept_for_children(monkeypatch):
    monkeypatch.setenv(VARIABLE, "cpu")
    choose("cuda")
    assert chosen() == os.environ[VARIABLE] == "cuda"


@pytest.mark.parametrize("set_by", ["choose", "environment"])
def test_an_unknown_processor_lists_the_known_ones(monkeypatch, set_by):
    monkeypatch.setenv(VARIABLE, "abacus")
    with pytest.raises(ParameterError, match=f"'abacus' is not one of {', '.join(ARCHITECTURES)}"):
        choose("abacus") if set_by == "choose" else chosen()


@pytest.mark.parametrize("arch", ["cuda", "vulkan"])
def test_a_processor_either_runs_a_pour_or_is_told_to_be_missing(arch, tmp_path):
    """Falling back to the CPU without a word would be the wrong answer on a machine that lacks the device."""
    command = [sys.executable, "-m", "explorer", "--arch", arch, "simulate", "funnel"]
    command += ["--set", "rig.mass=1g", "--set", "body.spheres=coarse", "--out", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    missing = f"--arch {arch}: Taichi finds no such device" in done.stderr
    assert missing == (done.returncode == 2)
    assert missing or done.returncode == 0, done.stderr
