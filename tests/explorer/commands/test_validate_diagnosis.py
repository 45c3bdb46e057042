"""``explorer validate-diagnosis``: the table of the sets that are there, and where its code lives."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from tests.explorer.command_line import explorer

ROOT = Path(__file__).parents[3]


def test_sets_that_are_there_are_only_counted(tmp_path):
    # Of root 1 the first two sets; what they are does not matter to the count.
    row = {
        "laboratory": "blind", "root": 1, "kind": "null",
        "label": "none", "strength": None, "amplitude": "", "verdict": "no_missing_effect",
        "first": "", "follow_up": "",
        "nothing": 0.9, "outside": 0.02, "best": "air_drag", "best_p": 0.03, "truth_p": None, "evidence": {"base": 0.0},
        "fits": {"base": 0.4}, "held_out_p": 0.5, "before": None, "after": None, "pours": 12, "seconds": 3.5,
    }  # fmt: skip
    lines = [json.dumps(row | {"number": k, "offer": offer}) for k in range(2) for offer in ("scalars", "scan")]
    (tmp_path / "sets.jsonl").write_text("\n".join(lines) + "\n")
    arguments = ("--n", "2", "--out", str(tmp_path), "--store", str(tmp_path / "none.sqlite"))
    result = explorer("validate-diagnosis", *arguments)
    assert result.exit_code == 0
    assert "effect named where none is: ≤ 0.667 %; found 0/2 = 0.0 %" in result.stdout
    assert not Path(tmp_path / "none.sqlite").exists()


def test_a_shard_that_there_is_not_is_refused(tmp_path):
    for shard in ("3/2", "0/2", "one"):
        result = explorer("validate-diagnosis", "--n", "2", "--out", str(tmp_path), "--shard", shard)
        assert result.exit_code != 0
        assert "allowed: K/N" in result.output


def test_sets_that_there_are_not_are_refused(tmp_path):
    for sets in ("2", "0,one", "-1", "0,,1"):
        result = explorer("validate-diagnosis", "--n", "2", "--out", str(tmp_path / "out"), "--sets", sets)
        assert result.exit_code != 0
        assert f"--sets {sets}: allowed: numbers from 0 to 1" in result.output
    assert not (tmp_path / "out").exists()


def test_a_wrong_laboratory_leaves_nothing_behind(tmp_path):
    result = explorer("validate-diagnosis", "--out", tmp_path / "out", "--laboratory", tmp_path / "none.toml")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"error: {tmp_path}/none.toml: no such file\n"
    assert list(tmp_path.iterdir()) == []


def test_an_installed_program_can_run_it(tmp_path):
    """All that the command imports, and the declared model, lie in the packages of a wheel."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    for package in {*project["tool"]["hatch"]["build"]["targets"]["wheel"]["only-include"]} - {"assets"}:
        shutil.copytree(ROOT / package, tmp_path / package)
    shutil.copytree(ROOT / "assets", tmp_path / "solver/assets", ignore=shutil.ignore_patterns("pictures"))
    command = [sys.executable, "-m", "explorer", "validate-diagnosis", "--minutes", "0", "--store", "s.sqlite"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")
    assert "0 of 0 data sets within reach" in result.stdout
    program = (
        "from doe.validation import laboratory as one; found = one.read_laboratory(one.TREFOILS); "
        "found.declared; print(found.reference)"
    )
    result = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert result.stdout.startswith(str(tmp_path))
