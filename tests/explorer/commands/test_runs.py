"""`explorer runs`: what a store holds, of which physics it is, and readings of today off pours of yesterday."""

import csv
import dataclasses
import io
from contextlib import closing

import pytest

from doe import store as module
from doe.store import Store
from solver import PHYSICS
from tests.doe.test_store import RUN
from tests.explorer.command_line import explorer, refused


@pytest.fixture
def path(tmp_path):
    """A store with two runs that were read before there was any observable but one."""
    path = tmp_path / "pours.sqlite"
    with closing(Store(path)) as store:
        for key in ("k1", "k2"):
            store.add(dataclasses.replace(RUN, key=key, observables={"apex_height_m": 0.5}))
    return path


def test_runs_are_counted_and_the_physics_is_named(path):
    result = explorer("runs", "--store", path)
    assert result.exit_code == 0
    first, *table = result.stdout.splitlines()
    assert first == f"{path}: physics {PHYSICS}"
    assert table[-1].split() == ["s", "pilot", "at_rest", "2"]


def test_a_folder_is_no_store(tmp_path):
    line = refused(explorer("runs", "--store", tmp_path))
    assert line == f"--store {tmp_path}: is a folder; name the file of a store"


def test_a_table_has_the_observables_of_today(path):
    """What was never read is read off the raw pours."""
    result = explorer("runs", "--csv", "--store", path)
    rows = list(csv.DictReader(io.StringIO(result.stdout)))
    assert len(rows) == 2
    assert all(20.0 > float(row["angle_of_repose_deg"]) > 5.0 for row in rows)
    assert all(row["physics"] == str(PHYSICS) for row in rows)


def test_a_store_of_an_older_physics_is_named_and_left_as_it_is(path, monkeypatch):
    before = path.read_bytes()
    monkeypatch.setattr(module, "PHYSICS", PHYSICS + 1)
    result = explorer("runs", "--store", path)
    assert f"old, of physics {PHYSICS}; this program pours by physics {PHYSICS + 1} and adds nothing" in result.stdout
    assert "angle_of_repose_deg" in explorer("runs", "--csv", "--store", path).stdout.splitlines()[0]
    assert path.read_bytes() == before
    refusal = refused(
        explorer("calibrate", "--headless", "--profile", "quick", "--store", path, "--out", path.parent / "o")
    )
    assert "a store of physics" in refusal
    assert "stays readable" in refusal


def test_older_stores_beside_the_default_one_are_named(path, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(path.parent / "data"))
    monkeypatch.delenv("REPOSE_STORE", raising=False)
    default = module.default_store()
    assert default.name == f"pours_{PHYSICS}.sqlite"
    default.parent.mkdir(parents=True)
    path.rename(default.with_name("runs.sqlite"))
    assert "other stores there: runs.sqlite" in refused(explorer("runs"))
    Store(default).close()
    (default.parent / "notes.sqlite").write_text("no database, " * 100)
    result = explorer("runs")
    assert "note: " in result.stderr
    assert "notes.sqlite: cannot be used" in result.stderr
    last = result.stdout.splitlines()[-1]
    assert last.startswith(f"runs.sqlite: physics {PHYSICS}; `--store ")


@pytest.mark.parametrize("options", [(), ("--csv",)])
def test_a_study_that_the_store_does_not_have_is_refused(path, options):
    told = refused(explorer("runs", "--store", path, "--study", "lentils", *options))
    assert f"--study lentils: no runs of this study in {path}" in told
