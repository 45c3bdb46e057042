"""Rigs: one file per rig, listed here."""

from solver.rigs.funnel import Funnel
from solver.rigs.surface import Plane, Revolved, Surface

RIGS = {"funnel": Funnel}

__all__ = ["RIGS", "Funnel", "Plane", "Revolved", "Surface"]
