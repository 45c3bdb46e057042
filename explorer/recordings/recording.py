"""What a recording holds: shapes, what moved when, curves, events and texts; and which files it consists of."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

SAME_TIME = 1e-6
"""[s]; recorded times are whole nanoseconds, those of a slider rounded to this."""
FRAME_INTERVAL = 0.02
"""Simulated time [s] between frames that are kept."""
SOON = 0.1
"""A recording that begins within this of a pour's beginning holds the pour from its beginning on [s]."""
BODIES = "/world/bodies/"
WORLD = "/world/"


@dataclass(frozen=True)
class RunningViewer:
    """A rerun viewer that is open, to record into; such as ``rerun+http://127.0.0.1:9876/proxy``."""

    url: str


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
class RecordedSurface:
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
    surfaces: tuple[RecordedSurface, ...]
    curves: Mapping[str, tuple[Array, Array]]
    """Name → times [s] and values."""
    events: tuple[tuple[float, str], ...]
    parameters: str
    outcome: str
    """Markdown, as is ``parameters``; empty where the pour was cut off."""
    scene: Scene | None = None
    """What was poured, as it was at the beginning; None where the file does not hold it."""

    @property
    def zero(self) -> float:
        """When its pour began [s], or where the file begins amid a pour its first frame."""
        first = [float(times[0]) for times in (self.times, *(times for times, _ in self.curves.values())) if len(times)]
        return 0.0 if min(first + [time for time, _ in self.events[:1]]) <= SOON else float(self.times[0])

    def counted_from(self, zero: float) -> Recording:
        """The same with all times as those since ``zero`` [s]."""
        return replace(
            self,
            times=self.times - zero,
            components=tuple(replace(one, times=one.times - zero) for one in self.components),
            surfaces=tuple(
                replace(one, times=one.times - zero, shown_from=one.shown_from - zero) for one in self.surfaces
            ),
            curves={name: (times - zero, values) for name, (times, values) in self.curves.items()},
            events=tuple((time - zero, text) for time, text in self.events),
        )


@dataclass(frozen=True)
class RecordedPour:
    """A file that holds one pour. ``began``, ``ended``: simulated times [s] of its first and last frame with a body."""

    path: Path
    began: float = math.nan
    ended: float = math.nan

    def with_frame(self, time: float) -> RecordedPour:
        """The same with a further frame at ``time`` [s]."""
        return replace(self, began=time if math.isnan(self.began) else self.began, ended=time)

    @property
    def plays(self) -> bool:
        """False for a file that was ended within its first frame: it holds a moment at most."""
        return self.ended - self.began > FRAME_INTERVAL

    @property
    def length(self) -> str:
        """How much it holds, in words."""
        if math.isnan(self.began):
            return "no body yet"
        if self.ended == self.began:
            return f"a single moment, at {self.ended:.3f} s"
        return f"{self.ended - self.began:.3f} s, from {self.began:.3f} to {self.ended:.3f} s"


def recorded_lines(pours: Sequence[RecordedPour]) -> list[str]:
    """How many pours were recorded, then a line per file with its length."""
    if not pours:
        return ["nothing was recorded: no pour had begun"]
    head = "1 pour recorded:" if len(pours) == 1 else f"{len(pours)} pours recorded:"
    return [head, *(f"{pour.path}: {pour.length}" for pour in pours)]


def index_at(times: Array, time: float) -> int | None:
    """Index of the last entry that is not later than ``time`` [s]; None before the first."""
    k = int(np.searchsorted(times, time + SAME_TIME, side="right")) - 1
    return None if k < 0 else k
