"""Numbers as a publication prints them: a figure stands for the interval that rounds to it.

"24.68" stands for 24.675 … 24.685, so its half unit is 0.005; "346" for 345.5 … 346.5; "<0.0001" for anything below.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

from doe.errors import AuditError
from doe.record import Record

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
    def interval(self) -> tuple[float, float]:
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


def printed(text: str) -> Printed:
    """Read a figure. Raises AuditError for what is no decimal number, with or without < or >, of ordinary size."""
    plain = text.strip().replace("\u2212", "-")
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
        raise AuditError(f"{text!r} is out of range; allowed are sizes from {SMALLEST:g} to {LARGEST:g}, and 0")
    return Printed(plain, value, half * scale, kind)


def printed_or_none(text: str) -> Printed | None:
    """The same, None for what is no such number."""
    try:
        return printed(text)
    except AuditError:
        return None
