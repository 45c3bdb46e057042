"""One recording: a pour as moving bodies, curves, events and parameters in a ``.rrd`` file.

    world/bodies/<component>    the mesh once, then one pose per body that is in the domain, per frame, in the order of
                                entry; Departed:left are the places in that order of those that have left
    world/plate, world/cone …   the rig, and where its surfaces are when they move; world/gate while it is shut
    curves/<plot>/<name>        scalars, the unit in the name
    log                         events
    parameters, outcome         Markdown: what was poured, and what came out
    scene                       the scene at the beginning, as the text of a material file

Timelines: ``sim_time`` [s] and ``step``. Poses are single precision: an f32 position of 0.1 m resolves 7 nm.
A recording of several pours has each of them below an entity of its own (`explorer.recordings.answer_recording`).
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self

import numpy as np
import numpy.typing as npt
import pyarrow as pa  # type: ignore[import-untyped]
import rerun as rr
import rerun.blueprint as rrb

from explorer.files.output_file import check_new_file
from explorer.files.run_result import parameter_values, versions
from explorer.recordings.blueprint import CURVES, TIMELINE, blueprint, curve_entity
from explorer.recordings.recording import RunningViewer
from explorer.scene.meshes import (
    GATE_NAME,
    PLATE_NAME,
    Triangles,
    body_triangles,
    rig_poses,
    rig_triangles,
    scene_height,
)
from explorer.scene.text import material_toml
from explorer.viewer.palette import GLASS, PLATE, component_colour
from solver import Scene, actual
from solver.observables import Value

APPLICATION = "repose-explorer"
FLUSH_INTERVAL = 1.0
"""Wall time [s] after which what was logged is written out: a killed program loses no more than this."""
PLATE_COLOUR, CONE_COLOUR = (*PLATE, 255), (*GLASS, 70)
"""RGBA, 0 … 255; the colours of the page, all but the plate as if of glass."""
EYE = 2.3
"""Distance of the eye from the outlet, in heights of the scene."""
IN_PLACE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""Pose of a surface that nobody has placed."""


class Poses(Protocol):
    """State of the n bodies that have entered; `solver.Bodies` and a live frame are such."""

    @property
    def component(self) -> npt.NDArray[np.int32]:
        """Index into ``scene.bodies``, shape (n,)."""

    @property
    def position(self) -> npt.NDArray[np.floating]:
        """Centres of mass [m], shape (n, 3)."""

    @property
    def quaternion(self) -> npt.NDArray[np.floating]:
        """Orientation of the principal frame, wxyz, shape (n, 4)."""

    @property
    def inside(self) -> npt.NDArray[np.bool_]:
        """False for bodies that were taken out of the domain, shape (n,)."""

    @property
    def scale(self) -> npt.NDArray[np.floating]:
        """Linear size relative to the declared one, shape (n,)."""


def opened(to: Path | RunningViewer, layout: rrb.Blueprint) -> rr.RecordingStream:
    """A stream into a new file ``to``, or to a viewer, that opens as ``layout`` says.

    Raises :class:`explorer.errors.CommandError` if the file exists, has another suffix or no folder to be in.
    """
    if isinstance(to, Path):
        check_new_file(to, suffix=".rrd")
    # Otherwise rerun drops bad data with no more than a warning.
    rr.set_strict_mode(True)
    stream = rr.RecordingStream(APPLICATION)
    stream.set_sinks(rr.FileSink(str(to)) if isinstance(to, Path) else rr.GrpcSink(to.url))
    stream.send_blueprint(layout)
    return stream


class PourLog:
    """Writes one pour. Use as a context manager, or end with :meth:`close`.

    ``to``: a new file or a viewer, as :func:`opened` takes them, or an open stream, in which the entities of the pour
    stand below ``under`` ("corrected/") and which is left open.
    """

    def __init__(self, to: Path | RunningViewer | rr.RecordingStream, scene: Scene, seed: int, under: str = "") -> None:
        self._scene, self._under = scene, under
        self._bodies = actual(scene).bodies
        """What is drawn: effects of the set-up change their shapes and sizes."""
        self._shown: set[int] = set()
        self._left: dict[int, npt.NDArray[np.int32]] = {}
        self._gate_shown = False
        self._poses = rig_poses(scene.rig)
        self._placed = np.tile(IN_PLACE, (len(self._poses), 1))
        self._borrowed = isinstance(to, rr.RecordingStream)
        self._stream = to if isinstance(to, rr.RecordingStream) else opened(to, blueprint(EYE * scene_height(scene)))
        self._static(seed)
        self.flush()

    def frame(
        self,
        time: float,
        poses: Poses,
        curves: Mapping[str, float],
        *,
        step: int | None = None,
        gate_shut: bool = False,
        surfaces: npt.NDArray[np.float64] | None = None,
    ) -> None:
        """Log the state at ``time`` [s]; ``curves`` by the names of ``CURVES``, leaving out NaN.

        ``surfaces``: poses of the rig's surfaces, as in ``rig_poses``; None: as they were.
        """
        self._at(time, step)
        for k in range(len(self._bodies)):
            self._component(k, poses)
        self._gate(gate_shut)
        self._surfaces(self._poses if surfaces is None or not len(surfaces) else surfaces)
        for curve in CURVES:
            number = curves.get(curve.name, np.nan)
            if np.isfinite(number):
                self._log(curve_entity(curve), rr.Scalars(number))
        if clock.perf_counter() - self._flushed >= FLUSH_INTERVAL:
            self.flush()

    def event(self, time: float, text: str, *, step: int | None = None, level: str = "INFO") -> None:
        """Log something that happened at ``time`` [s]."""
        self._at(time, step)
        self._log("log", rr.TextLog(text, level=level))

    def outcome(self, time: float, text: str, observed: Mapping[str, Value], *, step: int | None = None) -> None:
        """Log how the pour ended and what was read off its pile."""
        self.event(time, text, step=step)
        document = outcome_document(text, observed)
        self._log("outcome", rr.TextDocument(document, media_type="text/markdown"))

    def flush(self) -> None:
        """Write out what was logged so far: from here on it survives the end of the program."""
        self._stream.flush()
        self._flushed = clock.perf_counter()

    def close(self) -> None:
        """Write out the rest and end the file."""
        self._stream.flush()
        if not self._borrowed:
            self._stream.disconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _static(self, seed: int) -> None:
        self._log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        document = parameters_document(self._scene, seed)
        self._log("parameters", rr.TextDocument(document, media_type="text/markdown"), static=True)
        self._log("scene", rr.TextDocument(material_toml(self._scene)), static=True)
        for curve in CURVES:
            self._log(curve_entity(curve), rr.SeriesLines(names=curve.name), static=True)
        self._rig = rig_triangles(self._scene.rig)
        for name, triangles in self._rig.items():
            if name != GATE_NAME:
                colour = PLATE_COLOUR if name == PLATE_NAME else CONE_COLOUR
                self._log(f"world/{name}", mesh(triangles, colour), static=True)

    def _log(self, entity: str, what: rr.AsComponents, static: bool = False) -> None:
        self._stream.log(self._under + entity, what, static=static)

    def _at(self, time: float, step: int | None) -> None:
        self._stream.set_time(TIMELINE, duration=time)
        if step is not None:
            self._stream.set_time("step", sequence=step)

    def _component(self, k: int, poses: Poses) -> None:
        """Poses of component ``k``.

        Its mesh is there only while it has bodies: the viewer draws a mesh without poses where it is.
        """
        body = self._bodies[k]
        entity = f"world/bodies/{rr.escape_entity_path_part(body.name)}"
        mine = poses.component == k
        chosen = mine & poses.inside
        if not chosen.any():
            if k in self._shown:
                self._log(entity, rr.Clear(recursive=False))
                self._shown.remove(k)
            return
        if k not in self._shown:
            colour = component_colour(k)
            self._log(entity, mesh(body_triangles(body), (*colour, 255)))
            self._shown.add(k)
        self._departed(k, entity, np.flatnonzero(~poses.inside[mine]).astype(np.int32))
        # wxyz here, xyzw in rerun
        turned = poses.quaternion[chosen][:, [1, 2, 3, 0]].astype(np.float32)
        self._log(
            entity,
            rr.InstancePoses3D(
                translations=poses.position[chosen].astype(np.float32),
                quaternions=turned,
                scales=np.repeat(poses.scale[chosen, None], 3, axis=1).astype(np.float32)
                if body.sizes.varies
                else None,
            ),
        )

    def _departed(self, k: int, entity: str, left: npt.NDArray[np.int32]) -> None:
        """Say who is missing among the poses: without it nobody could tell which body a pose belongs to."""
        if k not in self._left or not np.array_equal(left, self._left[k]):
            self._left[k] = left
            # Typed: rerun drops an empty list of no type.
            self._log(entity, rr.DynamicArchetype("Departed", components={"left": pa.array(left)}))

    def _gate(self, shut: bool) -> None:
        if GATE_NAME not in self._rig:
            return
        if shut and not self._gate_shown:
            self._log(f"world/{GATE_NAME}", mesh(self._rig[GATE_NAME], PLATE_COLOUR))
        elif self._gate_shown and not shut:
            self._log(f"world/{GATE_NAME}", rr.Clear(recursive=False))
        self._gate_shown = shut

    def _surfaces(self, poses: npt.NDArray[np.float64]) -> None:
        """Place the surfaces that have moved since they were placed last."""
        for name, pose, before in zip(self._scene.rig.surface_names, poses, self._placed, strict=True):
            if not np.array_equal(pose, before):
                # wxyz here, xyzw in rerun
                turned = rr.Quaternion(xyzw=pose[[4, 5, 6, 3]])
                self._log(f"world/{name}", rr.Transform3D(translation=pose[:3], quaternion=turned))
        self._placed = self._poses = poses


def mesh(triangles: Triangles, colour: tuple[int, int, int, int]) -> rr.Mesh3D:
    """``triangles`` in one colour, RGBA 0 … 255."""
    return rr.Mesh3D(
        vertex_positions=triangles.vertices,
        vertex_normals=triangles.normals,
        triangle_indices=triangles.faces,
        albedo_factor=colour,
    )


def parameters_document(scene: Scene, seed: int) -> str:
    """Title, seed, versions, and every parameter in SI."""
    made_with = ", ".join(f"{name} {version or '(not installed)'}" for name, version in versions().items())
    lines = [
        f"# {scene.title}",
        "",
        f"Seed {seed}; {made_with}.",
        "",
        "| parameter | value | unit |",
        "|-|-|-|",
    ]
    for path, entry in parameter_values(scene).items():
        shown = entry.value if isinstance(entry.value, str) else f"{entry.value:.6g}"
        lines.append(f"| {path} | {shown} | {entry.unit} |")
    return "\n".join(lines)


def outcome_document(text: str, observed: Mapping[str, Value]) -> str:
    """The outcome, and every observable that could be measured; spread: within the pile."""
    lines = [f"# {text}", "", "| observable | value | spread | unit |", "|-|-|-|-|"]
    for name, entry in observed.items():
        if math.isfinite(entry.value):
            spread = "" if entry.spread is None else f"{entry.spread:.3g}"
            lines.append(f"| {name} | {entry.value:.5g} | {spread} | {entry.unit} |")
    return "\n".join(lines)
