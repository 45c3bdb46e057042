"""Store files are checked, handed on, brought together and thinned out, each whole or not at all."""

import dataclasses
import sqlite3
from contextlib import closing

import pytest

from doe import store_upkeep
from doe.store import Store, StoreError
from solver import PHYSICS, packed, unpacked
from tests.doe.test_store import RUN
from tests.explorer.command_line import explorer


def store_of(path, *runs):
    with closing(Store(path)) as store:
        for run in runs:
            store.add(run)
    return path


def keys(path):
    with closing(Store(path, pouring=False)) as store:
        return sorted(run.key for run in store.runs())


def another(**changes):
    return dataclasses.replace(RUN, **changes)


@pytest.fixture
def ours(tmp_path):
    return store_of(tmp_path / "ours.sqlite", RUN, another(key="k2", study="t"))


def test_a_whole_store_is_counted(ours):
    found = store_upkeep.check(ours)
    assert (found.physics, found.runs, found.damaged) == (PHYSICS, {"s": 1, "t": 1}, ())
    assert found.size == ours.stat().st_size


def test_what_is_still_in_the_log_of_a_store_in_use_counts_as_its_size(tmp_path):
    path, log = tmp_path / "r.sqlite", tmp_path / "r.sqlite-wal"
    with closing(Store(path)) as store:
        for n in range(40):
            store.add(another(key=f"k{n}", study="st"[n % 2]))
        whole = path.stat().st_size + log.stat().st_size
        assert log.stat().st_size > path.stat().st_size
        assert store_upkeep.check(path).size == whole
        told = explorer("store", "check", "--store", path).output
        assert f"40 runs, {whole / 1e6:.1f} MB" in told
        assert "0.0 MB" not in told
        # What is removed is given back although the store is open elsewhere.
        told = explorer("store", "prune", "--study", "t", "--store", path, "--yes").output
        assert f"20 runs of t removed, {(whole - store_upkeep.size(path)) / 1e6:.1f} MB given back" in told
        assert path.stat().st_size + log.stat().st_size < 0.6 * whole


def test_a_damaged_raw_pour_is_named_and_costs_exit_code_1(tmp_path):
    path = store_of(tmp_path / "r.sqlite", RUN, another(key="k2", raw=RUN.raw[:-100]))
    told = explorer("store", "check", "--store", path)
    assert told.exit_code == 1
    assert "damaged: run k2 of s: " in told.output
    assert "2 runs" in told.output


def test_a_page_that_is_overwritten_is_told(tmp_path):
    path = store_of(tmp_path / "r.sqlite", *(another(key=f"k{n}") for n in range(20)))
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.seek(size // 2 // 4096 * 4096)
        file.write(b"\xff" * 4096)
    told = explorer("store", "check", "--store", path)
    assert told.exit_code in (1, 2)
    assert "Traceback" not in told.output
    assert "damaged: " in told.output or "cannot be used" in told.output


def test_a_study_is_handed_on_with_the_physics_of_its_store(tmp_path, ours):
    with closing(sqlite3.connect(ours)) as db, db:
        db.execute("UPDATE store SET physics = ?", (PHYSICS - 1,))
    assert store_upkeep.export(ours, tmp_path / "part.sqlite", "t") == 1
    assert keys(tmp_path / "part.sqlite") == ["k2"]
    assert store_upkeep.check(tmp_path / "part.sqlite").physics == PHYSICS - 1


def test_what_cannot_be_handed_on_leaves_no_file(tmp_path, ours):
    with pytest.raises(StoreError, match=r"no runs of 'u'; allowed: s, t"):
        store_upkeep.export(ours, tmp_path / "part.sqlite", "u")
    assert not (tmp_path / "part.sqlite").exists()
    with pytest.raises(StoreError, match="exists already"):
        store_upkeep.export(ours, ours, "t")


def test_two_stores_are_one_and_what_both_have_is_kept_once(tmp_path, ours):
    theirs = store_of(tmp_path / "theirs.sqlite", RUN, another(key="k3"))
    assert store_upkeep.merge(ours, theirs) == store_upkeep.Merged(added=1, known=1)
    assert keys(ours) == ["k1", "k2", "k3"]
    assert store_upkeep.merge(ours, theirs) == store_upkeep.Merged(added=0, known=2)
    assert keys(theirs) == ["k1", "k3"]


def test_a_pour_that_took_another_time_elsewhere_is_the_same(tmp_path, ours):
    slower = packed(dataclasses.replace(unpacked(RUN.raw), wall_s=99.0))
    assert slower != RUN.raw
    theirs = store_of(tmp_path / "theirs.sqlite", another(raw=slower))
    assert store_upkeep.merge(ours, theirs) == store_upkeep.Merged(added=0, known=1)


def test_the_same_pour_with_other_bits_is_refused_and_nothing_is_added(tmp_path, ours):
    later = packed(dataclasses.replace(unpacked(RUN.raw), gate_opened=9.0))
    theirs = store_of(tmp_path / "theirs.sqlite", another(raw=later), another(key="k3"))
    with pytest.raises(StoreError, match="run k1 differs from the run with the same key"):
        store_upkeep.merge(ours, theirs)
    assert keys(ours) == ["k1", "k2"]


def test_pours_of_two_physics_do_not_go_together(tmp_path, ours):
    theirs = store_of(tmp_path / "theirs.sqlite", another(key="k3"))
    with closing(sqlite3.connect(theirs)) as db, db:
        db.execute("UPDATE store SET physics = ?", (PHYSICS + 1,))
    with pytest.raises(StoreError, match=f"physics {PHYSICS + 1}, but .* has physics {PHYSICS}"):
        store_upkeep.merge(ours, theirs)
    with pytest.raises(StoreError, match="is the store to merge into"):
        store_upkeep.merge(ours, ours)


def test_runs_are_removed_only_when_asked_twice_and_their_room_is_given_back(tmp_path):
    path = store_of(tmp_path / "r.sqlite", *(another(key=f"k{n}", study="st"[n % 2]) for n in range(40)))
    before = path.stat().st_size
    assert "20 runs of t would be removed" in explorer("store", "prune", "--study", "t", "--store", path).output
    assert len(keys(path)) == 40
    assert "20 runs of t removed" in explorer("store", "prune", "--study", "t", "--store", path, "--yes").output
    assert len(keys(path)) == 20
    assert path.stat().st_size < 0.6 * before


@pytest.mark.parametrize("order", [("check",), ("prune", "--study", "s", "--yes"), ("merge", "OTHER")])
def test_no_store_is_one_line(tmp_path, order):
    wanted = [str(tmp_path / "none.sqlite") if word == "OTHER" else word for word in order]
    told = explorer("store", *wanted, "--store", str(tmp_path / "none.sqlite"))
    assert told.exit_code == 2
    assert "none.sqlite: " in told.output
    assert not (tmp_path / "none.sqlite").exists()
