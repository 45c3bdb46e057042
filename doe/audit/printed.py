"""Numbers as a publication prints them: a figure stands for the interval that rounds to it.

"24.68" stands for 24.675 … 24.685, so its half unit is 0.005; "346" for 345.5 … 346.5; "<0.0001" for anything below.

What is computed from printed inputs carries the slack of their rounding. An input that is printed to ± h is anywhere in
that interval; to first order the result moves by g_i = f(x + h_i) − f(x) for input i. Two bounds hold: the sum of
|g_i|, always, and √(3 Σ g_i²), three standard deviations of a sum of independent uniform errors (variance h²/3 each).
The smaller one is taken.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt

from doe.errors import AuditError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
Computation = Callable[[FloatArray], FloatArray]
Interval = tuple[float, float]

NUMBER = re.compile(r"([<>]?)\s*([+-]?(?:\d+\.?\d*|\.\d+))(?:[eE]([+-]?\d{1,3}))?")
SMALLEST, LARGEST = 1e-30, 1e30
"""Sizes that physical quantities have in any unit; squares of sums of them stay finite."""
DUST = 1e-9
"""Relative rounding of the recomputation itself, far below any print."""


@dataclass(frozen=True)
class Printed(Record):
    """A printed number: its text, its value, half a unit of its last digit, and whether it is a bound."""

    text: str
    value: float
    half: float
    bound: Literal["", "<", ">"] = ""

    @property
    def decimals(self) -> int:
        """Digits behind the point."""
        return len(self.text.lower().partition("e")[0].partition(".")[2])

    @property
    def interval(self) -> Interval:
        """Least and largest value that it stands for."""
        if self.bound == "<":
            return -math.inf, self.value
        return (self.value, math.inf) if self.bound == ">" else (self.value - self.half, self.value + self.half)

    def agrees(self, value: float, slack: float = 0.0) -> bool:
        """Whether ``value``, known to ± ``slack``, rounds to the print or lies beyond its bound."""
        room = slack + DUST * max(abs(value), abs(self.value))
        if self.bound == "<":
            return value < self.value + room
        if self.bound == ">":
            return value > self.value - room
        return abs(value - self.value) <= self.half + room

    def meets(self, interval: Interval) -> bool:
        """Whether some value in ``interval`` rounds to the print or lies beyond its bound."""
        room = DUST * max(abs(end) for end in (*interval, self.value) if math.isfinite(end))
        least, most = self.interval
        return interval[0] <= most + room and interval[1] >= least - room


def printed(text: str) -> Printed:
    """Read a figure; stars of significance behind it are no part of it.

    Raises AuditError for what is no decimal number, with or without < or >, of ordinary size.
    """
    plain = text.strip().rstrip("* ").replace("\u2212", "-")
    match = NUMBER.fullmatch(plain)
    if match is None:
        raise AuditError(f"{text!r} is not a printed number; allowed: 24.68, 1.2e-3, <0.0001")
    bound, digits, exponent = match.groups()
    scale = 10.0 ** int(exponent or 0)
    half = 0.5 * 10.0 ** -len(digits.partition(".")[2])
    if bound == "<":
        kind: Literal["", "<", ">"] = "<"
    else:
        kind = ">" if bound == ">" else ""
    value = float(f"{digits}e{exponent or 0}")
    if not (value == 0 or SMALLEST <= abs(value) <= LARGEST):
        raise AuditError(f"{text!r} is out of range; allowed: 0, and absolute values from {SMALLEST:g} to {LARGEST:g}")
    return Printed(plain, value, half * scale, kind)


def printed_or_none(text: str) -> Printed | None:
    """The same, None for what is no such number."""
    try:
        return printed(text)
    except AuditError:
        return None


def values_of(prints: Sequence[Printed]) -> FloatArray:
    """Values of printed numbers, shape (n,)."""
    return np.array([one.value for one in prints], dtype=np.float64)


def halves_of(prints: Sequence[Printed]) -> FloatArray:
    """Half units of their last digits, shape (n,)."""
    return np.array([one.half for one in prints], dtype=np.float64)


def common_half(prints: Sequence[Printed]) -> FloatArray:
    """Half units of a column of readings, shape (n,): the finest one for all, because trailing zeros get lost."""
    halves = halves_of(prints)
    return np.full(halves.shape, halves.min()) if halves.size else halves


def rounding_slack(compute: Computation, values: FloatArray, halves: FloatArray) -> FloatArray:
    """How far ``compute(values)``, shape (k,), can move when values, shape (n,), are rounded to ± halves."""
    table = _moves(compute, values, halves)
    return np.minimum(table.sum(axis=0), np.sqrt(3 * (table**2).sum(axis=0)))


def worst_case(compute: Computation, values: FloatArray, halves: FloatArray) -> FloatArray:
    """The same in the worst case, Σ |g_i|: exact for what is linear in the values."""
    return np.asarray(_moves(compute, values, halves).sum(axis=0))


def _moves(compute: Computation, values: FloatArray, halves: FloatArray) -> FloatArray:
    """|g_i| of every input that is rounded, shape (inputs, k)."""
    base = compute(values)
    moves = [np.zeros_like(base)]
    for i in np.flatnonzero(halves > 0):
        half = np.where(np.arange(len(values)) == i, halves, 0.0)
        up, down = (np.abs(compute(values + side * half) - base) for side in (1.0, -1.0))
        moves.append(np.where(np.isfinite(up), up, down))  # beyond the end of a root, say, nothing is defined
    return np.array(moves)


def most_agreed(
    intervals: Sequence[Sequence[tuple[float, float]]], near: float
) -> tuple[float, float, tuple[bool, ...]]:
    """The interval that lies in most of several sets of intervals, and which of the sets hold it.

    One wrong figure among many that imply the same unknown is outvoted; of several intervals with equally many votes
    the one nearest to ``near`` counts. Raises ValueError without an interval that has a width.
    """
    ends = sorted({end for choices in intervals for interval in choices for end in interval})
    regions = [(low, high) for low, high in pairwise(ends)]
    if not regions:
        raise ValueError("no interval was given")
    votes = [sum(_holds(choices, 0.5 * (low + high)) for choices in intervals) for low, high in regions]
    most = [region for region, count in zip(regions, votes, strict=True) if count == max(votes)]
    low, high = min(most, key=lambda region: max(region[0] - near, near - region[1], 0.0))
    return low, high, tuple(_holds(choices, 0.5 * (low + high)) for choices in intervals)


def _holds(choices: Sequence[tuple[float, float]], value: float) -> bool:
    return any(low <= value <= high for low, high in choices)
