"""What a bench test returns: quantities beside what was put in, and the curves they come from. Nothing here changes."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """One measured number. ``reference`` is what was put in, or None where there is nothing to compare with."""

    name: str
    unit: str
    value: float
    reference: float | None = None
    spread: float | None = None
    """Sample standard deviation over repeats, same unit."""

    @property
    def error(self) -> float | None:
        """value / reference − 1; None without a reference."""
        if self.reference is None or self.reference == 0.0 or not math.isfinite(self.value):
            return None
        return self.value / self.reference - 1.0


@dataclass(frozen=True)
class BenchResult:
    """Outcome of one bench test on one component against the wall. SI units unless a name says otherwise."""

    test: str
    body: str
    wall: str
    quantities: tuple[Quantity, ...]
    series: tuple[tuple[str, tuple[float, ...]], ...]
    """Curves (name with unit, values), all of one length."""
    table: tuple[tuple[str, tuple[float, ...]], ...] = ()
    """A study beside the test (name with unit, values), all of one length; empty where there is none."""
    note: str = ""

    def quantity(self, name: str) -> Quantity:
        """The quantity of that name."""
        return next(quantity for quantity in self.quantities if quantity.name == name)
