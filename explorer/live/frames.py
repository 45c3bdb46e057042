"""Frames in shared memory: the solver's process writes the newest state of all bodies, the page's process reads it.

A block has two slots and a counter. The writer fills the slot that was not published last, then increments the counter.
A reader copies the published slot and then checks the counter again: if it has not changed, the writer was at work on
the other slot, so the copy is complete. There is no lock that a dying process could keep. Details of the contacts
travel in a block of the same kind (``explorer/live/details.py``).
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from solver.pours.record import Bodies

T = TypeVar("T")

READ_ATTEMPTS = 5
"""Attempts to copy a slot before the last complete copy is returned again."""
MAX_BODIES = 32768
"""Maximum number of bodies in a frame."""
MAX_SURFACES = 64
"""Maximum number of surfaces of a rig in a frame."""
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
"""One frame in memory; only the first ``bodies`` rows of the arrays and the first ``surfaces`` poses are filled."""


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


class FrameWriter:
    """The solver's end of the block."""

    def __init__(self, block: Any) -> None:
        self._writer = SlotWriter(block, SLOT)

    def publish(
        self, bodies: Bodies, generation: int, time: float, surfaces: npt.NDArray[np.float64] = NO_SURFACES
    ) -> None:
        """Write a frame of at most ``MAX_BODIES`` bodies and ``MAX_SURFACES`` poses (k, 7)."""
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
        """The newest frame, or None before the first one; the same object until a new one is published."""
        return self._reader.newest()


def shared_block(context: Any) -> Any:
    """Shared memory for frames, for a process that ``context`` (multiprocessing) starts."""
    return shared_slots(context, SLOT)


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


class SlotWriter:
    """The writer's end of a block."""

    def __init__(self, block: Any, slot: np.dtype[Any]) -> None:
        self._buffer = np.frombuffer(block, dtype=_buffer(slot))[0:1]

    def publish(self, fill: Callable[[Any], None]) -> None:
        """Let ``fill`` write the free slot (an array of one), then make it the newest."""
        following = int(self._buffer["counter"][0]) + 1
        fill(self._buffer["slots"][0, following % 2 : following % 2 + 1])
        self._buffer["counter"] = following


class SlotReader(Generic[T]):
    """The reader's end of a block. ``copy`` makes the result from a slot and its number, which counts from 1.

    ``between`` is called after each copy, before the check (tests put a writer there).
    """

    def __init__(
        self,
        block: Any,
        slot: np.dtype[Any],
        copy: Callable[[Any, int], T],
        between: Callable[[], None] = lambda: None,
    ) -> None:
        self._buffer = np.frombuffer(block, dtype=_buffer(slot))[0:1]
        self._copy, self._between = copy, between
        self._last: tuple[int, T] | None = None

    def newest(self) -> T | None:
        """The newest, or None before the first one.

        It is the same object until something new is published, and also if the writer overtook every attempt
        to copy (it would have to publish within a copy of some 10 µs, five times in a row).
        """
        for _ in range(READ_ATTEMPTS):
            counter = int(self._buffer["counter"][0])
            if counter == 0 or (self._last is not None and self._last[0] == counter):
                break
            found = self._copy(self._buffer["slots"][0, counter % 2], counter)
            self._between()
            if int(self._buffer["counter"][0]) == counter:
                self._last = counter, found
                break
        return None if self._last is None else self._last[1]


def shared_slots(context: Any, slot: np.dtype[Any]) -> Any:
    """Zeroed shared memory for two of ``slot``, for a process that ``context`` (multiprocessing) starts."""
    return context.RawArray(ctypes.c_byte, _buffer(slot).itemsize)


def _buffer(slot: np.dtype[Any]) -> np.dtype[Any]:
    """The shared block: ``counter`` is the number of slots published so far; number k lies in slot k mod 2."""
    return np.dtype([("counter", np.int64), ("slots", slot, (2,))], align=True)
