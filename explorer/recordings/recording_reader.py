"""A recording read back, as `pour_log` wrote it.

A file of a killed writer, or one that is cut off, is read up to the last frame that was written out.
"""

from __future__ import annotations

import os
import re
import struct
import subprocess
import sys
import tempfile
import tomllib
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa  # type: ignore[import-untyped]
from rerun.chunk import Chunk, RrdReader

from explorer.errors import CommandError
from explorer.recordings.blueprint import CURVES, TIMELINE, curve_entity
from explorer.recordings.recording import (
    BODIES,
    NOBODY,
    WORLD,
    Component,
    Instances,
    RecordedSurface,
    Recording,
    Shape,
    index_at,
)
from explorer.recordings.replay import check_recording
from solver.scenes.material_file import scene_from
from solver.scenes.scene import Scene

FILE_HEADER, MESSAGE, END_OF_FILE = 12, struct.Struct("<QQ"), 0
"""Of rerun's files: bytes before the first message, kind and length before every one, the kind of the last one."""
TRIAL = "import sys; from rerun.chunk import RrdReader; list(RrdReader(sys.argv[1]).stream())"
ESCAPED = re.compile(r"\\u\{([0-9A-Fa-f]+)\}|\\(.)")
"""How a letter stands in an entity's path that has a meaning there."""
CONTROLS = {"n": "\n", "r": "\r", "t": "\t"}
Array = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]


@dataclass(frozen=True)
class _Rows:
    """Rows of one component of one entity: time [s] (−∞ where static) and the Arrow value."""

    times: Array
    values: pa.Array


def read_recording(path: Path, under: str = "") -> Recording:
    """Read ``path``; of several pours in it the one below the entity ``under`` ("corrected").

    Raises :class:`CommandError` where it is no recording of a pour, in one line.
    """
    check_recording(path)
    try:
        return _recording(path, _below(under, _columns(path)))
    except CommandError:
        raise
    except Exception as error:  # of several kinds: a file that is cut within a chunk, or that another program wrote
        why = next(iter(str(error).splitlines()), type(error).__name__)
        raise CommandError(f"{path}: cannot be read as a recording: {why}") from None


def _recording(path: Path, found: Mapping[str, dict[str, _Rows]]) -> Recording:
    """What the entities of ``path`` hold. Raises CommandError where they have no bodies."""
    components = tuple(_component(name, found[name]) for name in found if name.startswith(BODIES))
    surfaces = tuple(
        _surface(name, columns)
        for name, columns in found.items()
        if name.startswith(WORLD) and not name.startswith(BODIES) and "Mesh3D:vertex_positions" in columns
    )
    times = np.unique(np.concatenate([np.zeros(0), *(c.times for c in components)]))
    if not len(times):
        raise CommandError(f"{path}: holds no bodies; a recording of a pour is needed")
    entities = {curve.name: f"/{curve_entity(curve)}" for curve in CURVES}
    curves = {
        name: _curve(found[entity]) for name, entity in entities.items() if "Scalars:scalars" in found.get(entity, {})
    }
    log = found.get("/log", {}).get("TextLog:text")
    events = [] if log is None else list(zip(log.times.tolist(), _texts(log), strict=True))
    return Recording(
        times,
        components,
        surfaces,
        curves,
        tuple(events),
        _document(found, "/parameters"),
        _document(found, "/outcome"),
        _scene(_document(found, "/scene"), {component.shape.name for component in components}),
    )


def _scene(text: str, poured: set[str]) -> Scene | None:
    """The scene that ``text`` (TOML) declares.

    None where there is none, or none that can be read: a mesh that is a file elsewhere, a key of another version.
    """
    try:
        scene = scene_from(tomllib.loads(text), Path("scene.toml")) if text else None
    except (ValueError, OSError):
        return None
    return scene if scene is not None and poured <= {body.name for body in scene.bodies} else None


def _below(under: str, found: Mapping[str, dict[str, _Rows]]) -> dict[str, dict[str, _Rows]]:
    """The entities below ``under``, named as if it were the root."""
    root = f"/{under}" if under else ""
    return {name.removeprefix(root): columns for name, columns in found.items() if name.startswith(f"{root}/")}


def _columns(path: Path) -> dict[str, dict[str, _Rows]]:
    """Entity → component → rows, in order of time, and of writing where times are equal."""
    parts: dict[str, dict[str, list[_Rows]]] = {}
    for chunk in _chunks(path):
        batch = chunk.to_record_batch()
        times = _times(batch, chunk.is_static)
        if times is None:
            continue
        for field, column in zip(batch.schema, batch.columns, strict=True):
            if ":" in field.name:
                there = np.asarray(column.is_valid())
                rows = _Rows(times[there], column.filter(pa.array(there)))
                parts.setdefault(chunk.entity_path, {}).setdefault(field.name, []).append(rows)
    return {
        entity: {name: _joined(rows) for name, rows in columns.items()} for entity, columns in sorted(parts.items())
    }


def _chunks(path: Path) -> list[Chunk]:
    """The chunks of ``path``; of a file that ends within a message those before it, which rerun's reader refuses."""
    with warnings.catch_warnings():
        # A file that nobody closed.
        warnings.filterwarnings("ignore", "RRD file has no footer")
        try:
            return _read(path)
        except RuntimeError:
            whole = _whole_messages(path)
            if not whole:
                raise
        with tempfile.TemporaryDirectory(prefix="explorer-recording-") as folder:
            kept = Path(folder) / path.name
            kept.write_bytes(whole)
            return _read(kept)


def _read(path: Path) -> list[Chunk]:
    """What rerun's reader gives. Raises RuntimeError where it refuses ``path``, or would end the process over it.

    Of a damaged file it may ask for more memory than there is, or panic, and either aborts: so a process of its own
    reads the file first, 0.3 s and the time of reading it.
    """
    # What this process imports, that one can, also from a source tree.
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-P", "-c", TRIAL, str(path)]
    if subprocess.run(command, env=environment, capture_output=True).returncode < 0:
        raise RuntimeError("it is damaged")
    return list(RrdReader(str(path)).stream())


def _whole_messages(path: Path) -> bytes:
    """``path`` up to the end of its last whole message, without that which ends the file; empty where there is none."""
    content, end = path.read_bytes(), FILE_HEADER
    while end + MESSAGE.size <= len(content):
        kind, length = MESSAGE.unpack_from(content, end)
        if kind == END_OF_FILE or end + MESSAGE.size + length > len(content):
            break
        end += MESSAGE.size + length
    return content[:end] if end > FILE_HEADER else b""


def _times(batch: pa.RecordBatch, static: bool) -> Array | None:
    if static:
        return np.full(batch.num_rows, -np.inf)
    if TIMELINE not in batch.schema.names:
        return None
    column = batch.column(batch.schema.names.index(TIMELINE))
    return np.asarray(column.cast(pa.int64()).to_numpy(zero_copy_only=False), dtype=np.float64) * 1e-9


def _joined(rows: list[_Rows]) -> _Rows:
    times = np.concatenate([one.times for one in rows])
    order = np.argsort(times, kind="stable")
    values = pa.concat_arrays([one.values for one in rows])
    return _Rows(times[order], values.take(pa.array(order)))


def _component(entity: str, columns: Mapping[str, _Rows]) -> Component:
    moved = columns.get("InstancePoses3D:translations")
    events: list[tuple[float, Instances]] = []
    if moved is not None:
        positions = _blocks(moved, 3)
        turns = _blocks(columns["InstancePoses3D:quaternions"], 4)
        scales = columns.get("InstancePoses3D:scales")
        sizes = [np.ones(len(p), dtype=np.float32) for p in positions]
        if scales is not None and len(scales.times) == len(moved.times):
            sizes = [block[:, 0] for block in _blocks(scales, 3)]
        # xyzw in rerun, wxyz here
        events = [
            (float(time), Instances(p, q[:, [3, 0, 1, 2]], s, place))
            for time, p, q, s, place in zip(
                moved.times, positions, turns, sizes, _places(moved.times, sizes, columns), strict=True
            )
        ]
    cleared = columns.get("Clear:is_recursive")
    events += [] if cleared is None else [(float(time), NOBODY) for time in cleared.times]
    events.sort(key=lambda event: event[0])
    return Component(
        _shape(_plain(entity.removeprefix(BODIES)), columns),
        np.array([time for time, _ in events]),
        tuple(instances for _, instances in events),
    )


def _plain(part: str) -> str:
    """A name as it was before it became a part of an entity's path."""

    def letter(found: re.Match[str]) -> str:
        return chr(int(found[1], 16)) if found[1] else CONTROLS.get(found[2], found[2])

    return ESCAPED.sub(letter, part)


def _places(
    times: Array, sizes: list[Floats], columns: Mapping[str, _Rows]
) -> list[npt.NDArray[np.int64]] | list[None]:
    """Places of the bodies of each frame in the order of entry: those that have not left."""
    departed = columns.get("Departed:left")
    if departed is None:
        return [None] * len(times)
    left = [np.array(one, dtype=np.int64) for one in departed.values.to_pylist()]
    gone = (left[index_at(departed.times, time) or 0] for time in times)
    return [np.delete(np.arange(len(size) + len(away)), away) for size, away in zip(sizes, gone, strict=True)]


def _surface(entity: str, columns: Mapping[str, _Rows]) -> RecordedSurface:
    there, gone = columns["Mesh3D:vertex_positions"].times, columns.get("Clear:is_recursive")
    switches = sorted([(t, True) for t in there] + [(t, False) for t in (() if gone is None else gone.times)])
    placed = columns.get("Transform3D:translation")
    times, poses = np.zeros(0), np.zeros((0, 7))
    if placed is not None:
        turned = np.concatenate(_blocks(columns["Transform3D:quaternion"], 4))
        times = placed.times
        poses = np.concatenate([np.concatenate(_blocks(placed, 3)), turned[:, [3, 0, 1, 2]]], axis=1)
    return RecordedSurface(
        _shape(entity.removeprefix(WORLD), columns),
        times,
        poses.astype(np.float64),
        np.array([time for time, _ in switches]),
        np.array([seen for _, seen in switches]),
    )


def _shape(name: str, columns: Mapping[str, _Rows]) -> Shape:
    rgba = int(columns["Mesh3D:albedo_factor"].values[0].as_py()[0])
    red, green, blue, alpha = rgba.to_bytes(4, "big")
    return Shape(
        name,
        _blocks(columns["Mesh3D:vertex_positions"], 3)[0],
        _blocks(columns["Mesh3D:triangle_indices"], 3)[0],
        (red, green, blue),
        alpha / 255.0,
    )


def _curve(columns: Mapping[str, _Rows]) -> tuple[Array, Array]:
    rows = columns["Scalars:scalars"]
    return rows.times, np.asarray(rows.values.flatten().to_numpy(zero_copy_only=False), dtype=np.float64)


def _document(found: Mapping[str, Mapping[str, _Rows]], entity: str) -> str:
    rows = found.get(entity, {}).get("TextDocument:text")
    return "" if rows is None else list(_texts(rows))[-1]


def _texts(rows: _Rows) -> Iterator[str]:
    return (str(value[0]) for value in rows.values.to_pylist())


def _blocks(rows: _Rows, width: int) -> list[Any]:
    """The rows of a list of vectors, shape (n, ``width``) each."""
    flat = rows.values.flatten().flatten().to_numpy(zero_copy_only=False).reshape(-1, width)
    lengths = rows.values.value_lengths().to_numpy(zero_copy_only=False)
    return np.split(flat, np.cumsum(lengths)[:-1]) if len(lengths) else []
