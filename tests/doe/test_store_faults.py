"""A power cut, a full disk and a locked file cost at most the pour that was being written, and are told in one line."""

import dataclasses
import os
import shutil
import sqlite3
from contextlib import closing

import pytest

from doe.store import Store, StoreError, observables_of
from doe.store_upkeep import check, count, merge
from tests.doe.test_store import RUN

FRAME = 24 + 4096
"""Bytes of a page in SQLite's write-ahead log, with its header."""


def run(number):
    return dataclasses.replace(RUN, key=f"k{number}")


def add_many(store):
    for number in range(2, 40):
        store.add(run(number))


def kept(path):
    with closing(Store(path)) as store:
        return [found.key for found in store.runs()]


def test_a_transaction_cut_anywhere_costs_its_own_pour_only(tmp_path):
    """The files as a power cut leaves them, the log of the last pour written to any length."""
    path, log = tmp_path / "r.sqlite", tmp_path / "r.sqlite-wal"
    with closing(Store(path)) as store:
        store.add(run(1))
        store.add(run(2))
        before = log.stat().st_size
        store.add(run(3))
        after = log.stat().st_size
        assert after - before > 2 * FRAME
        for cut in [*range(before, after, 1000), after - 1, after]:
            place = tmp_path / str(cut)
            place.mkdir()
            shutil.copy(path, place)
            (place / log.name).write_bytes(log.read_bytes()[:cut])
            expected = ["k1", "k2", "k3"] if cut == after else ["k1", "k2"]
            assert kept(place / path.name) == expected
            with closing(Store(place / path.name)) as again:
                again.add(run(3))
            assert kept(place / path.name) == ["k1", "k2", "k3"]


def test_every_pour_is_on_the_disk_when_it_has_been_added(tmp_path):
    """SQLite waits for the disk at each commit (synchronous = FULL): a power cut loses no pour that was told of."""
    with closing(Store(tmp_path / "r.sqlite")) as store:
        assert store._db.execute("PRAGMA synchronous").fetchone() == (2,)


def test_a_full_disk_is_one_line_and_what_was_kept_stays(tmp_path):
    path = tmp_path / "r.sqlite"
    with closing(Store(path)) as store:
        store.add(run(1))
        store._db.execute("PRAGMA max_page_count = 1")  # no more than there is
        full = r"r\.sqlite: cannot be used as a store of runs \(database or disk is full\)"
        with pytest.raises(StoreError, match=full):
            add_many(store)
    found = kept(path)
    assert "k1" in found
    assert found == [f"k{number}" for number in range(1, len(found) + 1)]


def test_a_store_that_another_program_locks_is_one_line(tmp_path):
    path = tmp_path / "r.sqlite"
    with closing(Store(path)) as store, closing(sqlite3.connect(path, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        store._db.execute("PRAGMA busy_timeout = 10")
        with pytest.raises(StoreError, match="database is locked"):
            store.add(run(1))
        other.execute("ROLLBACK")
        store.add(run(1))
    assert kept(path) == ["k1"]


@pytest.mark.parametrize("length", [50, 99, 100, 1000, 4095, 4096, 5000])
def test_a_truncated_store_is_one_line_and_left_as_it_is(tmp_path, length):
    whole, path = tmp_path / "whole.sqlite", tmp_path / "cut.sqlite"
    with closing(Store(whole)) as store:
        store.add(run(1))
    path.write_bytes(whole.read_bytes()[:length])
    with pytest.raises(StoreError, match=r"^\S*cut\.sqlite: .+$"):
        kept(path)
    assert path.read_bytes() == whole.read_bytes()[:length]


def test_an_empty_file_becomes_a_store(tmp_path):
    """Killed before the first page was written."""
    (tmp_path / "r.sqlite").touch()
    assert kept(tmp_path / "r.sqlite") == []


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("DELETE FROM store", "its version of the physics is missing"),
        ("UPDATE store SET physics = 'two'", "its version of the physics is missing"),
        ("UPDATE pours SET observables = '[]'", "run k1: its parameters, outcome, readings or raw pour cannot be read"),
        (
            "UPDATE pours SET parameters = 'null'",
            "run k1: its parameters, outcome, readings or raw pour cannot be read",
        ),
        ("UPDATE pours SET outcome = 'gone'", "run k1: its parameters, outcome, readings or raw pour cannot be read"),
        ("UPDATE pours SET raw = 'text'", "run k1: its parameters, outcome, readings or raw pour cannot be read"),
    ],
)
def test_a_store_changed_by_hand_is_one_line(tmp_path, change, says):
    path = tmp_path / "r.sqlite"
    with closing(Store(path)) as store:
        store.add(run(1))
    with closing(sqlite3.connect(path)) as other, other:
        other.execute(change)
    with pytest.raises(StoreError, match=rf"r\.sqlite: .*{says}"), closing(Store(path)) as store:
        store.read(store.find("k1"), ("new",), observables_of)


@pytest.mark.parametrize("byte", [b"\xfb", b"["])
def test_a_complaint_about_damaged_text_is_one_line(tmp_path, byte):
    """SQLite quotes the table's declaration, line by line, and Python cannot read what is no UTF-8 in it."""
    path = tmp_path / "r.sqlite"
    with closing(Store(path)) as store:
        store.add(run(1))
    path.write_bytes(path.read_bytes().replace(b"key TEXT PRIMARY", b"key TEXT " + 7 * byte, 1))
    for command in (kept, check):
        with pytest.raises(StoreError, match=r"r\.sqlite: cannot be used as a store of runs \(.*\)") as found:
            command(path)
        assert "\n" not in str(found.value)


@pytest.fixture
def sealed(tmp_path, monkeypatch):
    """A store on a medium that takes nothing; the one who runs the tests may be allowed to write anywhere."""
    path = tmp_path / "sealed" / "r.sqlite"
    with closing(Store(path)) as store:
        store.add(dataclasses.replace(run(1), readings=RUN.readings - 1))
    monkeypatch.setattr(os, "access", lambda place, mode: path.parent not in (place, place.parent))
    return path


def test_a_store_that_cannot_be_written_is_read_as_one_that_nobody_changes(tmp_path, sealed):
    assert [count(sealed, RUN.study), check(sealed).damaged] == [1, ()]
    with closing(Store(sealed, pouring=False)) as store:
        found = store.read(store.find("k1"), ("apex_height_m",), observables_of)
        assert found.observables["apex_height_m"] > 0.0
        with pytest.raises(StoreError, match="readonly"):
            store.add(run(2))
    assert [one.name for one in sealed.parent.iterdir()] == [sealed.name]
    ours = tmp_path / "ours.sqlite"
    Store(ours).close()
    assert merge(ours, sealed).added == 1


def test_a_store_that_cannot_be_written_is_refused_before_anything_is_poured(sealed):
    with pytest.raises(StoreError, match=r"r\.sqlite: cannot be written; name another file for new pours"):
        Store(sealed)
