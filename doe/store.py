"""The store: every finished pour, kept raw in one SQLite file and found again by what was poured.

A pour is kept permanently under the key of everything that determines its bits (`solver.pours.pour_key`). Its readings
(outcome, observables and the summaries of a diagnosis) are kept beside it with their version, and are read again from
the raw pour if that version has changed or a name is missing: a new observable costs no pour.

A file belongs to one version of the physics. A file of an older version stays readable, but no pours are added to it.
"""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import json
import math
import os
import sqlite3
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import platformdirs

from solver import PHYSICS, RIGS, Outcome, RawPourError, Record, Scene, observables_in, observe, pour_keys, unpacked

READINGS = 2
"""Version of the readings of a raw pour. Raise it when an outcome, an observable, a summary or a profile changes for
the same pour; a new name needs no new version. `tests/doe/golden_readings.json` enforces this.

2: a flat layer is `no_heap` where the angle of repose of a heap is asked for.
"""

SCHEMA_VERSION = 1
SCHEMA = """
CREATE TABLE IF NOT EXISTS pours (
    key TEXT PRIMARY KEY, created REAL NOT NULL, study TEXT NOT NULL, stage TEXT NOT NULL, label TEXT NOT NULL,
    seed INTEGER NOT NULL, physics INTEGER NOT NULL, outcome TEXT NOT NULL, message TEXT NOT NULL,
    parameters TEXT NOT NULL, readings INTEGER NOT NULL, observables TEXT NOT NULL, dt REAL NOT NULL,
    steps INTEGER NOT NULL, wall_s REAL NOT NULL, raw BLOB NOT NULL
)
"""
KEPT_AS = {"parameters": dict, "observables": dict, "raw": bytes}
"""Types of columns once they are read; SQLite itself accepts any value in any column."""
DAMAGE = (sqlite3.Error, OSError, UnicodeDecodeError)
"""Exceptions of SQLite and the file system for a damaged or unreachable file; the last occurs if the text of the error
message is itself damaged."""
OWN = {"store", "pours"}
"""Names of the tables of a store."""
BEFORE_RAW_POURS = "runs"
"""The table of a store made before raw pours were kept: readings only, physics 0."""

Reader = Callable[[Record], Mapping[str, float]]
"""Reads named numbers from a record; NaN where there is nothing to read."""
Readings = dict[str, float | None]
"""Numbers by name; None where nothing could be read."""
RIG = "rig.name"
"""Key, among the parameters of a stored run, of the rig in which it was poured."""


class StoreError(ValueError):
    """The store cannot be used; the message is one line, fit for a user."""


@dataclass(frozen=True)
class StoredRun:
    """One finished run. ``parameters`` holds every parameter of the scene, and ``RIG``."""

    key: str
    study: str
    stage: str
    label: str
    seed: int
    physics: int
    outcome: str
    """Read from the raw pour, like ``message``: how the pour ended, and whether it left a heap."""
    message: str
    parameters: dict[str, Any]
    readings: int
    """Version of the readings to which the outcome and ``observables`` belong."""
    observables: Readings
    dt: float
    steps: int
    wall_s: float
    raw: bytes
    """See `solver.pours.raw_pour`; empty for a run stored before raw pours were kept."""
    created: float = 0.0

    @property
    def valid(self) -> bool:
        """True if the readings of the run count, as in `doe.run_records.Run`."""
        return Outcome(self.outcome).valid


def one_line(error: Exception) -> str:
    """Return the message of ``error``, which may quote a damaged file, as one line of readable length."""
    return " ".join(str(error).split())[:200]


def default_store() -> Path:
    """Return ``$REPOSE_STORE``, or the file of the current physics in the user's data directory."""
    named = os.environ.get("REPOSE_STORE")
    return Path(named) if named else Path(platformdirs.user_data_dir("repose-explorer")) / f"pours_{PHYSICS}.sqlite"


def observables_in_rig(run: StoredRun) -> tuple[str, ...]:
    """Return the names of the observables of the rig of ``run``; none for an unknown rig."""
    rig = RIGS.get(str(run.parameters.get(RIG)))
    return observables_in(rig()) if rig is not None else ()


def address(path: Path, reading: bool) -> str:
    """Return the URI by which SQLite opens the store file ``path``.

    When ``reading`` in a folder that is not writable, the file is opened as immutable, because SQLite cannot create the
    files there that processes share.
    """
    unchanging = reading and not os.access(path.parent, os.W_OK) and not Path(f"{path}-wal").exists()
    return path.absolute().as_uri() + ("?immutable=1" if unchanging else "")


def read_off(raw: bytes, reader: Reader) -> Readings:
    """Return the readings of a raw pour by ``reader``.

    They are always taken from the raw pour, never from the record that was packed into it, so that a reading is the
    same number whether it is taken when the pour ends or years later.
    """
    return _numbers(reader(unpacked(raw)))


def _numbers(seen: Mapping[str, float]) -> Readings:
    return {name: float(number) if math.isfinite(number) else None for name, number in seen.items()}


def observables_of(record: Record) -> dict[str, float]:
    """Return the observables of the record's rig; the reader of a study."""
    return {name: found.value for name, found in observe(record).items()}


class Store:
    """Pours in a SQLite file; several processes may read and write at once.

    ``pouring``: whether pours will be added. Raises StoreError for a file that is not a store and, if pours will be
    added, for one that cannot be written or belongs to another version of the physics.
    """

    def __init__(self, path: Path, pouring: bool = True) -> None:
        self.path = path
        with self._told():
            path.parent.mkdir(parents=True, exist_ok=True)
            if pouring and not all(os.access(one, os.W_OK) for one in (path.parent, path) if one.exists()):
                raise StoreError(f"{path}: cannot be written; name another file for new pours")
            self._db = sqlite3.connect(address(path, reading=not pouring), timeout=60.0, uri=True)
            try:
                self._table = self._opened()
            except BaseException:
                self._db.close()
                raise
        if pouring and self.physics != PHYSICS:
            self.close()
            raise StoreError(
                f"{path}: a store of physics {self.physics}, but this program pours with physics {PHYSICS}; it stays "
                f"readable (explorer runs --store {path}); name another file for new pours"
            )

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        """Turn errors of SQLite and the file system into a StoreError of one line."""
        try:
            yield
        except DAMAGE as error:
            raise StoreError(
                f"{self.path}: cannot be used as a store of runs ({one_line(error)}); --store FILE names another"
            ) from None

    def _opened(self) -> str:
        """Name of the table that holds the runs; created if there is none."""
        version = self._db.execute("PRAGMA user_version").fetchone()[0]
        if version > SCHEMA_VERSION:
            raise StoreError(
                f"{self.path}: a store of format {version}, made by a newer version of this program; allowed: up to "
                f"{SCHEMA_VERSION}"
            )
        tables = {name for (name,) in self._db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if BEFORE_RAW_POURS in tables:
            self.physics = 0
            return BEFORE_RAW_POURS
        if tables - OWN:
            raise StoreError(f"{self.path}: a database of another program (it has a table {min(tables - OWN)!r})")
        if version == 0:
            # If two processes create it at once, one switches the journal mode while the other finds the file locked.
            with contextlib.suppress(sqlite3.OperationalError):
                self._db.execute("PRAGMA journal_mode=WAL")
            with self._db:
                self._db.execute("CREATE TABLE IF NOT EXISTS store (physics INTEGER NOT NULL)")
                self._db.execute("INSERT INTO store SELECT ? WHERE NOT EXISTS (SELECT * FROM store)", (PHYSICS,))
                self._db.execute(SCHEMA)
                self._db.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        said = self._db.execute("SELECT physics FROM store").fetchone()
        if said is None or not isinstance(said[0], int):
            raise StoreError(f"{self.path}: a damaged store: its version of the physics is missing")
        self.physics = said[0]
        return "pours"

    @property
    def version(self) -> str:
        """The version of the physics of the store, and whether it is an old one, in words."""
        if self.physics == PHYSICS:
            return f"physics {PHYSICS}"
        made = f"physics {self.physics}" if self.physics else "a program that kept no raw pours"
        age = "old" if self.physics < PHYSICS else "newer"
        return f"{age}, of {made}; this program pours by physics {PHYSICS} and adds nothing to it"

    def find(self, key: str) -> StoredRun | None:
        """Return the run with that key, or None; its outcome is that of the current version of the readings.

        Raises StoreError for a raw pour that cannot be read.
        """
        with self._told():
            row = self._db.execute(f"SELECT {_COLUMNS} FROM pours WHERE key = ?", (key,)).fetchone()
        run = self._from_row(row) if row else None
        if run is None or run.readings == READINGS or not run.raw:
            return run
        record = self._record(run)
        return dataclasses.replace(run, outcome=str(record.outcome), message=record.message)

    def pours_of(self, scene: Scene) -> Iterator[StoredRun]:
        """Yield the runs of exactly ``scene`` by seed: every seed in the store is looked up with :meth:`find`.

        Yields nothing for a store of another physics, whose keys are different. Raises StoreError like :meth:`find`.
        """
        if self.physics != PHYSICS:
            return
        with self._told():
            seeds = [seed for (seed,) in self._db.execute("SELECT DISTINCT seed FROM pours ORDER BY seed")]
        for key in pour_keys(scene, seeds).values():
            if (run := self.find(key)) is not None:
                yield run

    def wall_times(self, study: str, parameters: Mapping[str, float | str]) -> list[float]:
        """Return the wall times [s] of those pours of ``study`` whose parameters match ``parameters``.

        A parameter that a pour lacks counts as matching.
        """
        kept = " AND ".join("ifnull(json_extract(parameters, ?), ?) = ?" for _ in parameters)
        values = [entry for path, value in parameters.items() for entry in (f'$."{path}"', value, value)]
        with self._told():
            found = self._db.execute(f"SELECT wall_s FROM pours WHERE study = ? AND {kept or 1}", [study, *values])
            return [float(wall_s) for (wall_s,) in found]

    def add(self, run: StoredRun) -> None:
        """Store a run; it is on disk when this returns."""
        values = dataclasses.asdict(run)
        values["parameters"] = json.dumps(run.parameters, sort_keys=True)
        values["observables"] = json.dumps(run.observables, sort_keys=True)
        values["created"] = run.created or time.time()
        marks = ", ".join("?" for _ in _NAMES)
        with self._told(), self._db:
            self._db.execute(f"INSERT OR REPLACE INTO pours ({_COLUMNS}) VALUES ({marks})", [values[n] for n in _NAMES])

    def read(self, run: StoredRun, names: Iterable[str], reader: Reader) -> StoredRun:
        """Return ``run`` with its outcome and the readings ``names`` in the current version.

        The stored readings are returned if they are of that version and include all ``names``. Otherwise ``reader``
        reads the raw pour again, and the new readings are stored, unless the store is of another physics or not
        writable. A run without a raw pour is returned unchanged. Raises StoreError for a raw pour that cannot be read.
        """
        present = run.readings == READINGS
        if not run.raw or (present and run.observables.keys() >= set(names)):
            return run
        record = self._record(run)
        # Stored readings take precedence: they were made by the reader that knew the pour best.
        kept = run.observables if present else {}
        run = dataclasses.replace(
            run,
            outcome=str(record.outcome),
            message=record.message,
            readings=READINGS,
            observables=_numbers(reader(record)) | kept,
        )
        if self.physics == PHYSICS:
            # If it cannot be stored (full disk, read-only file), it is read again next time.
            with contextlib.suppress(StoreError):
                self.add(run)
        return run

    def _record(self, run: StoredRun) -> Record:
        try:
            return unpacked(run.raw)
        except RawPourError as error:
            raise StoreError(f"{self.path}: run {run.key[:12]}: {error}") from None

    def _from_row(self, row: tuple[Any, ...]) -> StoredRun:
        values = dict(zip(_NAMES, row, strict=True))
        try:
            values["parameters"] = json.loads(values["parameters"])
            values["observables"] = json.loads(values["observables"])
            Outcome(values["outcome"])
            if not all(isinstance(values[name], kind) for name, kind in KEPT_AS.items()):
                raise TypeError
        except (TypeError, ValueError, RecursionError):
            key = str(values["key"])[:12]
            raise StoreError(
                f"{self.path}: run {key}: its parameters, outcome, readings or raw pour cannot be read"
            ) from None
        return StoredRun(**values)

    def runs(self, study: str | None = None) -> Iterator[StoredRun]:
        """Yield all runs, or those of one study, oldest first; their readings are as stored, of whichever version."""
        where, arguments = ("WHERE study = ?", (study,)) if study else ("", ())
        columns = _COLUMNS if self._table == "pours" else _COLUMNS_BEFORE_RAW_POURS
        with self._told():
            rows = self._db.execute(f"SELECT {columns} FROM {self._table} {where} ORDER BY created", arguments)
            yield from map(self._from_row, rows)

    def close(self) -> None:
        """Close the file."""
        self._db.close()


_NAMES = [field.name for field in dataclasses.fields(StoredRun)]
_COLUMNS = ", ".join(_NAMES)
_ABSENT = {"physics": "0 AS physics", "readings": "0 AS readings", "raw": "x'' AS raw"}
_COLUMNS_BEFORE_RAW_POURS = ", ".join(_ABSENT.get(name, name) for name in _NAMES)


def write_csv(runs: Iterable[StoredRun], file: IO[str]) -> int:
    """Write runs as CSV, one column per parameter and observable that occurs; returns the number of rows."""
    # Raw pours take a hundred times as much memory as the data written.
    rows = [dataclasses.replace(run, raw=b"") for run in runs]
    parameters = sorted({name for run in rows for name in run.parameters})
    observables = sorted({name for run in rows for name in run.observables})
    fixed = ["study", "stage", "label", "seed", "outcome", "message", "dt", "steps", "wall_s", "physics", "readings"]
    writer = csv.writer(file)
    writer.writerow([*fixed, *parameters, *observables])
    for run in rows:
        cells = [getattr(run, name) for name in fixed]
        cells += [run.parameters.get(name, "") for name in parameters]
        values = [run.observables.get(name) for name in observables]
        writer.writerow([*cells, *("" if value is None else value for value in values)])
    return len(rows)
