"""Moments of a recording in the form in which a live pour is drawn: frames, and what bodies can be coloured by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explorer.live.frames import Frame
from explorer.logs.motion import first_seen, mean_speeds, tells_who_is_who
from explorer.logs.recording import Instances, Recording, index_at
from explorer.viewer.look.colouring import Quantity

Array = npt.NDArray[np.float64]

QUANTITIES: Mapping[str, Quantity] = {
    "speed": Quantity("m/s", 1.0, lambda motion: motion.speed, "mean from the frame before to the one after"),
    "residence time": Quantity(
        "s", 1.0, lambda motion: motion.residence, "time since a body is first in the recording"
    ),
}
"""Of a recording that says in every frame which body is which."""
NOT_RECORDED = "A recording holds no contact forces and coordination numbers."
NOT_TOLD = "This one is older: it does not say which body is which, so there are no speeds and residence times either."


@dataclass(frozen=True, eq=False)
class Motion:
    """What is known of the n bodies of a frame. NaN where nothing is."""

    number: int
    """Of the frame."""
    speed: Array
    """[m/s], shape (n,)."""
    residence: Array
    """Time since a body is first in the recording [s], shape (n,)."""


class RecordedFrames:
    """Frames of ``recording``, numbered from 1, component by component; bodies that have left are not in them."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        told = tells_who_is_who(recording)
        self.quantities: Mapping[str, Quantity] = QUANTITIES if told else {}
        """What the bodies can be coloured by."""
        self.note = NOT_RECORDED if told else f"{NOT_RECORDED} {NOT_TOLD}"
        """What they cannot be coloured by, in words."""
        self._first_seen = [first_seen(component) for component in recording.components]

    def number_at(self, time: float) -> int:
        """Number of the frame that holds at ``time`` [s], the first one for all that is before it."""
        return 1 + (index_at(self._recording.times, time) or 0)

    def frame(self, number: int) -> Frame:
        """All bodies of one frame."""
        time, there = self._at(number)
        kinds = np.repeat(np.arange(len(there)), [len(one.scale) for one in there])
        return Frame(
            number=number,
            generation=1,
            time=time,
            position=np.concatenate([one.position for one in there]),
            quaternion=np.concatenate([one.quaternion for one in there]),
            component=kinds.astype(np.int32),
            inside=np.ones(len(kinds), dtype=bool),
            scale=np.concatenate([one.scale for one in there]),
        )

    def motion(self, number: int) -> Motion:
        """What its bodies can be coloured by; call it for recordings that have ``quantities`` only."""
        time, there = self._at(number)
        speeds = [mean_speeds(component, time) for component in self._recording.components]
        since = [seen[one.place] for seen, one in zip(self._first_seen, there, strict=True)]
        return Motion(number, np.concatenate(speeds), time - np.concatenate(since))

    def _at(self, number: int) -> tuple[float, list[Instances]]:
        time = float(self._recording.times[number - 1])
        return time, [component.at(time) for component in self._recording.components]
