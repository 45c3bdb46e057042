"""A pour as VTK files (.vtu, unstructured grids) for ParaView: bodies, true shapes, member spheres, contacts, rig.

Each file is a set of points with numbers, in SI. Several moments give one file each, and one collection (.pvd) per kind
of file, which ParaView opens as an animation. meshio, an optional extra, writes the files.
"""

from __future__ import annotations

import importlib
import xml.etree.ElementTree as ET
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from explorer.errors import CommandError
from explorer.export.target import ExportOrder, ExportTarget
from explorer.outcomes import outcome_text
from explorer.scene.meshes import GATE_NAME, Triangles, body_triangles, rig_triangles
from solver import Bodies, Record, Scene, Spheres
from solver.pours.contacts import Contacts, loads
from solver.pours.record import Outcome
from solver.pours.record_builder import member_spheres
from solver.rigs import Rig
from solver.scenes.insertion import rotation_matrix

if TYPE_CHECKING:
    from solver import Job
    from solver.pours.pour import Pour

Array = npt.NDArray[np.float64]
Numbers = Mapping[str, npt.NDArray[Any]]
Grid = tuple[Array, str, npt.NDArray[Any], Numbers, Numbers]
"""Points (n, 3) [m], type of the cells, points of the cells, numbers per point, numbers per cell."""
MOST = 2000
"""Most moments of one pour that are kept in memory."""

README = """\
{title}
Seed {seed}, {outcome} after {time:.4g} s. {moments} moment(s). SI units throughout; z is up.

bodies     a point per body at its centre of mass: body (order of entry), component, mass [kg], scale (size relative to
           the declared one), velocity [m/s], quaternion (wxyz of the principal frame), load (sum of normal forces [N])
shapes     triangles of the true shapes: body, component
spheres    a point per member sphere: radius [m], body, component. In ParaView: Representation > Point Gaussian, or
           Glyph > Sphere with Scale Array = radius, Scale Factor = 2
contacts   a point per contact: body, partner (another body, or -1 - index of a surface of the rig), force on the body,
           normal_force, tangential_force [N], normal (from the partner to the body). Left out where nothing touches.
           Glyph > Arrow with Orientation Array = force shows them
rig        triangles of the rig's surfaces: surface

components {components}
surfaces   {surfaces}
"""


@dataclass(frozen=True)
class PourState:
    """Bodies, their member spheres and contacts at one time, and the poses of the rig's surfaces then."""

    time: float
    """[s]."""
    bodies: Bodies
    spheres: Spheres
    contacts: Contacts
    poses: Array
    """Poses of the surfaces: origin [m] and orientation wxyz, shape (k, 7)."""
    gate_shut: bool
    """Whether the rig is still being filled."""


def moments(scene: Scene, seed: int, every: float | None) -> tuple[tuple[PourState, ...], Record]:
    """Run a pour to its end: a moment every ``every`` s (up to the next sample of its curves), and the last moment.

    With ``every`` None, only the last moment. Raises CommandError for more than ``MOST`` moments.
    """
    numerics = scene.numerics
    longest = numerics.duration or numerics.max_time
    # A moment comes with a sample of the curves, so never more often than those.
    if every is not None and longest > MOST * max(every, numerics.sample_interval):
        raise CommandError(f"--every {every:g}: more than {MOST} moments of a pour of up to {longest:g} s")
    # Imported here because it loads Taichi, which merely naming a target does not need.
    from solver import Job, run_queue

    found: list[PourState] = []
    last: list[PourState] = []

    def look(_: Job, pour: Pour) -> None:
        due = every is not None and pour.time >= len(found) * every - 1e-9
        over = pour.steps_due() == 0
        if due or over:
            moment = _moment(pour)
            (found if due else last).append(moment)

    ((_, record),) = run_queue(deque([Job(scene, seed)]), [scene], threads=1, worlds=1, on_sample=look)
    return (*found, *last), record


def _moment(pour: Pour) -> PourState:
    bodies = pour.bodies()
    spheres = member_spheres(pour.scene, bodies)
    return PourState(pour.time, bodies, spheres, pour.contacts(), pour.surface_poses().copy(), pour.gate_shut)


class Paraview(ExportTarget):
    """ParaView as a target of an export."""

    name, what = "paraview", "shapes and contacts as VTK"
    options = ("every",)
    extra = "paraview"

    def check(self, scene: Scene) -> None:
        """Raise :class:`CommandError` if the library that writes VTK files is missing."""
        _meshio()

    def write(self, folder: Path, order: ExportOrder) -> str:
        """Run the pour, and write its moments."""
        seen, record = moments(order.scene, order.seed, order.every)
        write_paraview(folder, record.scene, seen, order.seed, str(record.outcome))
        last = f"the last at {seen[-1].time:.4g} s"
        if order.time is not None and record.outcome != Outcome.TIME_LIMIT:
            last += f", where the pour ended before --time {order.time:g} ({outcome_text(record.outcome)})"
        return f"{len(seen)} moment(s), {last}; what is in them: README.txt"


PARAVIEW = Paraview()


def write_paraview(folder: Path, scene: Scene, seen: tuple[PourState, ...], seed: int, outcome: str) -> None:
    """Write the files of all moments, collections of them if there are several, and a README into a folder."""
    names: dict[str, list[tuple[float, str]]] = {}
    for k, moment in enumerate(seen):
        for kind, make in KINDS.items():
            grid = make(scene, moment)
            if len(grid[2]):
                name = f"{kind}.vtu" if len(seen) == 1 else f"{kind}_{k:04d}.vtu"
                _write(folder / name, grid)
                names.setdefault(kind, []).append((moment.time, name))
    if len(seen) > 1:
        for kind, files in names.items():
            (folder / f"{kind}.pvd").write_text(collection(files), encoding="utf-8")
    text = README.format(
        title=scene.title,
        seed=seed,
        outcome=outcome,
        time=seen[-1].time,
        moments=len(seen),
        components=_numbered(tuple(body.name for body in scene.bodies)),
        surfaces=_numbered(scene.rig.surface_names),
    )
    (folder / "README.txt").write_text(text, encoding="utf-8")


def collection(files: list[tuple[float, str]]) -> str:
    """A ParaView collection: (time [s], name of a file beside it)."""
    root = ET.Element("VTKFile", type="Collection", version="0.1")
    table = ET.SubElement(root, "Collection")
    for time, name in files:
        ET.SubElement(table, "DataSet", timestep=f"{time:.9g}", part="0", file=name)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def body_grid(scene: Scene, moment: PourState) -> Grid:
    """A point per body in the domain."""
    bodies = moment.bodies
    inside = np.flatnonzero(bodies.inside)
    force = loads(moment.contacts, len(bodies.mass))
    numbers: Numbers = {
        "body": inside,
        "component": bodies.component[inside],
        "mass": bodies.mass[inside],
        "scale": bodies.scale[inside],
        "velocity": bodies.velocity[inside],
        "quaternion": bodies.quaternion[inside],
        "load": force[inside],
    }
    return bodies.position[inside], "vertex", _vertices(len(inside)), numbers, {}


def shape_grid(scene: Scene, moment: PourState) -> Grid:
    """Triangles of the true shapes of all bodies in the domain, at their places."""
    shapes = [body_triangles(body) for body in scene.bodies]
    bodies = moment.bodies
    parts = []
    for k in np.flatnonzero(bodies.inside):
        shape = shapes[bodies.component[k]]
        turn = rotation_matrix(bodies.quaternion[k])
        parts.append((bodies.position[k] + float(bodies.scale[k]) * _corners(shape) @ turn.T, shape.faces, int(k)))
    points, faces, owners = _joined(parts)
    return points, "triangle", faces, {}, {"body": owners, "component": bodies.component[owners]}


def sphere_grid(scene: Scene, moment: PourState) -> Grid:
    """A point per member sphere."""
    spheres = moment.spheres
    owner = moment.bodies.component[spheres.body]
    numbers: Numbers = {"radius": spheres.radius, "body": spheres.body, "component": owner}
    return spheres.centre, "vertex", _vertices(len(spheres.radius)), numbers, {}


def contact_grid(scene: Scene, moment: PourState) -> Grid:
    """A point per contact."""
    contacts = moment.contacts
    numbers: Numbers = {
        "body": contacts.body,
        "partner": contacts.partner,
        "force": contacts.force,
        "normal": contacts.normal,
        "normal_force": contacts.normal_force,
        "tangential_force": contacts.tangential_force,
    }
    return contacts.point, "vertex", _vertices(len(contacts.body)), numbers, {}


def rig_grid(scene: Scene, moment: PourState) -> Grid:
    """Triangles of the rig's surfaces at their places, without an open gate; infinite planes end near the rest."""
    rig: Rig = scene.rig
    surfaces, parts = rig_triangles(rig), []
    for index, name in enumerate(rig.surface_names):
        if name == GATE_NAME and not moment.gate_shut:
            continue
        pose = moment.poses[index]
        parts.append((pose[:3] + _corners(surfaces[name]) @ rotation_matrix(pose[3:]).T, surfaces[name].faces, index))
    points, faces, owners = _joined(parts)
    return points, "triangle", faces, {}, {"surface": owners}


KINDS: dict[str, Callable[[Scene, PourState], Grid]] = {
    "bodies": body_grid,
    "shapes": shape_grid,
    "spheres": sphere_grid,
    "contacts": contact_grid,
    "rig": rig_grid,
}
"""Stem of a file → function that makes its content."""


def _write(path: Path, grid: Grid) -> None:
    points, kind, cells, at_points, at_cells = grid
    mesh = _meshio().Mesh(
        np.ascontiguousarray(points, dtype=np.float64),
        [(kind, np.ascontiguousarray(cells, dtype=np.int64))],
        point_data={name: np.ascontiguousarray(_wide(values)) for name, values in at_points.items()},
        cell_data={name: [np.ascontiguousarray(_wide(values))] for name, values in at_cells.items()},
    )
    mesh.write(path, file_format="vtu")


def _wide(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Whole numbers as 32 bits, which every VTK reader supports."""
    return values.astype(np.int32) if np.issubdtype(values.dtype, np.integer) else values.astype(np.float64)


def _corners(shape: Triangles) -> Array:
    return shape.vertices.astype(np.float64)


def _joined(parts: list[tuple[Array, npt.NDArray[Any], int]]) -> tuple[Array, npt.NDArray[Any], npt.NDArray[Any]]:
    """All points, the renumbered triangles, and the number that each triangle belongs to."""
    if not parts:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    first = np.cumsum([0, *(len(points) for points, _, _ in parts[:-1])])
    faces = [np.asarray(faces, dtype=np.int64) + start for (_, faces, _), start in zip(parts, first, strict=True)]
    owners = np.repeat([owner for _, _, owner in parts], [len(faces) for _, faces, _ in parts])
    return np.concatenate([points for points, _, _ in parts]), np.concatenate(faces), owners


def _vertices(n: int) -> npt.NDArray[Any]:
    return np.arange(n, dtype=np.int64)[:, None]


def _numbered(names: tuple[str, ...]) -> str:
    return ", ".join(f"{k} {name}" for k, name in enumerate(names))


def _meshio() -> Any:
    try:
        return importlib.import_module("meshio")
    except ImportError:
        raise CommandError(
            "--to paraview: meshio, which writes VTK files, is not installed; pip install 'repose-explorer[paraview]'"
        ) from None
