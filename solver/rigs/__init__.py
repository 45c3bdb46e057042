"""Rigs: one file per rig, listed here. Bodies are poured into ``RIGS``; ``BENCH_RIGS`` measure a single body."""

from solver.plugins import Registry, derived_from
from solver.rigs.compression import Compression
from solver.rigs.draw_down_box import DrawDownBox
from solver.rigs.drop_plate_45 import DropPlate45
from solver.rigs.funnel import Funnel
from solver.rigs.inclined_plane import InclinedPlane
from solver.rigs.lifting_cylinder import LiftingCylinder
from solver.rigs.lipped_plate import LippedPlate
from solver.rigs.mesh_funnel import MeshFunnel
from solver.rigs.rig import BenchRig, PourRig, Rig
from solver.rigs.rotating_drum import RotatingDrum
from solver.rigs.surface import Plane, Revolved, Surface, SurfacePose, TriangleMesh

RIGS: Registry[type[PourRig]] = Registry(
    "rig", (Funnel, MeshFunnel, LiftingCylinder, LippedPlate, DrawDownBox, RotatingDrum), derived_from(PourRig)
)
BENCH_RIGS: dict[str, type[BenchRig]] = {
    "inclined_plane": InclinedPlane,
    "drop_plate_45": DropPlate45,
    "compression": Compression,
}
"""One per bench test; the measurement itself is a file of ``solver/single_body``."""

__all__ = [
    "BENCH_RIGS",
    "RIGS",
    "BenchRig",
    "Funnel",
    "MeshFunnel",
    "Plane",
    "PourRig",
    "Revolved",
    "Rig",
    "Surface",
    "SurfacePose",
    "TriangleMesh",
]
