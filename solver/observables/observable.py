"""What an observable is: a named scalar with its unit, what it is read from, and what reading it can reveal.

It returns a :class:`Value`, a number with its unit and, where one exists, its spread.

To add one, write a function and a line in the table of its file, or an entry point ``observable.NAME`` in your own
package (``solver/plugins.py``). Every rig that gives its group then gives it, and the page, studies, measured data and
reports include it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from solver.effects.effect import Telltale
from solver.observables.reading import PileReading

if TYPE_CHECKING:
    from solver.pours.record import Record

Range = tuple[float, float]

ANY: Range = (-math.inf, math.inf)
ANGLE: Range = (0.0, 90.0)
"""Range of an angle with the horizontal [°]."""
TILT: Range = (-90.0, 90.0)
"""Range of an angle whose sign gives the direction of the slope [°]."""
SHARE: Range = (0.0, 1.0)
AT_LEAST_0: Range = (0.0, math.inf)


@dataclass(frozen=True)
class Value:
    """One observed number. NaN means: not measurable on this record."""

    value: float
    unit: str
    spread: float | None = None
    """Sample standard deviation of the parts that ``value`` is the mean of (views, flanks), same unit."""


@dataclass(frozen=True)
class Observable:
    """A named scalar. ``needs``: what ``function`` takes, a pile's reading or the whole record."""

    name: str
    unit: str
    doc: str
    function: Callable[..., Value]
    needs: Literal["pile", "record"]
    group: str = ""
    """Rigs that give this group give it (``rigs/rig.py``); empty: only rigs that name it give it, or on request."""
    telltales: tuple[Telltale, ...] = ()
    """Classes of observables that it belongs to; it does not show an effect that none of them reveals."""
    label: str = ""
    """Name in a report; empty: its name with blanks."""
    estimator: bool = False
    """Whether a study considers it by default as the response of its screening: an estimator of the angle of repose."""
    scanned: bool = False
    """Whether it is read from a measured scan by default."""
    possible: Range = ANY
    """Smallest and largest value that can be measured, ends included, in ``unit``."""

    def is_possible(self, value: float) -> bool:
        """Whether ``value``, in ``unit``, can be measured."""
        low, high = self.possible
        return low <= value <= high


@dataclass(frozen=True)
class ComponentObservable:
    """A scalar per component of the pile; observed as ``<name>.<component>``."""

    name: str
    unit: str
    doc: str
    function: Callable[[PileReading], dict[str, Value]]


def mean_value(parts: Sequence[float], unit: str) -> Value:
    """Mean and sample standard deviation of those ``parts`` that could be measured; NaN where none could."""
    finite = np.asarray(parts, dtype=np.float64)
    finite = finite[np.isfinite(finite)]
    if finite.size == 0:
        return Value(float("nan"), unit, None)
    spread = float(finite.std(ddof=1)) if finite.size > 1 else None
    return Value(float(finite.mean()), unit, spread)


def of_pile(
    name: str,
    unit: str,
    function: Callable[[PileReading], Value],
    *telltales: Telltale,
    group: str,
    doc: str = "",
    label: str = "",
    estimator: bool = False,
    scanned: bool = False,
    possible: Range = ANY,
) -> Observable:
    """An observable of a pile alone, simulated or scanned; documented by the first line of its function's docstring."""
    text = doc or first_line(function)
    return Observable(name, unit, text, function, "pile", group, telltales, label, estimator, scanned, possible)


def of_record(
    name: str,
    unit: str,
    function: Callable[[Record], Value],
    *telltales: Telltale,
    group: str,
    scanned: bool = False,
    possible: Range = ANY,
) -> Observable:
    """An observable of a whole run; documented by the first line of its function's docstring."""
    return Observable(
        name, unit, first_line(function), function, "record", group, telltales, scanned=scanned, possible=possible
    )


def first_line(function: Callable[..., object]) -> str:
    """First line of a docstring."""
    return (function.__doc__ or "").splitlines()[0]
