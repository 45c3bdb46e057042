"""Frames in shared memory: the solver process writes the newest state of all bodies, the page's process reads it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from explorer.live.slots import SlotReader, SlotWriter, shared_slots
from solver.pours.record import Bodies

MAX_BODIES = 32768
"""Bodies for which there is room in a frame."""

MAX_SURFACES = 64
"""Surfaces of a rig for which there is room in a frame."""
NO_SURFACES: npt.NDArray[np.float64] = np.zeros((0, 7))

SLOT = np.dtype(
    [
        ("generation", np.int64),
        ("time", np.float64),
        ("bodies", np.int64),
        ("position", np.float32, (MAX_BODIES, 3)),
        ("quaternion", np.float32, (MAX_BODIES, 4)),
        ("component", np.int32, (MAX_BODIES,)),
        ("inside", np.bool_, (MAX_BODIES,)),
        ("scale", np.float32, (MAX_BODIES,)),
        ("surfaces", np.int64),
        ("pose", np.float64, (MAX_SURFACES, 7)),
    ],
    align=True,
)
"""One frame in memory; the first ``bodies`` rows of the arrays, and the first ``surfaces`` poses, are filled."""


@dataclass(frozen=True)
class Frame:
    """State of the n bodies that have entered, in order of entry. A copy; later frames do not change it."""

    number: int
    """Count of frames since the session began, from 1."""
    generation: int
    """Which pour of the session this is."""
    time: float
    """Simulated time [s]."""
    position: npt.NDArray[np.float32]
    """Centres of mass [m], shape (n, 3)."""
    quaternion: npt.NDArray[np.float32]
    """Orientation of the principal frame, wxyz, shape (n, 4)."""
    component: npt.NDArray[np.int32]
    """Index into ``scene.bodies``, shape (n,)."""
    inside: npt.NDArray[np.bool_]
    """False for bodies that rolled out of the domain, shape (n,)."""
    scale: npt.NDArray[np.float32]
    """Linear size relative to the declared one, shape (n,)."""
    surfaces: npt.NDArray[np.float64] = field(default_factory=lambda: NO_SURFACES)
    """Poses of the rig's surfaces: origin [m] and orientation wxyz, shape (k, 7)."""


def shared_block(context: Any) -> Any:
    """Shared memory for frames, to be handed to a process that ``context`` (multiprocessing) starts."""
    return shared_slots(context, SLOT)


class FrameWriter:
    """The solver's end of the block."""

    def __init__(self, block: Any) -> None:
        self._writer = SlotWriter(block, SLOT)

    def publish(
        self, bodies: Bodies, generation: int, time: float, surfaces: npt.NDArray[np.float64] = NO_SURFACES
    ) -> None:
        """Write a frame; there must not be more than ``MAX_BODIES`` bodies and ``MAX_SURFACES`` poses (k, 7)."""
        n = len(bodies.mass)

        def fill(slot: Any) -> None:
            slot["generation"], slot["time"], slot["bodies"] = generation, time, n
            slot["position"][0, :n] = bodies.position
            slot["quaternion"][0, :n] = bodies.quaternion
            slot["component"][0, :n] = bodies.component
            slot["inside"][0, :n] = bodies.inside
            slot["scale"][0, :n] = bodies.scale
            slot["surfaces"], slot["pose"][0, : len(surfaces)] = len(surfaces), surfaces

        self._writer.publish(fill)


class FrameReader:
    """The page's end of the block."""

    def __init__(self, block: Any, between: Callable[[], None] = lambda: None) -> None:
        """``between``: see :class:`SlotReader`."""
        self._reader = SlotReader(block, SLOT, _copy, between)

    def newest(self) -> Frame | None:
        """The newest frame, or None before the first one; the same object as long as nothing new was published."""
        return self._reader.newest()


def _copy(slot: Any, number: int) -> Frame:
    n = int(slot["bodies"])
    return Frame(
        number=number,
        generation=int(slot["generation"]),
        time=float(slot["time"]),
        position=slot["position"][:n].copy(),
        quaternion=slot["quaternion"][:n].copy(),
        component=slot["component"][:n].copy(),
        inside=slot["inside"][:n].copy(),
        scale=slot["scale"][:n].copy(),
        surfaces=slot["pose"][: int(slot["surfaces"])].copy(),
    )
