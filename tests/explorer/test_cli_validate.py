"""``explorer validate-diagnosis``: the table of the sets that are there, and where its code lives."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from tests.explorer.command_line import explorer

ROOT = Path(__file__).parents[2]


def test_sets_that_are_there_are_only_counted(tmp_path):
    header = "number,kind,label,strength,amplitude,shift,verdict,p_detect,cosine,before,after,pours,seconds"
    rows = [f"{k},null,none,,,0.5,no_missing_effect,0.4,,,,12,3.5" for k in range(2)]
    (tmp_path / "sets.csv").write_text("\n".join([header, *rows]) + "\n")
    result = explorer(
        "validate-diagnosis", "--n", "2", "--out", str(tmp_path), "--store", str(tmp_path / "none.sqlite")
    )
    assert result.exit_code == 0
    assert "an effect blamed where none is: ≤ 2 %; found 0/2 = 0.0 %" in result.stdout
    assert not Path(tmp_path / "none.sqlite").exists()


def test_an_installed_program_can_run_it(tmp_path):
    """All that the command imports, and the declared model, lie in the packages of a wheel."""
    packages = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    for package in packages["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]:
        shutil.copytree(ROOT / package, tmp_path / package)
    shutil.copytree(ROOT / "assets", tmp_path / "solver/assets", ignore=shutil.ignore_patterns("pictures"))
    command = [sys.executable, "-m", "explorer", "validate-diagnosis", "--minutes", "0", "--store", "s.sqlite"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    result = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")
    assert "0 data sets judged" in result.stdout
    program = "from doe.validation import laboratory; laboratory.declared_model(); print(laboratory.__file__)"
    result = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert result.stdout.startswith(str(tmp_path))
