"""Surfaces from mesh files (STL, OBJ, PLY, GLB): read, welded, in metres, and refused unless they bound a solid.

A file with several parts (a scene) is one rigid body of all of them. Parts that are each closed are put side by side;
parts that are closed only together (a surface split by its materials) are welded.
"""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.params import UNITS
from solver.shapes.mesh_winding import lattice_axes, winding_numbers

if TYPE_CHECKING:
    import trimesh

SUFFIXES = (".stl", ".obj", ".ply", ".glb")
LENGTH_UNITS = UNITS["m"]
MOST_BYTES = 100_000_000
MOST_FACES = 500_000
WELD = 1e-7
"""Corners closer than about this, relative to the largest extent, are merged: single precision resolves 6e-8."""
FLAT = 1e-9
"""Volume over the cube of the largest extent below which a surface encloses nothing; a hair 1 : 1 : 1000 has 1e-6."""
THIN = 1e-6
"""Spread of the corners normal to a plane, relative to that within it, below which they count as lying in it."""
WINDING_CELLS = 200_000
FEWEST_BAD_RAYS = 2


class MeshFileError(ValueError):
    """A mesh file that does not describe a solid; the message names the fault, in one line, but not the file."""


def read_solid_mesh(file: str, unit: str = "m") -> trimesh.Trimesh:
    """The closed surface in ``file`` in metres, its coordinates being in ``unit``.

    Raises:
        MeshFileError: missing, unreadable or too large; no faces, or coordinates that are not finite; open or with
            edges of more than two faces; faces that disagree about the outside; inverted; flat; cutting through itself.
    """
    import trimesh

    _check_size(Path(file))
    parts = [_welded(part) for part in _parts(file)]
    faces = sum(len(part.faces) for part in parts)
    if faces == 0:
        raise MeshFileError("is degenerate: it has no face with an area")
    if faces > MOST_FACES:
        raise MeshFileError(f"has {faces} faces; at most {MOST_FACES} are allowed: reduce it in a mesh program")
    if len(parts) > 1 and not all(part.is_watertight for part in parts):
        whole = _welded(_side_by_side(parts))
        parts = [whole] if whole.is_watertight else parts
    for k, part in enumerate(parts, start=1):
        _check_closed(part, f"part {k} of {len(parts)}: " if len(parts) > 1 else "")
    # A part of negative volume may be a cavity in another; the winding numbers tell.
    if sum(float(part.volume) for part in parts) < 0.0:
        raise MeshFileError("is inverted: its volume is not positive, normals must point outwards")
    mesh = _side_by_side(parts)
    _check_winding(mesh)
    return trimesh.Trimesh(mesh.vertices * LENGTH_UNITS[unit], mesh.faces, process=False)


def _check_size(path: Path) -> None:
    try:
        size = path.stat().st_size
    except OSError:
        raise MeshFileError("no such file") from None
    if size > MOST_BYTES:
        raise MeshFileError(f"is too large: {size / 1e6:.0f} MB; at most {MOST_BYTES / 1e6:.0f} MB are allowed")


def _parts(file: str) -> list[trimesh.Trimesh]:
    import trimesh

    # trimesh logs, with a traceback, the errors that it then raises.
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    try:
        found = trimesh.load_scene(file, process=False).dump(concatenate=False)
    except Exception as error:  # the readers of a damaged file raise anything from KeyError to struct.error
        raise MeshFileError(f"cannot be read ({' '.join(str(error).split())[:120]})") from None
    parts = [part for part in found if isinstance(part, trimesh.Trimesh) and len(part.faces) > 0]
    if not parts:
        raise MeshFileError("holds no faces")
    if not all(part.faces.min() >= 0 and part.faces.max() < len(part.vertices) for part in parts):
        raise MeshFileError("has faces of corners that it does not hold")
    if not all(np.isfinite(part.vertices).all() for part in parts):
        raise MeshFileError("holds coordinates that are not finite")
    return parts


def _side_by_side(parts: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    import trimesh

    first = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    faces = np.concatenate([part.faces + offset for part, offset in zip(parts, first, strict=True)])
    return trimesh.Trimesh(np.concatenate([part.vertices for part in parts]), faces, process=False)


def _welded(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """``mesh`` without texture and normals, equal corners merged, faces with a repeated corner dropped."""
    import trimesh

    # 1e-30: a mesh that is one point has no extent
    cells = np.round(mesh.vertices / (WELD * max(mesh.extents.max(), 1e-30)))
    _, first, corner = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    # in the order of the file
    order = np.argsort(first)
    faces = np.argsort(order)[corner.ravel()][mesh.faces]
    a, b, c = faces.T
    welded = trimesh.Trimesh(mesh.vertices[first[order]], faces[(a != b) & (b != c) & (c != a)], process=False)
    if len(np.unique(welded.faces)) < len(welded.vertices):  # corners that no face has are no part of the solid
        welded.remove_unreferenced_vertices()
    return welded


def _check_closed(mesh: trimesh.Trimesh, part: str) -> None:
    if len(mesh.faces) == 0:
        raise MeshFileError(f"{part}is degenerate: it has no face with an area")
    spread = np.linalg.eigvalsh(np.cov(mesh.vertices.T))
    if spread[0] < THIN**2 * spread[2]:
        raise MeshFileError(f"{part}is degenerate: all its corners lie in one plane")
    if not mesh.is_watertight:
        raise MeshFileError(f"{part}is not watertight: {_edge_fault(mesh.edges_sorted)}")
    # trimesh also divides by the volume, and would warn
    with np.errstate(divide="ignore", invalid="ignore"):
        volume, extent = float(mesh.volume), float(mesh.extents.max())
    if not abs(volume) > FLAT * extent**3:
        raise MeshFileError(f"{part}is degenerate: it encloses no volume")
    if not mesh.is_winding_consistent:
        raise MeshFileError(f"{part}is not consistent: neighbouring faces disagree about which side is outside")


def _edge_fault(edges: npt.NDArray[np.int64]) -> str:
    """How the edges (two sorted corners each, once per face) fail to join two faces each."""
    faces_at = np.unique(edges, axis=0, return_counts=True)[1]
    single, many = int((faces_at == 1).sum()), int((faces_at > 2).sum())
    if single:
        return f"it is open, {single} edges belong to one face only"
    return f"{many} edges belong to more than two faces"


def _check_winding(mesh: trimesh.Trimesh) -> None:
    """Refuse a surface that encloses any place twice, or inside out.

    Where two sheets of a closed surface cross, one of the four wedges between them has a winding number other than 0
    and 1. The lattice detects wedges wider than a cell, 1/60 of a compact body; smaller ones change neither mass nor
    spheres by more than that.
    """
    winding = winding_numbers(mesh, lattice_axes(mesh, WINDING_CELLS, float(np.prod(mesh.extents))))
    bad = (winding[:-1] < -0.5) | (winding[:-1] > 1.5)
    # a ray that is not outside again behind the mesh slipped through an edge by rounding: it proves nothing
    bad &= winding[-1] == 0.0
    if bad.any(axis=0).sum() >= FEWEST_BAD_RAYS:
        share = bad.sum() / (winding[:-1] > 0.5).sum()
        fault = "cuts through itself, or its parts overlap"
        if (winding[:-1] < -0.5)[bad].any():
            fault = "is inside out, or cuts through itself"
        raise MeshFileError(f"{fault}, in about {100 * share:.2g} % of its volume")
