"""Triangles to draw: the true shapes of bodies in their own frame, and the rig. NumPy and trimesh only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
import numpy.typing as npt
import trimesh

from solver.body import Body, Members
from solver.rigs import Funnel, Plane, Revolved, Surface
from solver.rigs.funnel import GATE, SURFACE_NAMES
from solver.shape import surface_mesh

SIDES = 96
"""Corners of a circle."""
PLATE_OVERHANG = 2.0
"""Radius at which the infinite plate is drawn, as a multiple of the funnel's largest radius."""


@dataclass(frozen=True)
class Triangles:
    """A surface: corners [m], shape (n, 3), unit normals at them, and faces as indices, shape (m, 3)."""

    vertices: npt.NDArray[np.float32]
    normals: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]


def body_triangles(body: Body) -> Triangles:
    """The true shape in the principal frame of the body; the member spheres where it is declared by them."""
    if isinstance(body.shape, Members):
        clump = body.clump
        spheres = [trimesh.creation.icosphere(subdivisions=2, radius=radius) for radius in clump.radii]
        for sphere, centre in zip(spheres, clump.centres, strict=True):
            sphere.apply_translation(centre)
        return _smooth(cast(trimesh.Trimesh, trimesh.util.concatenate(spheres)))
    mesh = surface_mesh(body.shape)
    return _smooth(mesh) if body.shape.kind in ("ellipsoid", "sphere") else _faceted(mesh)


def rig_triangles(rig: Funnel) -> dict[str, Triangles]:
    """Plate, cone and gate by name, in the world's frame."""
    surfaces = rig.surfaces()
    radius = PLATE_OVERHANG * max(s.r1 for s in surfaces if isinstance(s, Revolved))
    return {name: _surface(surface, radius) for name, surface in zip(SURFACE_NAMES, surfaces, strict=True)}


GATE_NAME = SURFACE_NAMES[GATE]
"""The surface that is there only while the gate is shut."""


def _surface(surface: Surface, plate_radius: float) -> Triangles:
    if isinstance(surface, Plane):
        surface = Revolved(0.0, surface.pose.origin[2], plate_radius, surface.pose.origin[2], surface.material)
    return _revolved(cast(Revolved, surface))


def _revolved(surface: Revolved) -> Triangles:
    """Two circles and the strip between them; normals across the line, towards the axis or upward."""
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(SIDES)], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    low, high = surface.r0 * circle + surface.z0 * up, surface.r1 * circle + surface.z1 * up
    along = np.array([surface.r1 - surface.r0, surface.z1 - surface.z0])
    radial, axial = np.array([-along[1], along[0]]) / np.hypot(*along)
    normals = radial * circle + axial * up
    k = np.arange(SIDES)
    following = (k + 1) % SIDES
    faces = np.concatenate(
        [
            np.stack([k, following, k + SIDES], axis=1),
            np.stack([following, following + SIDES, k + SIDES], axis=1),
        ]
    )
    return _triangles(np.concatenate([low, high]), np.concatenate([normals, normals]), faces)


def _smooth(mesh: trimesh.Trimesh) -> Triangles:
    return _triangles(mesh.vertices, mesh.vertex_normals, mesh.faces)


def _faceted(mesh: trimesh.Trimesh) -> Triangles:
    """Every face with corners of its own, so that edges stay sharp."""
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    return _triangles(corners, np.repeat(mesh.face_normals, 3, axis=0), np.arange(len(corners)).reshape(-1, 3))


def _triangles(
    vertices: npt.NDArray[np.float64], normals: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]
) -> Triangles:
    return Triangles(
        np.asarray(vertices, dtype=np.float32),
        np.asarray(normals, dtype=np.float32),
        np.asarray(faces, dtype=np.uint32),
    )
