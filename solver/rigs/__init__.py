"""Rigs: one file per rig, listed here."""

from solver.rigs.funnel import Funnel
from solver.rigs.surface import Plane, Pose, Revolved, Surface, TriangleMesh

RIGS = {"funnel": Funnel}

__all__ = ["RIGS", "Funnel", "Plane", "Pose", "Revolved", "Surface", "TriangleMesh"]
