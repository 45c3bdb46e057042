"""What bodies of a recording do between its frames, by differences: a recording holds places, not velocities."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from explorer.logs.recording import SAME_TIME, Component, Instances, Recording, index_at

Array = npt.NDArray[np.float64]


def tells_who_is_who(recording: Recording) -> bool:
    """Whether the file says in every frame which body is which."""
    return all(frame.place is not None for component in recording.components for frame in component.frames)


def mean_speeds(component: Component, time: float) -> Array:
    """Distance from the frame before to the frame after ``time``, over the time between them [m/s], shape (n,).

    For a body that is not in one of the two it is the distance from or to where it is; NaN where it is in neither, and
    for all where the file does not say who is who. Between frames a body moves on a curve, so it is faster than this.
    """
    k = index_at(component.times, time)
    if k is None:
        return np.zeros(0)
    here, now = component.frames[k], float(component.times[k])
    start, began = here.position.astype(np.float64), np.full(len(here.scale), now)
    end, ended = start.copy(), began.copy()
    # Not simply the neighbours: the last frame of a pour may be there twice.
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
    """When each body is first in the recording [s], by its place in the order of entry; NaN where it never is."""
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
