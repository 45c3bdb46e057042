"""What a person takes along: bodies as a table, their shapes as a mesh, several files as one."""

from __future__ import annotations

import csv
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import numpy as np
import numpy.typing as npt
import trimesh

from explorer.errors import CommandError
from explorer.live.frames import Frame
from explorer.scene.meshes import Triangles, body_triangles
from solver.scenes.insertion import rotation_matrix
from solver.scenes.scene import Scene, actual

MM = 1e3
MOST_TRIANGLES = 4_000_000
"""In a mesh file: 200 MB as binary STL."""
COLUMNS = ("body", "component", "mass_kg", "size", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "in_domain")


def bodies_csv(frame: Frame, scene: Scene) -> str:
    """One row per body that has entered, in order of entry.

    ``size`` is the linear size relative to that of its component; x, y, z the centre of mass [m]; q the orientation of
    the principal frame; ``in_domain`` 0 for a body that rolled away and was taken out.
    """
    text, bodies = io.StringIO(), actual(scene).bodies
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    rows = zip(frame.component, frame.scale, frame.position, frame.quaternion, frame.inside, strict=True)
    for k, (component, scale, position, quaternion, inside) in enumerate(rows):
        body = bodies[component]
        numbers = (body.mass * float(scale) ** 3, *map(float, (scale, *position, *quaternion)))
        table.writerow((k, body.name, *(f"{number:.7g}" for number in numbers), int(inside)))
    return text.getvalue()


def bodies_stl(frame: Frame, scene: Scene) -> bytes:
    """True shapes of all bodies in the domain where they are, as binary STL in millimetres.

    Raises CommandError where there is no body yet, and for more than ``MOST_TRIANGLES`` triangles.
    """
    shapes = [body_triangles(body) for body in actual(scene).bodies]
    chosen = np.flatnonzero(frame.inside)
    triangles = sum(len(shapes[frame.component[k]].faces) for k in chosen)
    if not triangles:
        raise CommandError("STL: no body has entered yet")
    if triangles > MOST_TRIANGLES:
        raise CommandError(f"STL: {triangles} triangles; allowed: up to {MOST_TRIANGLES}")
    corners = [_placed(shapes[frame.component[k]], frame, int(k)) for k in chosen]
    vertices = np.concatenate(corners).reshape(-1, 3)
    mesh = trimesh.Trimesh(MM * vertices, np.arange(len(vertices)).reshape(-1, 3), process=False)
    return cast(bytes, mesh.export(file_type="stl"))


def zipped(files: Mapping[str, Path]) -> bytes:
    """A .zip archive of ``files``, by their names in it."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as entries:
        for name, path in files.items():
            entries.write(path, name)
    return archive.getvalue()


def _placed(shape: Triangles, frame: Frame, k: int) -> npt.NDArray[np.float64]:
    """Corners of the triangles of body ``k`` in the world [m], shape (triangles, 3, 3)."""
    quaternion = frame.quaternion[k].astype(np.float64)
    # Single precision has left it a unit one to seven digits only.
    turn = rotation_matrix(quaternion / np.linalg.norm(quaternion))
    corners: npt.NDArray[np.float64] = float(frame.scale[k]) * shape.vertices[shape.faces].astype(np.float64)
    return corners @ turn.T + frame.position[k].astype(np.float64)
