"""Two slots and a counter in shared memory: one process writes the newest of something, another reads it.

The writer fills the slot that was not published last and then raises the counter; a reader copies the published slot
and looks at the counter again: while it has not moved, the writer was at work on the other slot, so the copy is whole.
No lock is involved that a dying process could keep.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import numpy as np

T = TypeVar("T")
READ_ATTEMPTS = 5


def _buffer(slot: np.dtype[Any]) -> np.dtype[Any]:
    """The shared block: ``counter`` is the number of slots published so far; number k lies in slot k mod 2."""
    return np.dtype([("counter", np.int64), ("slots", slot, (2,))], align=True)


def shared_slots(context: Any, slot: np.dtype[Any]) -> Any:
    """Zeroed shared memory for two of ``slot``, for a process that ``context`` (multiprocessing) starts."""
    return context.RawArray(ctypes.c_byte, _buffer(slot).itemsize)


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
    """The reader's end of a block. ``copy`` makes what is read from a slot and its number, from 1.

    ``between`` is called after each copy, before it is checked (tests put a writer there).
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

        The same object as long as nothing new was published, and also where the writer overtook every attempt
        to copy (it would have to publish twice within a copy of some 10 µs, five times in a row).
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
