"""What an observable is: a named scalar with its unit, what it is read off, and what reading it can reveal.

To add one: a function and a line in the table of its file, or an entry point ``observable.NAME`` of a package of one's
own (``solver/plugins.py``). Every rig that gives its group gives it; page, studies, measured data and reports follow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from solver.effects.effect import Telltale
from solver.observables.reading import PileReading
from solver.observables.value import Value

if TYPE_CHECKING:
    from solver.record import Record


@dataclass(frozen=True)
class Observable:
    """A named scalar. ``needs``: what ``function`` takes, a pile's reading or the whole record."""

    name: str
    unit: str
    doc: str
    function: Callable[..., Value]
    needs: Literal["pile", "record"]
    group: str = ""
    """Rigs that give this group give it (``rigs/rig.py``); empty: only a rig that names it, or whoever asks for it."""
    telltales: tuple[Telltale, ...] = ()
    """Classes of observables that it belongs to: an effect that none of them reveals stays hidden in it."""
    label: str = ""
    """As a report writes it; empty: its name with blanks."""
    estimator: bool = False
    """Whether a study weighs it up, unasked, as the response of its screening: an estimator of the angle of repose."""
    scanned: bool = False
    """Whether it is read, unasked, off a measured scan."""


@dataclass(frozen=True)
class ComponentObservable:
    """A scalar per component of the pile; observed as ``<name>.<component>``."""

    name: str
    unit: str
    doc: str
    function: Callable[[PileReading], dict[str, Value]]


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
) -> Observable:
    """An observable that a pile alone gives, a simulated one or a scan; documented by its function's first line."""
    text = doc or first_line(function)
    return Observable(name, unit, text, function, "pile", group, telltales, label, estimator, scanned)


def of_record(
    name: str,
    unit: str,
    function: Callable[[Record], Value],
    *telltales: Telltale,
    group: str,
    scanned: bool = False,
) -> Observable:
    """An observable of a whole run; documented by its function's first line."""
    return Observable(name, unit, first_line(function), function, "record", group, telltales, scanned=scanned)


def first_line(function: Callable[..., object]) -> str:
    """First line of a docstring."""
    return (function.__doc__ or "").splitlines()[0]
