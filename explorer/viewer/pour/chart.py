"""Angle of repose with its spread over the flanks, and discharged mass, over simulated time, as they come in.

Changes of parameters are marks on a chart over time. viser's uPlot interface draws only lines, so a mark is a spike of
one series, up and down at one moment.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
import numpy.typing as npt
import viser
import viser.uplot

from explorer.live.messages import Event, Status
from explorer.viewer.palette import (
    ANGLE_LINE,
    ANGLE_SPREAD_BAND,
    ANGLE_SPREAD_LINE,
    AXIS_TEXT,
    GRID_LINE,
    MARK_LINE,
    MASS_LINE,
)
from explorer.viewer.panel import POUR, Now, PageContext, Panel
from explorer.viewer.pour.readout import angle_of_repose_deg
from solver.observables.observable import Value

Array = npt.NDArray[np.float64]

MOST_MARKS = 40
"""Moments that are marked at most; the oldest are dropped."""
HALF_WIDTH = 1e-5
"""Half the width of the foot of a spike [s]."""
MOST_LETTERS = 64
"""Longest legend of the marks [characters]."""
NO_MARKS = "no change yet"
LEGEND_INTERVAL = 1.0
"""Wall time [s] between two texts of a legend: the browser rebuilds the chart for each of them."""
MOST_POINTS = 300
"""Points kept of each curve; when there are more, every other one is dropped."""
LEAST_TOP_DEG = 50.0
"""The axis of the angle reaches at least to here [°]."""
SPREAD = (2, 1)
"""Indices of the upper and lower end of the angle's spread among the series."""


class Chart(Panel):
    """The chart on the page."""

    name, tab = "chart", POUR

    def __init__(self, page: PageContext) -> None:
        self._history, self._top_deg = PourCurves(), LEAST_TOP_DEG
        self._marks = Marks()
        self._plot = page.server.gui.add_uplot(
            self._history.drawn(()),
            _series(NO_MARKS),
            bands=(viser.uplot.Band(series=SPREAD, fill=ANGLE_SPREAD_BAND),),
            scales=_scales(LEAST_TOP_DEG),
            axes=(axis("x", 2), axis("angle", 3, "angle [°]"), axis("mass", 1, "mass [g]")),
            aspect=2.5,
            padding=(12, 8, 0, 0),
        )

    def show(self, now: Now) -> None:
        """Draw what is new, and mark the changes."""
        status, events = now.status, now.events
        marked = self._marks.take(events, status.generation)
        if self._history.add(status) or marked:
            columns = self._history.drawn(self._marks.times)
            self._plot.data = columns
            self._reach(columns[2])
        label = self._marks.new_label(events, status.generation, time.monotonic())
        if label is not None:
            self._plot.series = _series(label)

    def _reach(self, angle_deg: Array) -> None:
        """Let the axis reach the greatest angle."""
        top = max(LEAST_TOP_DEG, 10.0 * math.ceil(np.max(angle_deg, initial=0.0, where=np.isfinite(angle_deg)) / 10.0))
        if top != self._top_deg:
            self._top_deg = top
            self._plot.scales = _scales(top)


def _series(mark: str) -> tuple[viser.uplot.Series, ...]:
    return (
        viser.uplot.Series(label="time [s]"),
        line("− spread over flanks", ANGLE_SPREAD_LINE, "angle", width=1),
        line("+ spread", ANGLE_SPREAD_LINE, "angle", width=1),
        line("angle [°]", ANGLE_LINE, "angle"),
        line("mass below [g]", MASS_LINE, "mass"),
        line(mark, MARK_LINE, "mark", width=1),
    )


def _scales(top_deg: float) -> dict[str, viser.uplot.Scale]:
    # The range of the angle is set, since uPlot finds none among numbers that include NaN.
    return {
        "x": viser.uplot.Scale(time=False),
        "angle": viser.uplot.Scale(range=(0.0, top_deg)),
        "mark": viser.uplot.Scale(range=(0.0, 1.0)),
    }


def line(label: str, colour: str, scale: str, width: float = 2) -> viser.uplot.Series:
    """A series without points."""
    return viser.uplot.Series(label=label, stroke=colour, width=width, points={"show": False}, scale=scale)


def axis(scale: str, side: Any, label: str = "") -> viser.uplot.Axis:
    """An axis; ``side`` is uPlot's: 1 right, 2 bottom, 3 left."""
    grid = {"show": side != 1, "stroke": GRID_LINE}
    made: Any = {"scale": scale, "side": side, "stroke": AXIS_TEXT, "grid": grid, "size": 38}
    return made if not label else made | {"label": label, "labelSize": 18}


class PourCurves:
    """Angle of repose and mass below the outlet of one pour. The angle is read less often, and begins later."""

    def __init__(self) -> None:
        self._generation, self._time = 0, 0.0
        self._angle, self._spread, self._mass = ThinnedCurve(), ThinnedCurve(), ThinnedCurve()
        self._observed: Mapping[str, Value] = {}

    def add(self, status: Status) -> bool:
        """Take note of ``status``; True if there is something new to draw."""
        fresh = status.generation != self._generation
        if fresh:
            self._generation, self._observed = status.generation, {}
            self._angle, self._spread, self._mass = ThinnedCurve(), ThinnedCurve(), ThinnedCurve()
        back = not fresh and status.time < self._time
        self._time = status.time
        if back:
            # The angle in this status was read before and is already on the curve.
            self._observed = status.observables
            self._angle.cut(status.time)
            self._spread.cut(status.time)
            self._mass.cut(status.time)
        angle_deg = angle_of_repose_deg(status)
        # An angle that was not read again is not a point: the chart would draw steps.
        if status.observables != self._observed and math.isfinite(angle_deg):
            self._observed = status.observables
            self._angle.add(status.time, angle_deg)
            self._spread.add(status.time, status.observables["angle_of_repose_deg"].spread or 0.0)
        return self._mass.add(status.time, 1e3 * status.discharged_mass) or fresh or back

    def columns(self) -> tuple[Array, Array, Array]:
        """Time [s], angle [°], mass [g]; shape (n,) each.

        Between its points, a curve is interpolated linearly; before the first and after the last angle there is NaN,
        which the chart leaves out.
        """
        (angle_time, angle), (mass_time, mass) = self._angle.columns(), self._mass.columns()
        if not len(mass_time):
            return np.zeros(1), np.full(1, math.nan), np.zeros(1)
        time = np.union1d(angle_time, mass_time)
        inside = np.interp(time, angle_time, angle, math.nan, math.nan) if len(angle_time) else time * math.nan
        return time, inside, np.interp(time, mass_time, mass)

    def drawn(self, marks: Sequence[float]) -> tuple[Array, ...]:
        """Time [s], angle ∓ spread and angle [°], mass [g], and 1 at the ``marks`` [s]; shape (n,) each."""
        moments, angle, mass = self.columns()
        spread_time, spread = self._spread.columns()
        around = np.interp(moments, spread_time, spread) if len(spread_time) else np.zeros_like(moments)
        return with_marks((moments, np.maximum(angle - around, 0.0), angle + around, angle, mass), marks)


class ThinnedCurve:
    """Values over simulated time [s], thinned out when they become many."""

    def __init__(self) -> None:
        self._points: list[tuple[float, float]] = []

    def add(self, time: float, value: float) -> bool:
        """Add a point, unless it is not later than the last one; True if it was added."""
        if self._points and time <= self._points[-1][0]:
            return False
        self._points.append((time, value))
        if len(self._points) > MOST_POINTS:
            self._points = self._points[::2]
        return True

    def cut(self, time: float) -> None:
        """Forget points later than ``time``."""
        self._points = [point for point in self._points if point[0] <= time]

    def columns(self) -> tuple[Array, Array]:
        """Times and values, shape (n,) each."""
        points = np.array(self._points, dtype=np.float64).reshape(-1, 2)
        return points[:, 0], points[:, 1]


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
        """New text for the legend, not too soon after the last one; None if it stays. ``wall``: a clock [s]."""
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

    Where it begins later or ends earlier than the others (NaN), there is NaN again. A curve without NaN stays level:
    uPlot finds no range for an axis among numbers that include NaN.
    """
    known = np.isfinite(curve)
    if not known.any():
        return np.full(len(moments), math.nan)
    beyond = None if known.all() else math.nan
    found: Array = np.interp(moments, time[known], curve[known], beyond, beyond)
    return found
