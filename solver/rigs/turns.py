"""Quaternions that turn a surface's local z axis into a direction of the world, and planes that face one."""

from __future__ import annotations

import math

from solver.rigs.surface import Plane, Pose

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

HALF = math.sqrt(0.5)
FACING_PLUS_Y: Quaternion = (HALF, -HALF, 0.0, 0.0)
"""A quarter turn about −x: local z becomes +y."""
FACING_MINUS_Y: Quaternion = (HALF, HALF, 0.0, 0.0)
"""A quarter turn about +x: local z becomes −y."""
FACING_DOWN: Quaternion = (0.0, 1.0, 0.0, 0.0)
"""Half a turn about x: local z becomes −z."""


def turned_plane(origin: Vector, quaternion: Quaternion, material: str) -> Plane:
    """A plane through ``origin`` [m] whose side with bodies is the turned local +z."""
    return Plane(material, Pose(origin, quaternion))
