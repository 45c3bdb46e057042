"""`explorer doctor`: what is broken or put in the way on purpose is named, and the rest is answered all the same."""

import json
import socket
import sys
from importlib import metadata

import pytest

from explorer import installation
from explorer.installation import Finding, examined_text, ready
from tests.explorer.command_line import explorer, refused


def examined(*options):
    """Exit code and findings by their things."""
    result = explorer("doctor", "--json", *options)
    told = json.loads(result.stdout)
    assert told["ready"] == (result.exit_code == 0)
    return result.exit_code, {one["thing"]: one for one in told["findings"]}


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A user who has never started the program, without programs beside it."""
    for name in ("REPOSE_STORE", "REPOSE_CACHE", "XDG_DATA_HOME", "XDG_CACHE_HOME", "TI_OFFLINE_CACHE_FILE_PATH"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    (tmp_path / "home").mkdir()
    (tmp_path / "bin").mkdir()
    return tmp_path / "home"


def test_a_new_user_is_ready_and_nothing_is_made(home, tmp_path):
    chromium = tmp_path / "bin/google-chrome"
    chromium.write_text("#!/bin/sh\n")
    chromium.chmod(0o755)
    with socket.create_server(("127.0.0.1", 0)) as busy:
        port = busy.getsockname()[1]
        code, found = examined("--port", port)
    assert code == 0, found
    assert {name for name, one in found.items() if one["needed"]} == {
        "Python", "Python packages", "X11 library", "Taichi on the CPU", "folder of pours",
    }  # fmt: skip
    assert found["Chromium"]["found"] == str(chromium)
    assert (found["LIGGGHTS"]["present"], found["LIGGGHTS"]["remedy"]) == (False, "apt install liggghts")
    assert not found[f"port {port}"]["present"]
    assert str(port) in found[f"port {port}"]["found"]
    assert str(home) in found["folder of pours"]["found"]
    assert not found["compiled kernels"]["present"]
    assert found["compiled kernels"]["found"].startswith("0 kept")
    # Taichi's file of its daily question to its makers would lie here, too.
    assert not [path for path in home.rglob("*") if path.is_file()]


@pytest.mark.parametrize(
    ("limits", "present", "found"),
    [
        ([], True, "25.3 GB"),
        ([2**63 - 4096], True, "25.3 GB"),
        ([2_000_000_000, 2**63 - 4096], True, "2.0 of 25.3 GB allowed to this process"),
        ([600_000_000], False, "0.6 of 25.3 GB allowed to this process"),
    ],
)
def test_the_memory_of_a_container_is_its_limit(limits, present, found, monkeypatch):
    monkeypatch.setattr(installation, "memory_limits", lambda: iter(limits))
    monkeypatch.setattr(installation, "available_cores", lambda: 2)
    monkeypatch.setattr("os.sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 6171023}.get)
    memory = installation._memory()
    assert (memory.present, memory.found) == (present, f"{found}; a study on all cores takes 1.0 GB")


@pytest.mark.parametrize(
    ("allowed", "present", "found"),
    [(8, True, "8"), (2, True, "2 of 8 allowed to this process"), (1, False, "1 of 8 allowed to this process")],
)
def test_the_cores_of_a_container_are_its_quota(allowed, present, found, monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 8)
    monkeypatch.setattr(installation, "available_cores", lambda: allowed)
    cores = installation._cores()
    assert (cores.present, cores.found) == (present, found)


def test_taichi_that_crashes_and_folders_that_take_nothing(home, tmp_path, monkeypatch):
    """As a foreign build of Taichi does on an old processor: the rest of the table stands."""
    (tmp_path / "taichi").mkdir()
    (tmp_path / "taichi/__init__.py").write_text("import os\nos.abort()\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    (home / "file").touch()
    monkeypatch.setenv("XDG_DATA_HOME", str(home / "file/data"))
    code, found = examined()
    assert code == 1
    assert found["Taichi on the CPU"]["found"] == "crashed by signal 6"
    assert not found["folder of pours"]["present"]
    assert "file" in found["folder of pours"]["found"]
    assert found["folder of body fits"]["present"]
    assert found["Python packages"]["present"]
    assert "Dask" in found


def test_a_library_that_taichi_cannot_load_is_quoted(home, tmp_path, monkeypatch):
    (tmp_path / "taichi.py").write_text("raise ImportError('libX11.so.6: cannot open shared object file')\n")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    result = explorer("doctor")
    assert result.exit_code == 1
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("Taichi on the CPU")]
    assert "missing, needed  ImportError: libX11.so.6: cannot open shared object file" in line
    assert line.endswith("apt install libx11-6")
    assert result.stdout.splitlines()[-1].startswith("not ready: Taichi on the CPU")


def test_a_missing_package_is_named_before_anything_is_asked_of_it(monkeypatch):
    real = metadata.version

    def version(name):
        if name == "viser":
            raise metadata.PackageNotFoundError(name)
        return real(name)

    monkeypatch.setattr(installation.metadata, "version", version)
    code, found = examined()
    assert code == 1
    assert list(found) == ["Python", "Python packages"]
    assert found["Python packages"]["found"] == "no viser"


def test_a_trial_that_hangs_is_ended(monkeypatch):
    monkeypatch.setattr(installation, "LONGEST_TRIAL", 0.5)
    assert installation._apart("import signal; signal.pause()", "cpu").error == "no answer after 0.5 s"


def test_what_is_missing_and_not_needed_leaves_it_ready():
    absent = Finding("Dask", False, "no module distributed", "--scheduler", "pip install")
    there = Finding("Python", True, "3.11", "everything", "Python 3.11", needed=True)
    assert ready([absent, there])
    lines = examined_text([absent, there]).splitlines()
    assert lines[1].split() == ["Dask", "missing", "no", "module", "distributed", "--scheduler", "pip", "install"]
    assert lines[2].split() == ["Python", "present", "3.11"]
    assert lines[-1] == "ready: pouring, calibrating, diagnosing and the page work; optional items missing: 1"


def test_a_port_that_there_is_not_is_refused():
    assert "--port" in refused(explorer("doctor", "--port", 70000))


def test_a_folder_below_one_that_may_not_be_searched_is_a_row(home, monkeypatch):
    def exists(path, **_):
        if path.is_relative_to(home):
            raise PermissionError(13, "Permission denied", str(path))
        return True

    monkeypatch.setattr("pathlib.Path.exists", exists)
    found = installation._folder("folder of pours", home / "below", "pours", "--store FILE")
    assert (found.present, found.found) == (False, f"{home / 'below'}: {home / 'below'}: Permission denied")
