"""Openings of a shell of triangles: how wide it is where a horizontal plane cuts it, about a vertical axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import trimesh

Array = npt.NDArray[np.float64]

DIRECTIONS = 720
"""Half degrees in which the wall is looked for from the axis."""
HAIR = 1e-6
"""Angle [rad] that segments are longer at either end, so that none looks between two that meet."""


@dataclass(frozen=True)
class Opening:
    """A level cut, seen from the axis: distance of the nearest and of the farthest wall [m].

    closed: whether a wall stands in every direction; otherwise the axis is outside of it.
    """

    nearest: float
    farthest: float
    closed: bool


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
    """Whether a face stands across the vertical line through ``axis`` (x, y): a lid, a bottom, or a wall aslant."""
    a, b, c = (mesh.triangles[:, k, :2] - axis for k in range(3))
    turns = np.stack([p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((a, b), (b, c), (c, a))])
    area = np.abs(turns.sum(axis=0))
    seen = area > 1e-9 * max(float(area.max(initial=0.0)), 1e-30)
    return bool((((turns >= 0.0).all(axis=0) | (turns <= 0.0).all(axis=0)) & seen).any())


def opening(segments: Array, axis: tuple[float, float]) -> Opening:
    """What ``segments`` (n, 2, 2) of a cut leave open about ``axis`` (x, y)."""
    start, end = segments[:, 0] - axis, segments[:, 1] - axis
    along = end - start
    length2 = np.maximum((along**2).sum(axis=1), 1e-30)
    share = np.clip(-(start * along).sum(axis=1) / length2, 0.0, 1.0)
    nearest = np.linalg.norm(start + share[:, None] * along, axis=1)
    farthest = np.linalg.norm(np.concatenate([start, end]), axis=1)
    return Opening(float(nearest.min()), float(farthest.max()), _all_round(start, end))


def _all_round(start: Array, end: Array) -> bool:
    """Whether segments, seen from the origin, leave no direction free."""
    first = np.arctan2(start[:, 1], start[:, 0])
    turn = np.arctan2(start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0], (start * end).sum(axis=1))
    looked = np.linspace(-np.pi, np.pi, DIRECTIONS, endpoint=False)
    # How far each direction is from the first end, in the sense of the segment's own turn; a hair before it counts.
    ahead = np.mod((looked[:, None] - first[None, :]) * np.where(turn < 0.0, -1.0, 1.0) + HAIR, 2.0 * np.pi)
    return bool((ahead <= np.abs(turn) + 2.0 * HAIR).any(axis=1).all())
