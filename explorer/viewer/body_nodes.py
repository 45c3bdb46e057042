"""Bodies in 3-D as batched meshes, one node per component; the same for a live pour and a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import viser

from explorer.live.frames import Frame
from explorer.viewer.palette import Colour, linear

FINE = 2000
"""Bodies up to which each is drawn with all its faces, however far it is."""


@dataclass(frozen=True)
class Poses:
    """Instances of one component as viser wants them; bodies that are not in the scene have scale 0."""

    position: npt.NDArray[np.float32]
    """[m], shape (n, 3)."""
    quaternion: npt.NDArray[np.float32]
    """wxyz, shape (n, 4)."""
    scale: npt.NDArray[np.float32]
    """Size of a body relative to its mesh, or 0, shape (n,)."""


class Mesh(Protocol):
    """Surface of a body in its own frame."""

    @property
    def vertices(self) -> npt.NDArray[Any]:
        """[m], shape (v, 3)."""

    @property
    def faces(self) -> npt.NDArray[Any]:
        """Indices of vertices, shape (f, 3)."""


@dataclass(frozen=True, eq=False)
class Kind:
    """One component: its mesh, its colour, and how many of it there can be."""

    mesh: Mesh
    colour: Colour
    most: int


class BodyNodes:
    """Nodes of all bodies, below the node ``root``; none for a component without bodies."""

    def __init__(self, server: viser.ViserServer, kinds: Sequence[Kind], root: str = "") -> None:
        self._kinds = tuple(kinds)
        self._colours = np.array([linear(kind.colour) for kind in kinds], dtype=np.uint8).reshape(-1, 3)
        self.nodes: list[Any] = [
            _batch(server, f"{root}/bodies/{k}", kind) if kind.most > 0 else None for k, kind in enumerate(kinds)
        ]

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_] | None = None) -> None:
        """Move the bodies to where ``frame`` has them; ``seen`` as in :func:`component_poses`."""
        for k, node, kind in self._there():
            _place(node, component_poses(frame, k, kind.most, seen))

    def plain(self, frame: Frame) -> npt.NDArray[np.uint8]:
        """Colours by component of the bodies of ``frame``, as :meth:`paint` wants them, shape (n, 3)."""
        # The last frame of the scene before may hold more components than this one has.
        return self._colours[frame.component % len(self._colours)]

    def paint(self, frame: Frame, colours: npt.NDArray[np.uint8]) -> None:
        """Give the bodies of ``frame`` their ``colours`` (n, 3), those of batched meshes (``palette.linear``)."""
        for k, node, kind in self._there():
            chosen = np.flatnonzero(frame.component == k)[: kind.most]
            painted = _plain(kind)
            painted[: len(chosen)] = colours[chosen]
            node.batched_colors = painted

    def fade(self, opacity: float | None) -> None:
        """Opacity of the bodies; None: opaque."""
        for _, node, _ in self._there():
            node.opacity = opacity

    def clear(self) -> None:
        """Hide all bodies."""
        for _, node, kind in self._there():
            _place(node, nowhere(kind.most))

    def remove(self) -> None:
        """Take all nodes off the page."""
        for _, node, _ in self._there():
            node.remove()

    def _there(self) -> list[tuple[int, Any, Kind]]:
        pairs = enumerate(zip(self.nodes, self._kinds, strict=True))
        return [(k, node, kind) for k, (node, kind) in pairs if node is not None]


def _batch(server: viser.ViserServer, name: str, kind: Kind) -> Any:
    none = nowhere(kind.most)
    return server.scene.add_batched_meshes_simple(
        name,
        kind.mesh.vertices,
        kind.mesh.faces,
        batched_wxyzs=none.quaternion,
        batched_positions=none.position,
        batched_scales=none.scale,
        batched_colors=_plain(kind),
        lod="off" if kind.most <= FINE else "auto",
    )


def _plain(kind: Kind) -> npt.NDArray[np.uint8]:
    return np.tile(np.array(linear(kind.colour), dtype=np.uint8), (kind.most, 1))


def _place(node: Any, poses: Poses) -> None:
    node.batched_positions = poses.position
    node.batched_wxyzs = poses.quaternion
    node.batched_scales = poses.scale


def component_poses(frame: Frame, component: int, n: int, seen: npt.NDArray[np.bool_] | None = None) -> Poses:
    """Poses of the bodies of one component, ``n`` of which will enter in all, in order of entry.

    Those that are not ``seen``, shape (bodies of the frame,), are hidden; by default those that have left the domain.
    """
    seen = frame.inside if seen is None else seen
    poses = nowhere(n)
    chosen = np.flatnonzero(frame.component == component)[:n]
    poses.position[: len(chosen)] = frame.position[chosen]
    poses.quaternion[: len(chosen)] = frame.quaternion[chosen]
    poses.scale[: len(chosen)] = np.where(seen[chosen], frame.scale[chosen], 0.0)
    return poses


def nowhere(n: int) -> Poses:
    """``n`` hidden instances."""
    quaternion = np.zeros((n, 4), dtype=np.float32)
    quaternion[:, 0] = 1.0
    return Poses(np.zeros((n, 3), dtype=np.float32), quaternion, np.zeros(n, dtype=np.float32))
