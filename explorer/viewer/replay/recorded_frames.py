"""Moments of a recording in the form in which a live pour is drawn: frames, and what bodies can be coloured by.

A recording holds positions, not velocities: motion between its frames is computed from differences.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explorer.live.frames import NO_SURFACES, Frame
from explorer.recordings.recording import SAME_TIME, Component, Instances, Recording, index_at
from explorer.scene.meshes import rig_poses
from explorer.viewer.look.colour_by import STILL_SPEED, STILL_WORDS, ColourQuantity
from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]

NOT_RECORDED = "A recording holds no contact forces and coordination numbers."
NOT_TOLD = "This one is older: it does not say which body is which, so there are no speeds and residence times either."


class RecordedFrames:
    """Frames of ``recording``, numbered from 1, component by component; bodies that have left are not in them.

    Components are numbered as in the recording's scene; if it holds none, in the order of the file.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._kinds = component_numbers(recording)
        told = tells_who_is_who(recording)
        self.quantities: Mapping[str, ColourQuantity] = QUANTITIES if told else {}
        """Quantities by which the bodies can be coloured."""
        self.note = NOT_RECORDED if told else f"{NOT_RECORDED} {NOT_TOLD}"
        """Quantities by which they cannot be coloured, in words."""
        self._first_seen = [first_seen(component) for component in recording.components]

    def number_at(self, time: float) -> int:
        """Number of the frame valid at ``time`` [s]; the first one for earlier times."""
        return 1 + (index_at(self._recording.times, time) or 0)

    def frame(self, number: int) -> Frame:
        """All bodies of one frame."""
        time, there = self._at(number)
        kinds = np.repeat(self._kinds, [len(one.scale) for one in there])
        return Frame(
            number=number,
            generation=1,
            time=time,
            position=np.concatenate([one.position for one in there]),
            quaternion=np.concatenate([one.quaternion for one in there]),
            component=kinds.astype(np.int32),
            inside=np.ones(len(kinds), dtype=bool),
            scale=np.concatenate([one.scale for one in there]),
            surfaces=NO_SURFACES if self._recording.scene is None else self._surfaces(self._recording.scene, time),
        )

    def _surfaces(self, scene: Scene, time: float) -> Array:
        """Poses of the rig's surfaces at ``time`` [s], as in ``rig_poses``."""
        placed = {surface.shape.name: surface.pose_at(time) for surface in self._recording.surfaces}
        poses = rig_poses(scene.rig)
        for row, name in enumerate(scene.rig.surface_names):
            pose = placed.get(name)
            poses[row] = poses[row] if pose is None else pose
        return poses

    def motion(self, number: int) -> RecordedMotion:
        """Quantities for colouring the bodies of a frame; call it only for recordings that have ``quantities``."""
        time, there = self._at(number)
        speeds = [mean_speeds(component, time) for component in self._recording.components]
        since = [seen[one.place] for seen, one in zip(self._first_seen, there, strict=True)]
        return RecordedMotion(number, np.concatenate(speeds), time - np.concatenate(since))

    def _at(self, number: int) -> tuple[float, list[Instances]]:
        time = float(self._recording.times[number - 1])
        return time, [component.at(time) for component in self._recording.components]


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """What is known about the n bodies of a frame; NaN if nothing is."""

    number: int
    """Number of the frame."""
    speed: Array
    """[m/s], shape (n,)."""
    residence: Array
    """Time since a body first appeared in the recording [s], shape (n,)."""


QUANTITIES: Mapping[str, ColourQuantity] = {
    "speed": ColourQuantity(
        "m/s",
        1.0,
        lambda motion: motion.speed,
        "mean from the frame before to the one after",
        0.01,
        STILL_SPEED,
        STILL_WORDS,
    ),
    "residence time": ColourQuantity(
        "s", 1.0, lambda motion: motion.residence, "time since a body is first in the recording", 0.1
    ),
}
"""Quantities of a recording that identifies the bodies in every frame."""


def component_numbers(recording: Recording) -> list[int]:
    """Number of each component of ``recording`` in its scene, or in the file."""
    if recording.scene is None:
        return list(range(len(recording.components)))
    names = [body.name for body in recording.scene.bodies]
    return [names.index(component.shape.name) for component in recording.components]


def tells_who_is_who(recording: Recording) -> bool:
    """Whether the file identifies the bodies in every frame."""
    return all(frame.place is not None for component in recording.components for frame in component.frames)


def mean_speeds(component: Component, time: float) -> Array:
    """Distance from the frame before to the frame after ``time``, over the time between them [m/s], shape (n,).

    For a body missing in one of the two, it is the distance from or to its present position; NaN if it is in neither,
    and for all if the file does not identify bodies. Between frames a body moves on a curve, so it is faster than this.
    """
    k = index_at(component.times, time)
    if k is None:
        return np.zeros(0)
    here, now = component.frames[k], float(component.times[k])
    start, began = here.position.astype(np.float64), np.full(len(here.scale), now)
    end, ended = start.copy(), began.copy()
    # Not simply the neighbours: the last frame of a pour may occur twice.
    before = index_at(component.times, now - 2.0 * SAME_TIME)
    after = int(np.searchsorted(component.times, now + SAME_TIME, side="right"))
    if before is not None:
        mine, theirs = _both(here, component.frames[before])
        start[mine], began[mine] = component.frames[before].position[theirs], component.times[before]
    if after < len(component.times):
        mine, theirs = _both(here, component.frames[after])
        end[mine], ended[mine] = component.frames[after].position[theirs], component.times[after]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.linalg.norm(end - start, axis=1) / (ended - began), dtype=np.float64)


def first_seen(component: Component) -> Array:
    """When each body first appears in the recording [s], by its place in the order of entry; NaN if it never does."""
    frames = [(time, frame.place) for time, frame in zip(component.times, component.frames, strict=True)]
    known = [(time, place) for time, place in frames if place is not None and len(place)]
    seen = np.full(max((int(place.max()) + 1 for _, place in known), default=0), np.nan)
    for time, place in reversed(known):
        seen[place] = time
    return seen


def _both(one: Instances, other: Instances) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Rows in each of two frames of the bodies that are in both."""
    if one.place is None or other.place is None:
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    _, mine, theirs = np.intersect1d(one.place, other.place, assume_unique=True, return_indices=True)
    return mine, theirs
