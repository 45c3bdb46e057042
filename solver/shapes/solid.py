"""Solids: the true shape of a body, with its mass, its inertia and a surface to draw.

A solid lives in its principal frame: origin at the centre of mass, axes along the principal axes of inertia,
x the longest. Member spheres are fitted to it in `solver.shapes.clump`; mass and inertia always come from here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

import numpy as np
import numpy.typing as npt

from solver.shapes.mesh_file import LENGTH_UNITS, SUFFIXES, MeshFileError, read_solid_mesh

# Imported by the functions that make a mesh, here and in the other files of shapes: trimesh and what it imports take as
# long to load as the rest of the program, and a pour of known bodies needs none of it.
if TYPE_CHECKING:
    import trimesh

Kind = Literal["ellipsoid", "cylinder", "box", "sphere", "mesh"]
Array = npt.NDArray[np.float64]

DIMENSION_NAMES: dict[str, tuple[str, ...]] = {
    "ellipsoid": ("axis a", "axis b", "axis c"),
    "cylinder": ("diameter", "length"),
    "box": ("edge x", "edge y", "edge z"),
    "sphere": ("diameter",),
    "mesh": (),
}
ALLOWED = (
    "{ ellipsoid = [a, b, c] }, { cylinder = [diameter, length] }, { box = [x, y, z] }, "
    '{ sphere = diameter } in metres, or { mesh = "file.stl", unit = "mm" }'
)


class ShapeError(ValueError):
    """An impossible solid: the message names the key, the value and what is allowed, in one line."""


@dataclass(frozen=True)
class Solid:
    """A solid body, by closed form or by a surface mesh.

    Args:
        kind: form of the solid.
        dimensions: full lengths [m]. Ellipsoid: three axes; cylinder: (diameter, length); box: three edges;
            sphere: (diameter,); mesh: empty.
        file: path of an STL, OBJ, PLY or GLB file; only for a mesh.
        unit: unit of the coordinates in the file.

    The order of axes or edges does not matter: the frame puts the longest along x and the shortest along z.
    A cylinder at least as long as it is wide has its axis along x, a disc has it along z.

    Raises:
        ShapeError: unknown kind, wrong number of dimensions, a dimension that is not positive and finite, or
            a mesh without a file of a known type and a unit of length.
    """

    kind: Kind
    dimensions: tuple[float, ...] = ()
    file: str = ""
    unit: str = "m"

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise ShapeError(f"unknown solid {self.kind!r}; allowed: {ALLOWED}")
        if self.kind == "mesh":
            if Path(self.file).suffix.lower() not in SUFFIXES:
                raise ShapeError(f"mesh = {self.file!r}: allowed are files ending in {', '.join(SUFFIXES)}")
            if self.unit not in LENGTH_UNITS:
                raise ShapeError(f"unit = {self.unit!r}: allowed are {', '.join(LENGTH_UNITS)}")
        elif self.file:
            raise ShapeError(f"{self.kind} takes no file, got {self.file!r}")
        names = DIMENSION_NAMES[self.kind]
        values = tuple(self.dimensions)
        if len(values) != len(names):
            wanted = f"({', '.join(names)})" if names else "none"
            raise ShapeError(f"{self.kind} = {list(values)}: {len(names)} dimensions expected {wanted}")
        for name, value in zip(names, values, strict=True):
            if not _is_length(value):
                raise ShapeError(
                    f"{self.kind} = {list(values)}: {name} must be a positive, finite length [m]: {value!r}"
                )
        object.__setattr__(self, "dimensions", tuple(float(value) for value in values))

    @classmethod
    def from_toml(cls, table: Mapping[str, Any], where: str, folder: Path | None = None) -> Solid:
        """The solid that a TOML table declares, e.g. `{ ellipsoid = [27.92e-3, 11.18e-3, 6.11e-3] }` [m].

        Args:
            table: exactly one key: ellipsoid, cylinder, box, sphere or mesh; with mesh optionally unit.
            where: file and key of the table, for messages.
            folder: a relative mesh file is looked for here (default: the working directory). The mesh is read
                at once, so that a bad file is refused together with the rest of the declaration.

        Raises:
            ShapeError: anything that is not one of the allowed forms; the message starts with `where`.
        """
        try:
            return _solid_from_table(table, folder)
        except ShapeError as error:
            raise ShapeError(f"{where}: {error}") from None

    def to_toml(self) -> dict[str, Any]:
        """The table that `from_toml` reads back as this solid. Dimensions in metres."""
        if self.kind == "mesh":
            return {"mesh": self.file} if self.unit == "m" else {"mesh": self.file, "unit": self.unit}
        if self.kind == "sphere":
            return {"sphere": self.dimensions[0]}
        return {self.kind: list(self.dimensions)}


@dataclass(frozen=True, eq=False)
class MassProperties:
    """What the equations of motion (Newton, Euler) need of a solid.

    Args:
        mass: [kg].
        inertia: (3,) principal moments about the centre of mass, axes x, y, z of the principal frame [kg m2].
        volume: [m3].
        extents: (3,) outer dimensions along x, y, z [m].
    """

    mass: float
    inertia: Array
    volume: float
    extents: Array


def mass_properties(solid: Solid, density: float) -> MassProperties:
    """Mass, principal inertia, volume and outer dimensions of a solid of uniform density [kg/m3].

    Closed forms for ellipsoid, m (b² + c²) / 20 with full axes; cylinder, m d² / 8 about the axis and
    m (3 d² / 4 + l²) / 12 across; box, m (y² + z²) / 12; the exact integral over the facets for a mesh.

    Raises:
        ShapeError: a density that is not positive and finite, or a mesh that `surface_mesh` refuses.
    """
    if not _is_length(density):
        raise ShapeError(f"density = {density!r}: must be a positive, finite number [kg/m3]")
    if solid.kind == "mesh":
        whole, moments, size = _integrals(solid, file_stamp(solid))
        return MassProperties(density * whole, density * np.array(moments), whole, np.array(size))
    extents = principal_extents(solid)
    squares = extents**2
    box_volume = float(np.prod(extents))
    if solid.kind == "cylinder":
        volume = math.pi / 4.0 * box_volume
        axis = cylinder_axis(solid)
        # second moment per mass, integral of x² over the volume: d²/16 across a cylinder, l²/12 along it
        second = np.where(np.arange(3) == axis, squares / 12.0, squares / 16.0)
    elif solid.kind == "box":
        volume, second = box_volume, squares / 12.0
    else:
        volume, second = math.pi / 6.0 * box_volume, squares / 20.0
    mass = density * volume
    return MassProperties(mass, mass * (second.sum() - second), volume, extents)


@lru_cache(maxsize=64)
def _integrals(solid: Solid, stamp: int) -> tuple[float, tuple[float, ...], tuple[float, ...]]:
    """Volume, principal moments at unit density and outer dimensions of a mesh: asked for at every body that enters."""
    mesh = _surface_mesh(solid, 2, stamp)
    return float(mesh.volume), tuple(np.diag(mesh.moment_inertia).tolist()), tuple(mesh.extents.tolist())


def principal_extents(solid: Solid) -> Array:
    """Outer dimensions (3,) along x >= y >= z of a closed-form solid [m]."""
    lengths = solid.dimensions
    if solid.kind == "sphere":
        lengths = lengths * 3
    elif solid.kind == "cylinder":
        lengths = (lengths[0], lengths[0], lengths[1])
    return np.sort(np.array(lengths))[::-1].copy()


def cylinder_axis(solid: Solid) -> int:
    """Index of the cylinder's axis in the principal frame: x of a rod, z of a disc."""
    diameter, length = solid.dimensions
    return 0 if length >= diameter else 2


def surface_mesh(solid: Solid, refinement: int = 2) -> trimesh.Trimesh:
    """The true surface in the principal frame, centred on the centre of mass [m].

    Args:
        solid: the solid.
        refinement: subdivisions of an ellipsoid's icosahedron (20 * 4**refinement faces) and
            8 * 2**refinement sides of a cylinder; 2 is for drawing. Vertices lie on the true surface. A box
            has 12 faces, a mesh those of its file.

    The frame is right-handed. The axes x and y of a mesh point to the side where its surface reaches further out
    (positive third moment); if it is mirror-symmetric they follow the axes of the file. For equal principal
    moments the axes within their plane depend on the file as well: they are repeatable, but do not turn with the
    body.

    Returns:
        A copy that belongs to the caller.

    Raises:
        ShapeError: a mesh file that `solver.shapes.mesh_file` refuses.
    """
    stamp = file_stamp(solid)
    return _surface_mesh(solid, refinement, stamp).copy()


def file_stamp(solid: Solid) -> int:
    """Time of the mesh file's last change [ns], 0 for a closed form: a cache must know it besides the solid.

    Raises:
        ShapeError: the file is missing.
    """
    if solid.kind != "mesh":
        return 0
    try:
        return Path(solid.file).stat().st_mtime_ns
    except OSError:
        raise ShapeError(f"mesh = {solid.file!r}: no such file") from None


def _is_length(value: object) -> bool:
    number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    return number and 0.0 < float(cast(float, value)) < math.inf


def _solid_from_table(table: Mapping[str, Any], folder: Path | None) -> Solid:
    if not isinstance(table, Mapping) or len(table) - ("mesh" in table and "unit" in table) != 1:
        raise ShapeError(f"{table!r}: exactly one of {ALLOWED}")
    key, value = next(item for item in table.items() if item[0] != "unit" or len(table) == 1)
    if key not in get_args(Kind):
        raise ShapeError(f"unknown key {key!r}; allowed: {ALLOWED}")
    if key == "mesh":
        if not isinstance(value, str):
            raise ShapeError(f"mesh = {value!r}: the name of a file is expected")
        solid = Solid("mesh", file=str((folder or Path()) / value), unit=str(table.get("unit", "m")))
        surface_mesh(solid)
        return solid
    if key == "sphere":
        return Solid("sphere", (value,))
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise ShapeError(f"{key} = {value!r}: a list is expected; allowed: {ALLOWED}")
    return Solid(cast(Kind, key), tuple(value))


@lru_cache(maxsize=64)
def _surface_mesh(solid: Solid, refinement: int, stamp: int) -> trimesh.Trimesh:
    import trimesh

    if solid.kind == "mesh":
        return _in_principal_frame(_read_mesh(solid))
    extents = principal_extents(solid)
    if solid.kind == "box":
        return trimesh.creation.box(extents)
    if solid.kind == "cylinder":
        diameter, length = solid.dimensions
        sides = 8 * 2**refinement
        mesh = trimesh.creation.cylinder(diameter / 2.0, length, sections=sides)
        if len(mesh.faces) < 4 * sides:  # trimesh leaves out faces below 0.01 mm²
            mesh = trimesh.creation.cylinder(0.5, 1.0, sections=sides)
            mesh.apply_scale((diameter, diameter, length))
        if cylinder_axis(solid) == 0:
            # even permutation z -> x keeps the frame right-handed
            mesh.vertices = mesh.vertices[:, [2, 0, 1]]
        return mesh
    mesh = trimesh.creation.icosphere(subdivisions=refinement, radius=0.5)
    mesh.apply_scale(extents)
    return mesh


def _read_mesh(solid: Solid) -> trimesh.Trimesh:
    try:
        return read_solid_mesh(solid.file, solid.unit)
    except MeshFileError as error:
        raise ShapeError(f"mesh = {solid.file!r}: {error}") from None


def _in_principal_frame(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The mesh about its centre of mass, turned so that its moments of inertia ascend along x, y, z."""
    import trimesh

    # in units of the cube root of the volume: moments of small bodies would drown in absolute tolerances
    scale = mesh.volume ** (1.0 / 3.0)
    unit = trimesh.Trimesh((mesh.vertices - mesh.center_mass) / scale, mesh.faces, process=False)
    _, axes = np.linalg.eigh(unit.moment_inertia)
    skewness = unit.area_faces @ (unit.triangles_center @ axes) ** 3
    # below this the body is mirror-symmetric to rounding, and the sign would be noise
    symmetric = np.abs(skewness) < 1e-6
    largest = axes[np.abs(axes).argmax(axis=0), range(3)]
    axes = axes * np.where(np.where(symmetric, largest, skewness) >= 0.0, 1.0, -1.0)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return trimesh.Trimesh(unit.vertices @ axes * scale, mesh.faces, process=False)
