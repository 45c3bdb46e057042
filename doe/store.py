"""The store: every run that finished, kept in one SQLite file and found again by what was run.

The key of a run is a digest of the whole scene, the seed and the code version, so a stored run is reused exactly
when repeating it would give the same bits.
"""

from __future__ import annotations

import csv
import dataclasses
import hashlib
import json
import os
import sqlite3
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import platformdirs

SCHEMA = """
CREATE TABLE IF NOT EXISTS runs (
    key TEXT PRIMARY KEY, created REAL NOT NULL, study TEXT NOT NULL, stage TEXT NOT NULL, label TEXT NOT NULL,
    seed INTEGER NOT NULL, code_version TEXT NOT NULL, outcome TEXT NOT NULL, message TEXT NOT NULL,
    parameters TEXT NOT NULL, observables TEXT NOT NULL, dt REAL NOT NULL, steps INTEGER NOT NULL, wall_s REAL NOT NULL
)
"""


class StoreError(ValueError):
    """The store cannot be used; the message is one line, fit for a user."""


@dataclass(frozen=True)
class StoredRun:
    """One finished run. ``parameters`` holds every parameter of the scene, ``observables`` their values (None: NaN)."""

    key: str
    study: str
    stage: str
    label: str
    seed: int
    code_version: str
    outcome: str
    message: str
    parameters: dict[str, Any]
    observables: dict[str, float | None]
    dt: float
    steps: int
    wall_s: float
    created: float = 0.0


def default_store() -> Path:
    """``$REPOSE_STORE``, or ``runs.sqlite`` in the user's data directory."""
    named = os.environ.get("REPOSE_STORE")
    return Path(named) if named else Path(platformdirs.user_data_dir("repose-explorer")) / "runs.sqlite"


def run_key(scene: Any, seed: int, code_version: str) -> str:
    """Digest of a frozen scene (all its fields, mesh files by content), seed and code version."""
    content = (type(scene.rig).__name__, dataclasses.asdict(scene))
    meshes = [Path(body.shape.file) for body in scene.bodies if getattr(body.shape, "file", "")]
    meshes += [scene.rig.mesh_file] if hasattr(scene.rig, "mesh_file") else []
    digest = hashlib.sha256(repr((content, seed, code_version)).encode())
    for mesh in meshes:
        digest.update(mesh.read_bytes())
    return digest.hexdigest()


class Store:
    """Runs in a SQLite file; several processes may read and write at once."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._db = sqlite3.connect(path, timeout=60.0)
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute(SCHEMA)
            self._db.commit()
        except (sqlite3.Error, OSError) as error:
            raise StoreError(f"{path}: cannot be used as a store of runs ({error})") from None

    def find(self, key: str) -> StoredRun | None:
        """The run with that key, or None."""
        row = self._db.execute(f"SELECT {_COLUMNS} FROM runs WHERE key = ?", (key,)).fetchone()
        return _from_row(row) if row else None

    def add(self, run: StoredRun) -> None:
        """Keep a run; on disk when this returns."""
        values = dataclasses.asdict(run)
        values["parameters"] = json.dumps(run.parameters, sort_keys=True)
        values["observables"] = json.dumps(run.observables, sort_keys=True)
        values["created"] = time.time()
        names = [field.name for field in dataclasses.fields(StoredRun)]
        marks = ", ".join("?" for _ in names)
        with self._db:
            self._db.execute(f"INSERT OR REPLACE INTO runs ({_COLUMNS}) VALUES ({marks})", [values[n] for n in names])

    def runs(self, study: str | None = None) -> Iterator[StoredRun]:
        """All runs, oldest first; of one study if named."""
        where, arguments = ("WHERE study = ?", (study,)) if study else ("", ())
        for row in self._db.execute(f"SELECT {_COLUMNS} FROM runs {where} ORDER BY created", arguments):
            yield _from_row(row)

    def close(self) -> None:
        """Close the file."""
        self._db.close()


_COLUMNS = ", ".join(field.name for field in dataclasses.fields(StoredRun))


def _from_row(row: tuple[Any, ...]) -> StoredRun:
    values = dict(zip([field.name for field in dataclasses.fields(StoredRun)], row, strict=True))
    values["parameters"] = json.loads(values["parameters"])
    values["observables"] = json.loads(values["observables"])
    return StoredRun(**values)


def write_csv(runs: Iterator[StoredRun], file: IO[str]) -> int:
    """Write runs as CSV, one column per parameter and observable that occurs; returns the number of rows."""
    rows = list(runs)
    parameters = sorted({name for run in rows for name in run.parameters})
    observables = sorted({name for run in rows for name in run.observables})
    fixed = ["study", "stage", "label", "seed", "outcome", "message", "dt", "steps", "wall_s", "code_version"]
    writer = csv.writer(file)
    writer.writerow([*fixed, *parameters, *observables])
    for run in rows:
        cells = [getattr(run, name) for name in fixed]
        cells += [run.parameters.get(name, "") for name in parameters]
        values = [run.observables.get(name) for name in observables]
        writer.writerow([*cells, *("" if value is None else value for value in values)])
    return len(rows)
