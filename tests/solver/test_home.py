"""Homes that Taichi cannot do with: none, for which it aborts, and one that takes nothing, for which it crashes."""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import os
{before}
from doe.store import default_store
from solver.backend import kernel_folder
print(os.environ["HOME"], default_store().parent, kernel_folder(), sep="\\n")
"""
NO_ENTRY = """
import pwd
def absent(uid): raise KeyError(uid)
pwd.getpwuid = absent
"""


@pytest.mark.parametrize(
    ("home", "before"), [(None, ""), ("", NO_ENTRY)], ids=["of an account", "of an account without an entry"]
)
def test_without_a_home_that_of_the_account_counts(tmp_path, home, before):
    import pwd

    kept = {"HOME", "REPOSE_STORE", "XDG_DATA_HOME", "XDG_CACHE_HOME", "TI_OFFLINE_CACHE_FILE_PATH"}
    variables = {name: value for name, value in os.environ.items() if name not in kept}
    variables |= {"PYTHONPATH": os.pathsep.join(sys.path)} | ({} if home is None else {"HOME": home})
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(before=before)],
        cwd=tmp_path,
        env=variables,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    found, store, kernels = done.stdout.splitlines()
    assert found == ("/nonexistent" if before else pwd.getpwuid(os.getuid()).pw_dir)
    assert store.startswith(f"{found}/")
    assert kernels.startswith(f"{found}/")
    assert not list(tmp_path.iterdir())


def test_a_home_that_takes_nothing_is_no_crash_at_the_end(tmp_path):
    kept = {"XDG_CACHE_HOME", "TI_OFFLINE_CACHE_FILE_PATH"}
    variables = {name: value for name, value in os.environ.items() if name not in kept}
    (tmp_path / "temporary").mkdir()
    (tmp_path / "file").touch()
    variables |= {
        "PYTHONPATH": os.pathsep.join(sys.path), "HOME": f"{tmp_path}/file", "TMPDIR": f"{tmp_path}/temporary"
    }  # fmt: skip
    program = "from solver import backend; backend.trial(); print(backend.kernel_folder())"
    done = subprocess.run([sys.executable, "-c", program], env=variables, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"{tmp_path}/temporary/")
    assert not list((tmp_path / "temporary").iterdir())
