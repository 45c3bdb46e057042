"""What a recording holds: shapes, what moved when, curves, events and texts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

SAME_TIME = 1e-6
"""[s]; recorded times are whole nanoseconds, those of a slider rounded to this."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A mesh [m] with its colour, RGB 0 … 255, and opacity 0 … 1."""

    name: str
    vertices: Floats
    faces: npt.NDArray[np.uint32]
    colour: tuple[int, int, int]
    opacity: float


@dataclass(frozen=True, eq=False)
class Instances:
    """Where the bodies of one component are, shapes (n, 3), (n, 4) wxyz and (n,) relative size."""

    position: Floats
    quaternion: Floats
    scale: Floats
    place: npt.NDArray[np.int64] | None
    """Place of each in its component's order of entry, shape (n,); None where the file does not tell."""


NOBODY = Instances(
    np.zeros((0, 3), np.float32), np.zeros((0, 4), np.float32), np.zeros(0, np.float32), np.zeros(0, np.int64)
)


@dataclass(frozen=True, eq=False)
class Component:
    """Bodies of one shape. ``frames[k]`` holds from ``times[k]`` on."""

    shape: Shape
    times: Array
    frames: tuple[Instances, ...]

    @property
    def most(self) -> int:
        """Largest number of bodies at any time."""
        return max((len(frame.scale) for frame in self.frames), default=0)

    def at(self, time: float) -> Instances:
        """The bodies at ``time`` [s]; none before the first."""
        k = index_at(self.times, time)
        return NOBODY if k is None else self.frames[k]


@dataclass(frozen=True, eq=False)
class Surface:
    """One surface of the rig: poses (k, 7), origin [m] and orientation wxyz, from ``times`` on; seen or not."""

    shape: Shape
    times: Array
    poses: Array
    shown_from: Array
    shown: npt.NDArray[np.bool_]

    def pose_at(self, time: float) -> Array | None:
        """Its pose at ``time`` [s]; None where nobody has placed it."""
        k = index_at(self.times, time)
        return None if k is None else self.poses[k]

    def seen_at(self, time: float) -> bool:
        """Whether it is there at ``time`` [s]."""
        k = index_at(self.shown_from, time)
        return k is not None and bool(self.shown[k])


@dataclass(frozen=True, eq=False)
class Recording:
    """One pour. ``times``: those of its frames [s], ascending."""

    times: Array
    components: tuple[Component, ...]
    surfaces: tuple[Surface, ...]
    curves: Mapping[str, tuple[Array, Array]]
    """Name → times [s] and values."""
    events: tuple[tuple[float, str], ...]
    parameters: str
    outcome: str
    """Markdown, as is ``parameters``; empty where the pour was cut off."""


def index_at(times: Array, time: float) -> int | None:
    """Index of the last entry that is not later than ``time`` [s]; None before the first."""
    k = int(np.searchsorted(times, time + SAME_TIME, side="right")) - 1
    return None if k < 0 else k
