"""Changes of parameters as marks on a chart over time.

uPlot draws lines only, as viser hands it on: a mark is a spike of one series, up and down at one moment.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

import numpy as np
import numpy.typing as npt

from explorer.live.messages import Event

Array = npt.NDArray[np.float64]

MOST_MARKS = 40
"""Moments that are marked; the oldest are given up."""
HALF_WIDTH = 1e-5
"""Half the foot of a spike [s]."""
MOST_LETTERS = 64
NO_MARKS = "no change yet"


LEGEND_INTERVAL = 1.0
"""Wall time [s] between two texts of a legend: with every one of them the browser makes the chart anew."""


class Marks:
    """The marks of one chart, and the text of their legend."""

    def __init__(self) -> None:
        self.times: tuple[float, ...] = ()
        """Moments that are marked [s]."""
        self._label, self._label_due = NO_MARKS, -math.inf

    def take(self, events: Sequence[Event], generation: int) -> bool:
        """Take the changes among ``events`` of the pour ``generation``; True if other moments are marked now."""
        times = change_times(events, generation)
        new = times != self.times
        self.times = times
        return new

    def new_label(self, events: Sequence[Event], generation: int, wall: float) -> str | None:
        """Another text for the legend, not too soon after the last one; None where it stays. ``wall``: a clock [s]."""
        label = change_label(events, generation)
        if label == self._label or wall < self._label_due:
            return None
        self._label, self._label_due = label, wall + LEGEND_INTERVAL
        return label


def change_times(events: Sequence[Event], generation: int) -> tuple[float, ...]:
    """Moments [s] of the pour ``generation`` at which parameters were changed, ascending."""
    times = sorted({event.time for event in events if event.is_change and event.generation == generation})
    return tuple(times[-MOST_MARKS:])


def change_label(events: Sequence[Event], generation: int) -> str:
    """Text of the legend: the last change, old → new, and how many more came at the same moment."""
    mine = [event for event in events if event.is_change and event.generation == generation]
    if not mine:
        return NO_MARKS
    *_, (time, last) = ((time, list(group)) for time, group in groupby(mine, key=lambda event: event.time))
    text = last[0].text
    short = text if len(text) <= MOST_LETTERS else f"…{text[1 - MOST_LETTERS :]}"
    more = f" (and {len(last) - 1} more)" if len(last) > 1 else ""
    return f"{time:.2f} s {short}{more}"


def with_marks(columns: Sequence[Array], times: Sequence[float]) -> tuple[Array, ...]:
    """``columns``, time [s] first, with a last column that is 1 at ``times`` and 0 at all other moments."""
    time, *curves = columns
    feet = np.array(times, dtype=np.float64)
    moments = np.unique(np.concatenate([time, feet - HALF_WIDTH, feet, feet + HALF_WIDTH]))
    drawn = [_between(moments, time, curve) for curve in curves]
    return (moments, *drawn, np.isin(moments, feet).astype(np.float64))


def _between(moments: Array, time: Array, curve: Array) -> Array:
    """``curve`` at ``moments`` on the lines through its points.

    Where it begins later or ends earlier than the others (NaN) there is NaN again. A curve without NaN goes on level:
    uPlot finds no range for an axis among numbers that include NaN.
    """
    known = np.isfinite(curve)
    if not known.any():
        return np.full(len(moments), math.nan)
    beyond = None if known.all() else math.nan
    found: Array = np.interp(moments, time[known], curve[known], beyond, beyond)
    return found
