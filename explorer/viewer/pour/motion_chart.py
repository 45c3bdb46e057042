"""Kinetic energy and number of contacts over simulated time, as they come in."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import viser
import viser.uplot

from explorer.live.messages import SessionState, Status
from explorer.viewer.palette import CONTACTS_LINE, ENERGY_LINE, MARK_LINE
from explorer.viewer.panel import POUR, Now, PageContext, Panel
from explorer.viewer.pour.chart import NO_MARKS, Marks, ThinnedCurve, axis, line, with_marks

Array = npt.NDArray[np.float64]


class MotionHistory:
    """Kinetic energy and contacts of one pour."""

    def __init__(self) -> None:
        self._generation, self._last = 0, -math.inf
        self._energy, self._contacts = ThinnedCurve(), ThinnedCurve()

    def add(self, status: Status) -> bool:
        """Record ``status``; True if there is something new to draw."""
        fresh = status.generation != self._generation
        if fresh:
            self._generation, self._last = status.generation, -math.inf
            self._energy, self._contacts = ThinnedCurve(), ThinnedCurve()
        if status.state == SessionState.STARTING:
            return fresh
        gone_back = status.time < self._last
        if gone_back:
            self._energy.cut(status.time)
            self._contacts.cut(status.time)
        self._last = status.time
        self._contacts.add(status.time, float(status.contacts))
        return self._energy.add(status.time, 1e3 * status.kinetic_energy) or fresh or gone_back

    def drawn(self, marks: Sequence[float]) -> tuple[Array, ...]:
        """Time [s], energy [mJ], contacts, and 1 at the ``marks`` [s]; shape (n,) each."""
        moments, energy = self._energy.columns()
        if not len(moments):
            return with_marks((np.zeros(1), np.zeros(1), np.zeros(1)), marks)
        return with_marks((moments, energy, self._contacts.columns()[1]), marks)


class MotionChart(Panel):
    """The chart on the page."""

    name, tab = "motion", POUR

    def __init__(self, page: PageContext) -> None:
        self._history = MotionHistory()
        self._marks = Marks()
        self._plot = page.server.gui.add_uplot(
            self._history.drawn(()),
            _series(NO_MARKS),
            scales={"x": viser.uplot.Scale(time=False), "mark": viser.uplot.Scale(range=(0.0, 1.0))},
            axes=(axis("x", 2), axis("energy", 3, "energy [mJ]"), axis("contacts", 1, "contacts")),
            aspect=2.5,
            padding=(12, 8, 0, 0),
        )

    def show(self, now: Now) -> None:
        """Draw what is new, and mark the changes."""
        status, events = now.status, now.events
        marked = self._marks.take(events, status.generation)
        if self._history.add(status) or marked:
            self._plot.data = self._history.drawn(self._marks.times)
        label = self._marks.new_label(events, status.generation, time.monotonic())
        if label is not None:
            self._plot.series = _series(label)


def _series(mark: str) -> tuple[viser.uplot.Series, ...]:
    return (
        viser.uplot.Series(label="time [s]"),
        line("kinetic energy [mJ]", ENERGY_LINE, "energy"),
        line("contacts", CONTACTS_LINE, "contacts"),
        line(mark, MARK_LINE, "mark", width=1),
    )
