"""A funnel from a mesh file: what flows in at its top flows out at its bottom, onto a plate.

The mesh keeps the orientation of its file, with z up; its outlet, the lowest cut through it, is placed above the middle
of the plate. It may be a thin shell or a solid with walls, round or not. The passage for bodies is the largest circle
about the axis within a cut (:class:`Opening`); the gate that closes the outlet is a disc over all of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.assets import AssetNotFoundError, asset_path
from solver.params import ParameterError, param
from solver.rigs.feed import RoundFeed
from solver.rigs.outlet import RoundOutlet
from solver.rigs.rig import DISCHARGE, OUTLET_HEIGHTS, PILE, Action, Container, PourRig, Switch
from solver.rigs.surface import Revolved, Surface, SurfacePose, TriangleMesh, horizontal, load_mesh
from solver.shapes.mesh_file import LENGTH_UNITS, SUFFIXES

if TYPE_CHECKING:
    import trimesh

Array = npt.NDArray[np.float64]

DIRECTIONS = 720
"""Directions, half a degree apart, in which the wall is looked for from the axis."""
HAIR = 1e-6
"""Angle [rad] by which segments are extended at either end, so that no direction passes between two that meet."""
RIM = 0.005
"""Distance of the cuts for outlet and inlet from the ends of the mesh, as a share of its height."""
MOST_FACES = 20_000


@dataclass(frozen=True)
class MeshFunnel(PourRig):
    """The mesh, where it stands, and the mass that is poured."""

    mesh: str = param("square_hopper", files=SUFFIXES, doc="Surface of the funnel, z up: a file or a shipped mesh.")
    unit: str = param("mm", choices=tuple(LENGTH_UNITS), doc="Unit of the coordinates in the file.")
    outlet_height: float = param(0.065, unit="m", low=0.005, high=2.0, doc="Lowest point of the mesh above the plate.")
    mass: float = param(0.030, unit="kg", low=1e-5, high=10.0, doc="Poured mass.")
    domain_half_width: float = param(
        0.4, unit="m", low=0.05, high=10.0, doc="Bodies farther than this from the axis are removed."
    )
    wall: str = "rigid_sieve_plate"

    name = "mesh_funnel"
    surface_names = ("plate", "cone", "gate")
    gives = (PILE, DISCHARGE)
    protocols = ("pour_through", "fill_then_open")
    refills = True
    quick_changes = OUTLET_HEIGHTS

    @property
    def mesh_file(self) -> Path:
        """Path of the mesh. Raises ParameterError if it is not there any more."""
        try:
            return asset_path("meshes", self.mesh)
        except AssetNotFoundError as error:
            raise ParameterError(f"rig.mesh: {error}") from None

    @property
    def placed(self) -> Placed:
        """The mesh as it was read. Raises ParameterError for a file without a mesh."""
        file = self.mesh_file
        return _placed(file, LENGTH_UNITS[self.unit], self.wall, file.stat().st_mtime_ns)

    @property
    def inlet_height(self) -> float:
        """Height of the top of the mesh above the plate [m]."""
        return self.outlet_height + self.placed.height

    def surfaces(self) -> tuple[Surface, ...]:
        """Plate, mesh and gate, in the order of ``surface_names``."""
        placed = self.placed
        raised = TriangleMesh(
            placed.mesh.vertices, placed.mesh.faces, self.wall, SurfacePose((0.0, 0.0, self.outlet_height))
        )
        gate = Revolved(0.0, self.outlet_height, placed.outlet.farthest, self.outlet_height, self.wall)
        return horizontal(0.0, self.wall), raised, gate

    def poured_mass(self, density: float) -> float:
        """Mass that is poured [kg], whatever its density."""
        return self.mass

    def feed(self) -> RoundFeed:
        """The largest circle in the opening at the top."""
        return RoundFeed(self.inlet_height, self.placed.inlet.nearest)

    def container(self, since: float) -> Container:
        """Above the outlet, as far from the axis as the mesh reaches."""
        return Container(self.outlet_height, self.placed.reach)

    @property
    def outlet(self) -> RoundOutlet:
        """The largest circle in the opening at the bottom."""
        return RoundOutlet(self.placed.outlet.nearest)

    def actions(self) -> tuple[Action, ...]:
        """The gate opens."""
        return (Switch(0.0, self.surface_names.index("gate"), False),)

    def check(self, widest_body: float) -> None:
        """Refuse a mesh that is not there or is closed at an end, and an outlet narrower than ``widest_body`` [m]."""
        placed, name = self.placed, Path(self.mesh).name
        for words, one in (("lower", placed.outlet), ("upper", placed.inlet)):
            if not one.closed:
                raise ParameterError(
                    f"rig.mesh: {name}: at its {words} end no wall encloses the axis of the outlet; the mesh must be "
                    "upright (z up) and open, with its inlet above its outlet"
                )
        if placed.shut:
            raise ParameterError(
                f"rig.mesh: {name}: a face blocks the axis of the outlet; a funnel must be open from top to bottom"
            )
        if 2.0 * placed.outlet.nearest <= widest_body:
            raise ParameterError(
                f"rig.mesh: {name}: its outlet is {2.0 * placed.outlet.nearest:.3g} m wide, too narrow for a body; "
                f"allowed: more than {widest_body:.3g} m. Is rig.unit = {self.unit!r} right?"
            )
        if placed.reach >= self.domain_half_width:
            raise ParameterError(
                f"rig.mesh: {name}: reaches {placed.reach:.3g} m from its axis, beyond rig.domain_half_width "
                f"({self.domain_half_width:g} m). Is rig.unit = {self.unit!r} right?"
            )


@dataclass(frozen=True)
class Placed:
    """A mesh whose outlet stands above the origin, its lowest point in the plane z = 0, with its openings [m]."""

    mesh: TriangleMesh
    height: float
    reach: float
    """Distance of its farthest corner from the axis."""
    outlet: Opening
    inlet: Opening
    shut: bool
    """Whether something blocks the way straight down from the inlet to the outlet."""


@dataclass(frozen=True)
class Opening:
    """A level cut, seen from the axis: distance of the nearest and of the farthest wall [m].

    closed: whether there is a wall in every direction; otherwise the axis is outside the opening.
    """

    nearest: float
    farthest: float
    closed: bool


def opening(segments: Array, axis: tuple[float, float]) -> Opening:
    """What ``segments`` (n, 2, 2) of a cut leave open about ``axis`` (x, y)."""
    start, end = segments[:, 0] - axis, segments[:, 1] - axis
    along = end - start
    length2 = np.maximum((along**2).sum(axis=1), 1e-30)
    share = np.clip(-(start * along).sum(axis=1) / length2, 0.0, 1.0)
    nearest = np.linalg.norm(start + share[:, None] * along, axis=1)
    farthest = np.linalg.norm(np.concatenate([start, end]), axis=1)
    return Opening(float(nearest.min()), float(farthest.max()), _all_round(start, end))


def cut(mesh: trimesh.Trimesh, height: float) -> Array:
    """Segments in which the plane z = ``height`` cuts ``mesh``: ends (x, y) [m], shape (n, 2, 2)."""
    import trimesh

    found = trimesh.intersections.mesh_plane(mesh, (0.0, 0.0, 1.0), (0.0, 0.0, height))  # type: ignore[no-untyped-call]
    return np.asarray(found, dtype=np.float64).reshape(-1, 2, 3)[:, :, :2]


def middle(segments: Array) -> tuple[float, float]:
    """Middle (x, y) [m] of the smallest upright rectangle around ``segments`` (n, 2, 2)."""
    corners = segments.reshape(-1, 2)
    x, y = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
    return float(x), float(y)


def shut(mesh: trimesh.Trimesh, axis: tuple[float, float]) -> bool:
    """Whether a face crosses the vertical line through ``axis`` (x, y): a lid, a bottom, or a slanting wall."""
    a, b, c = (mesh.triangles[:, k, :2] - axis for k in range(3))
    turns = np.stack([p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((a, b), (b, c), (c, a))])
    area = np.abs(turns.sum(axis=0))
    seen = area > 1e-9 * max(float(area.max(initial=0.0)), 1e-30)
    return bool((((turns >= 0.0).all(axis=0) | (turns <= 0.0).all(axis=0)) & seen).any())


@lru_cache(maxsize=8)
def _placed(file: Path, metres_per_unit: float, wall: str, stamp: int) -> Placed:
    """The mesh in ``file`` as it was at ``stamp``."""
    import trimesh

    try:
        shell = load_mesh(file, wall, metres_per_unit)
    except ParameterError as error:
        raise ParameterError(f"rig.mesh: {error}") from None
    if len(shell.faces) > MOST_FACES:
        raise ParameterError(f"rig.mesh: {file}: {len(shell.faces)} faces; allowed: up to {MOST_FACES}")
    vertices = np.array(shell.vertices)
    low, high = float(vertices[:, 2].min()), float(vertices[:, 2].max())
    height = high - low
    mesh = trimesh.Trimesh(vertices, np.array(shell.faces), process=False)
    cuts = [cut(mesh, z) for z in (low + RIM * height, high - RIM * height)]
    if not height > 0.0 or not all(map(len, cuts)):
        raise ParameterError(f"rig.mesh: {file}: has no height; the mesh must be upright (z up)")
    axis = middle(cuts[0])
    outlet, inlet = (opening(one, axis) for one in cuts)
    moved = vertices - (*axis, low)
    reach = float(np.hypot(moved[:, 0], moved[:, 1]).max())
    corners = tuple((float(x), float(y), float(z)) for x, y, z in moved)
    return Placed(TriangleMesh(corners, shell.faces, wall), height, reach, outlet, inlet, shut(mesh, axis))


def _all_round(start: Array, end: Array) -> bool:
    """Whether segments, seen from the origin, leave no direction free."""
    first = np.arctan2(start[:, 1], start[:, 0])
    turn = np.arctan2(start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0], (start * end).sum(axis=1))
    looked = np.linspace(-np.pi, np.pi, DIRECTIONS, endpoint=False)
    # Angle from the first end to each direction, in the segment's own sense of rotation; a hair before it counts.
    ahead = np.mod((looked[:, None] - first[None, :]) * np.where(turn < 0.0, -1.0, 1.0) + HAIR, 2.0 * np.pi)
    return bool((ahead <= np.abs(turn) + 2.0 * HAIR).any(axis=1).all())
