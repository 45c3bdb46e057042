"""Walls as triangles, and STL."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from solver.rigs import Revolved, TriangleMesh
from solver.scenes.insertion import rotation_matrix

Array = npt.NDArray[np.float64]

SIDES = 96
"""Corners of a circle."""
BANDS = 3
"""Rings of triangles along the line that is turned: more of them are less slender."""


def revolved_triangles(surface: Revolved) -> Array:
    """Corners (t, 3, 3) [m] of a polygonal cone, or of one triangle around a disc.

    The polygons have the area of the circles that they stand for: flats are 1.8e-4 radii inside, corners 3.6e-4
    outside. A disc (a gate) becomes the triangle that holds it: every edge inside a flat surface is one more place
    at which engines may push twice.
    """
    if surface.z0 == surface.z1 and min(surface.r0, surface.r1) == 0.0:
        return _around(max(surface.r0, surface.r1), surface.z0)
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    circle = math.sqrt(2.0 * np.pi / SIDES / math.sin(2.0 * np.pi / SIDES))
    corners = circle * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    share = np.linspace(0.0, 1.0, BANDS + 1)
    radii, heights = surface.r0 + share * (surface.r1 - surface.r0), surface.z0 + share * (surface.z1 - surface.z0)
    rings = np.stack([np.column_stack([r * corners, np.full(SIDES, z)]) for r, z in zip(radii, heights, strict=True)])
    low, high = rings[:-1], rings[1:]
    low_next, high_next = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    quads = [np.stack([low, low_next, high_next], axis=2), np.stack([low, high_next, high], axis=2)]
    return np.concatenate([quad.reshape(-1, 3, 3) for quad in quads])


def mesh_triangles(surface: TriangleMesh) -> Array:
    """Corners (t, 3, 3) [m] of a mesh where it stands."""
    turn = rotation_matrix(np.array(surface.pose.quaternion))
    corners = np.array(surface.vertices) @ turn.T + np.array(surface.pose.origin)
    return np.asarray(corners[np.array(surface.faces)])


def write_stl(path: Path, name: str, triangles: Array) -> None:
    """Write triangles (t, 3, 3) [m] as an STL file in text form."""
    lines = [f"solid {name}"]
    for corners in triangles:
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal = normal / np.linalg.norm(normal)
        lines += [f"facet normal {_row(normal)}", "  outer loop"]
        lines += [f"    vertex {_row(corner)}" for corner in corners]
        lines += ["  endloop", "endfacet"]
    lines.append(f"endsolid {name}")
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def _around(radius: float, height: float) -> Array:
    """The equilateral triangle whose inscribed circle has ``radius``."""
    angle = np.radians([90.0, 210.0, 330.0])
    corners = 2.0 * radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.column_stack([corners, np.full(3, height)])[None]


def _row(values: Array) -> str:
    return " ".join(f"{value:.12g}" for value in values)
