"""The store keeps every pour raw and finds it again by what was poured; readings are read off it, never poured."""

import csv
import dataclasses
import io
import multiprocessing as mp
import sqlite3
from contextlib import closing

import pytest

from doe import store as module
from doe.store import READINGS, RIG, Store, StoredRun, StoreError, observables_in_rig, observables_of, write_csv
from solver import PHYSICS
from tests.doe import golden_readings

RAW = (golden_readings.RAW_POURS / "trefoils.npz").read_bytes()
RUN = StoredRun(
    key="k1",
    study="s",
    stage="pilot",
    label="reference",
    seed=7,
    physics=PHYSICS,
    outcome="at_rest",
    message="",
    parameters={RIG: "funnel", "rig.mass": 0.03, "body.spheres": "coarse"},
    readings=READINGS,
    observables={"angle_of_repose_deg": 21.5, "residual_mass_kg": None},
    dt=1e-6,
    steps=10,
    wall_s=0.5,
    raw=RAW,
)
NEVER = None
"""In place of a reader that must not be asked."""


@pytest.fixture
def store(tmp_path):
    with closing(Store(tmp_path / "runs.sqlite")) as opened:
        opened.add(RUN)
        yield opened


def test_a_run_comes_back_as_it_went_in(tmp_path):
    store = Store(tmp_path / "new folder" / "runs.sqlite")
    store.add(RUN)
    store.close()
    again = Store(tmp_path / "new folder" / "runs.sqlite").find("k1")
    assert dataclasses.replace(again, created=0.0) == RUN
    assert again.created > 1.6e9


def test_two_connections_see_each_others_runs(tmp_path):
    one, two = Store(tmp_path / "r"), Store(tmp_path / "r")
    one.add(RUN)
    assert two.find("k1") is not None
    assert two.find("k2") is None


def test_what_is_kept_is_not_read_again(store):
    assert store.read(RUN, ("angle_of_repose_deg",), NEVER) is RUN


def test_a_new_name_is_read_off_the_raw_pour_and_kept_beside_the_others(store):
    """No pour: the reader gets the record that was stored."""
    found = store.read(RUN, ("angle_of_repose_deg", "widest_m"), lambda record: {"widest_m": record.pile.mass.size})
    assert found.observables == RUN.observables | {"widest_m": 70.0}
    assert store.find("k1").observables == found.observables
    assert store.read(store.find("k1"), ("widest_m", "residual_mass_kg"), NEVER).observables == found.observables


def test_readings_of_an_older_version_are_replaced(store, monkeypatch):
    monkeypatch.setattr(module, "READINGS", READINGS + 1)
    found = store.read(RUN, ("angle_of_repose_deg",), observables_of)
    assert found.readings == READINGS + 1
    assert found.observables.keys() == set(observables_in_rig(RUN))
    assert found.observables["angle_of_repose_deg"] != 21.5
    kept = store.find("k1")
    assert (kept.readings, kept.observables, kept.raw) == (found.readings, found.observables, RAW)


LAYER = (golden_readings.RAW_POURS / "layer.npz").read_bytes()


def test_a_pour_stored_as_a_pile_is_told_as_what_it_left_without_pouring(store):
    """Two layers of beans, stored when a pile at rest was valid whatever its height."""
    old = dataclasses.replace(RUN, key="layer", readings=READINGS - 1, raw=LAYER)
    assert old.outcome == "at_rest"
    store.add(old)
    found = store.find("layer")
    assert (found.outcome, found.readings) == ("no_heap", READINGS - 1)
    assert found.message.startswith("a flat layer 12.00 mm high")
    read = store.read(found, ("angle_of_repose_deg",), observables_of)
    assert (read.outcome, read.readings) == ("no_heap", READINGS)
    (kept,) = (run for run in store.runs() if run.key == "layer")
    assert (kept.outcome, kept.message, kept.readings, kept.raw) == ("no_heap", found.message, READINGS, LAYER)


def test_what_cannot_be_read_is_none(store):
    assert store.read(RUN, ("gone",), lambda record: {"gone": float("nan")}).observables["gone"] is None


def test_a_raw_pour_that_is_damaged_is_one_clear_line(store):
    with pytest.raises(StoreError, match=r"runs\.sqlite: run k1: not a raw pour"):
        store.read(dataclasses.replace(RUN, raw=RAW[:500]), ("new",), observables_of)


def test_a_store_of_an_older_physics_stays_readable_and_nothing_is_poured_into_it(tmp_path, store, monkeypatch):
    monkeypatch.setattr(module, "PHYSICS", PHYSICS + 1)
    store.close()
    with pytest.raises(StoreError, match=rf"runs\.sqlite: a store of physics {PHYSICS}, but .* physics {PHYSICS + 1};"):
        Store(tmp_path / "runs.sqlite")
    with closing(Store(tmp_path / "runs.sqlite", pouring=False)) as old:
        assert old.version.startswith(f"old, of physics {PHYSICS}; this program pours by physics {PHYSICS + 1}")
        (run,) = old.runs()
        found = old.read(run, ("angle_of_repose_cone_deg",), observables_of)
        assert found.observables["angle_of_repose_cone_deg"] == pytest.approx(7.1, abs=0.05)
        # It is read, and left as it is.
        assert old.find("k1").observables == RUN.observables
    monkeypatch.undo()
    with closing(Store(tmp_path / "runs.sqlite")) as again:
        assert again.find("k1") is not None


def test_a_store_from_before_raw_pours_is_listed_as_old(tmp_path):
    path = tmp_path / "runs.sqlite"
    with closing(sqlite3.connect(path)) as database, database:
        database.execute(
            "CREATE TABLE runs (key TEXT PRIMARY KEY, created REAL NOT NULL, study TEXT NOT NULL, stage TEXT NOT NULL,"
            " label TEXT NOT NULL, seed INTEGER NOT NULL, code_version TEXT NOT NULL, outcome TEXT NOT NULL,"
            " message TEXT NOT NULL, parameters TEXT NOT NULL, observables TEXT NOT NULL, dt REAL NOT NULL,"
            " steps INTEGER NOT NULL, wall_s REAL NOT NULL)"
        )
        row = ("k", 1.0, "s", "pilot", "reference", 7, "0+abc", "at_rest", "", "{}", '{"a": 21.5}', 1e-6, 10, 0.5)
        database.execute(f"INSERT INTO runs VALUES ({', '.join('?' * len(row))})", row)
    with pytest.raises(StoreError, match="a store of physics 0"):
        Store(path)
    with closing(Store(path, pouring=False)) as old:
        assert old.version.startswith("old, of a program that kept no raw pours")
        (run,) = old.runs()
        assert (run.key, run.observables, run.physics, run.raw) == ("k", {"a": 21.5}, 0, b"")
        assert old.read(run, ("b",), NEVER) is run


def test_a_store_of_a_newer_program_is_refused_by_name(tmp_path):
    with closing(sqlite3.connect(tmp_path / "r")) as database, database:
        database.execute("PRAGMA user_version = 9")
    with pytest.raises(StoreError, match=r"r: a store of format 9, made by a newer version .*; allowed: up to 1"):
        Store(tmp_path / "r")


def test_a_file_that_is_no_store_is_one_clear_line(tmp_path):
    wrong = tmp_path / "notes.txt"
    wrong.write_text("this is not a database, " * 100)
    with pytest.raises(StoreError, match=r"notes\.txt: cannot be used"):
        Store(wrong)


def test_a_run_whose_parameters_are_damaged_is_one_line_with_the_file(store, tmp_path):
    with closing(sqlite3.connect(tmp_path / "runs.sqlite")) as db, db:
        db.execute("UPDATE pours SET parameters = 'no JSON'")
    for read in (lambda: store.find("k1"), lambda: list(store.runs())):
        with pytest.raises(
            StoreError, match=r"runs\.sqlite: run k1: its parameters, outcome, readings or raw pour cannot"
        ):
            read()


def test_csv_has_a_column_per_parameter_and_observable(tmp_path):
    store = Store(tmp_path / "r")
    store.add(RUN)
    store.add(dataclasses.replace(RUN, key="k2", study="other", observables={"apex_height_m": 0.02}))
    out = io.StringIO()
    assert write_csv(store.runs(), out) == 2
    rows = list(csv.DictReader(io.StringIO(out.getvalue())))
    assert rows[0]["angle_of_repose_deg"] == "21.5"
    assert rows[0]["residual_mass_kg"] == ""
    assert rows[1]["apex_height_m"] == "0.02"
    assert rows[1]["rig.mass"] == "0.03"
    assert [run.key for run in store.runs("other")] == ["k2"]


def test_what_is_kept_is_not_overwritten_by_another_reader(store):
    """A reader that knows of a misread scale was here before."""
    found = store.read(RUN, ("new_m",), lambda record: {"angle_of_repose_deg": 1.0, "new_m": 2.0})
    assert found.observables == RUN.observables | {"new_m": 2.0}


def test_another_program_s_database_is_left_alone(tmp_path):
    path = tmp_path / "photos.sqlite"
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("CREATE TABLE pictures (name TEXT)")
    before = path.read_bytes()
    for pouring in (True, False):
        with pytest.raises(StoreError, match=r"photos\.sqlite: a database of another program .*'pictures'"):
            Store(path, pouring=pouring)
    assert path.read_bytes() == before


def test_what_the_database_complains_of_later_is_one_line(store, tmp_path):
    with closing(sqlite3.connect(tmp_path / "runs.sqlite")) as database, database:
        database.execute("DROP TABLE pours")
    for ask in (lambda: store.find("k1"), lambda: list(store.runs()), lambda: store.add(RUN)):
        with pytest.raises(StoreError, match=r"runs\.sqlite: cannot be used as a store of runs \(no such table"):
            ask()


def opened(path):
    Store(path).close()
    return True


@pytest.mark.slow
def test_many_processes_may_make_a_store_at_once(tmp_path):
    """Four at a time, six times: whoever comes second waits, and none fails."""
    with mp.get_context("spawn").Pool(4) as pool:
        for k in range(6):
            assert pool.map(opened, [tmp_path / f"{k}.sqlite"] * 4, chunksize=1) == [True] * 4
