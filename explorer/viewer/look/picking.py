"""Which body a click meets: the ray of the click against the surfaces as they are drawn.

viser can tell the instance of a mesh that was clicked, but draws a hull of ten pixels around whatever the mouse is
over, which hides small bodies, and says nothing of clicks beside them. So the ray is followed here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from explorer.live.frames import Frame
from explorer.scene.meshes import Triangles
from solver.scenes.insertion import rotation_matrix

Array = npt.NDArray[np.float64]


def nearest_hit(
    meshes: Sequence[Triangles], frame: Frame, seen: npt.NDArray[np.bool_], origin: Array, direction: Array
) -> int | None:
    """Body of ``frame`` that a ray meets first, by its order of entry; None where it meets none in sight.

    Args:
        meshes: surface of a body of each component.
        frame: where the bodies are.
        seen: which of them are drawn, shape (n,).
        origin: where the ray begins [m], shape (3,).
        direction: where it goes, of any length, shape (3,).
    """
    length = float(np.linalg.norm(direction))
    if not (np.isfinite(origin).all() and np.isfinite(length) and length > 0.0):
        return None
    direction = direction / length
    best, nearest = None, np.inf
    for b in _in_the_way(meshes, frame, seen, origin, direction):
        turn, size = rotation_matrix(frame.quaternion[b].astype(float)), float(frame.scale[b])
        # In the frame of the mesh the same distance along the ray, for a direction that is scaled as well.
        start = (origin - frame.position[b]) @ turn / size
        mesh = meshes[int(frame.component[b])]
        distance = first_crossing(mesh.vertices[mesh.faces].astype(float), start, direction @ turn / size)
        if distance < nearest:
            best, nearest = int(b), distance
    return best


def _in_the_way(
    meshes: Sequence[Triangles], frame: Frame, seen: npt.NDArray[np.bool_], origin: Array, direction: Array
) -> npt.NDArray[np.int64]:
    """Bodies in sight whose bounding sphere the ray crosses."""
    radii = np.array([np.linalg.norm(mesh.vertices, axis=1).max() for mesh in meshes])
    reach = radii[frame.component] * frame.scale
    towards = frame.position - origin
    along = towards @ direction
    aside = np.linalg.norm(towards - along[:, None] * direction, axis=1)
    return np.flatnonzero(seen & (aside <= reach) & (along > -reach))


def first_crossing(triangles: Array, origin: Array, direction: Array) -> float:
    """Distance along a ray, in lengths of ``direction``, to the first of ``triangles`` (k, 3, 3); infinite if none.

    Möller & Trumbore 1997, Journal of Graphics Tools 2:21.
    """
    corner = triangles[:, 0]
    one, two = triangles[:, 1] - corner, triangles[:, 2] - corner
    across = np.cross(direction, two)
    determinant = np.einsum("ij,ij->i", one, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        from_corner = origin - corner
        u = np.einsum("ij,ij->i", from_corner, across) / determinant
        other = np.cross(from_corner, one)
        v = (other @ direction) / determinant
        t = np.einsum("ij,ij->i", two, other) / determinant
        hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
    return float(t[hit].min()) if hit.any() else np.inf
