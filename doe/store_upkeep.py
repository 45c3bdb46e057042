"""Maintenance of store files: check one, export part of it, merge two, prune runs that are no longer wanted.

All operations work on raw pours; their readings go with them. A file is changed in one transaction or not at all.
"""

from __future__ import annotations

import contextlib
import dataclasses
import sqlite3
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from doe.store import DAMAGE, Store, StoredRun, StoreError, address, one_line
from solver import RawPourError, packed, unpacked


@dataclass(frozen=True)
class Checked:
    """What `check` found in a store file."""

    physics: int
    runs: dict[str, int]
    """Study → runs."""
    size: int
    """Size [bytes], including the log beside the file."""
    damaged: tuple[str, ...]
    """One line for each run whose raw pour cannot be read and for each problem that SQLite reports; empty if intact."""


@dataclass(frozen=True)
class Merged:
    """Number of runs that were added from another store, and of runs that were already there."""

    added: int
    known: int


def check(path: Path) -> Checked:
    """Read every page of the file and every raw pour in it. Raises StoreError for a file that is not a store."""
    with _opened(path, readings_do=True) as (store, db):
        complaints = [line for (line,) in db.execute("PRAGMA integrity_check") if line != "ok"]
        runs: Counter[str] = Counter()
        for run in store.runs() if not complaints else ():
            runs[run.study] += 1
            if (line := _unreadable(run)) is not None:
                complaints.append(line)
        return Checked(store.physics, dict(runs), size(path), tuple(complaints))


def size(path: Path) -> int:
    """Return the size of a store on disk [bytes], including the log beside it, which holds the latest writes."""
    log = Path(f"{path}-wal")
    return path.stat().st_size + (log.stat().st_size if log.is_file() else 0)


def export(path: Path, to: Path, study: str) -> int:
    """Copy the runs of ``study`` into the new store file ``to``; returns their number.

    Raises StoreError if there are none, or if the new file exists.
    """
    if to.exists():
        raise StoreError(f"{to}: exists already; choose another name, or merge into it")
    with _opened(path) as (_, db):
        _has(db, path, study)
    try:
        with contextlib.closing(Store(to, pouring=False)):
            pass
        with _opened(to) as (_, db), _attached(db, path), db:
            # The physics that made the pours, which need not be that of this program.
            db.execute("UPDATE store SET physics = (SELECT physics FROM other.store)")
            return db.execute("INSERT INTO pours SELECT * FROM other.pours WHERE study = ?", (study,)).rowcount
    except BaseException:  # including Ctrl-C
        to.unlink(missing_ok=True)
        raise


def merge(path: Path, other: Path) -> Merged:
    """Add the runs of ``other`` to the store ``path``; pours that both contain stay unchanged.

    Raises StoreError, and adds nothing, for a store of another physics, and if both contain the same pour with
    different bits: one of the two was not poured by this solver, or is damaged.
    """
    if path.resolve() == other.resolve():
        raise StoreError(f"{other}: is the store to merge into; name another one")
    with _opened(other) as (theirs, _), _opened(path) as (ours, db):
        if theirs.physics != ours.physics:
            raise StoreError(
                f"{other}: a store of physics {theirs.physics}, but {path} has physics {ours.physics}; allowed: stores "
                "of one physics"
            )
        with _attached(db, other), db:
            both = db.execute(
                "SELECT pours.key, pours.raw, their.raw FROM pours JOIN other.pours AS their ON pours.key = their.key "
                "WHERE pours.raw != their.raw"
            )
            for key, our_raw, their_raw in both:
                if bits(our_raw) != bits(their_raw):
                    raise StoreError(
                        f"{other}: run {key[:12]} differs from the run with the same key in {path}; nothing was merged"
                    )
            (total,) = db.execute("SELECT count(*) FROM other.pours").fetchone()
            added = db.execute("INSERT OR IGNORE INTO pours SELECT * FROM other.pours").rowcount
        return Merged(added, total - added)


def count(path: Path, study: str) -> int:
    """Return the number of runs of ``study``."""
    with _opened(path) as (_, db):
        return int(db.execute("SELECT count(*) FROM pours WHERE study = ?", (study,)).fetchone()[0])


def prune(path: Path, study: str) -> int:
    """Remove the runs of ``study`` and free their space; returns their number. Raises StoreError if there are none.

    A pour is kept under the study that poured it first. Another study that reused it has to pour it again after that
    study is removed.
    """
    with _opened(path) as (_, db):
        _has(db, path, study)
        with db:
            removed = db.execute("DELETE FROM pours WHERE study = ?", (study,)).rowcount
        db.execute("VACUUM")
        # While other processes have the store open, only this shortens the file.
        db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        return removed


def bits(raw: bytes) -> bytes:
    """Return a raw pour without its wall time, the only part that differs when it is poured again.

    Raises RawPourError for a raw pour that cannot be read.
    """
    return packed(dataclasses.replace(unpacked(raw), wall_s=0.0))


def _has(db: sqlite3.Connection, path: Path, study: str) -> None:
    found = [name for (name,) in db.execute("SELECT DISTINCT study FROM pours ORDER BY study")]
    if study not in found:
        raise StoreError(f"{path}: no runs of {study!r}; allowed: {', '.join(found) or 'none, it is empty'}")


def _unreadable(run: StoredRun) -> str | None:
    try:
        if run.raw:
            unpacked(run.raw)
    except RawPourError as error:
        return f"run {run.key[:12]} of {run.study}: {error}"
    return None


@contextlib.contextmanager
def _opened(path: Path, readings_do: bool = False) -> Iterator[tuple[Store, sqlite3.Connection]]:
    """The store and a separate connection to it; errors of SQLite in the meantime become a StoreError.

    ``readings_do``: also accept a store made before raw pours were kept.
    """
    if not path.is_file():
        raise StoreError(f"{path}: no such store")
    with contextlib.closing(Store(path, pouring=False)) as store:
        if not store.physics and not readings_do:
            raise StoreError(
                f"{path}: holds readings but no raw pours; `explorer runs --csv --store {path}` lists them"
            )
        try:
            with contextlib.closing(sqlite3.connect(address(path, reading=True), timeout=60.0, uri=True)) as db:
                yield store, db
        except (*DAMAGE, RawPourError) as error:
            raise StoreError(f"{path}: cannot be used as a store of runs ({one_line(error)})") from None


@contextlib.contextmanager
def _attached(db: sqlite3.Connection, other: Path) -> Iterator[None]:
    db.execute("ATTACH DATABASE ? AS other", (address(other, reading=True),))
    try:
        yield
    finally:
        db.execute("DETACH DATABASE other")
