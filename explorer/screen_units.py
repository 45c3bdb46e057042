"""Units as a person reads them: a value in SI and its parameter → the number and unit on the screen, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass

from solver.params import UNITS, Parameter

SCREEN_UNIT = {"Pa": "MPa", "m": "mm", "kg": "g", "kg/s": "g/s"}
"""What is shown instead of the SI unit."""
DECIMALS = {"mm": 1, "g": 1, "g/s": 1}


class InputError(ValueError):
    """A number from the page that cannot be used; one line, fit for a user."""


@dataclass(frozen=True)
class ScreenUnit:
    """Unit on the screen, and its size in SI."""

    name: str
    factor: float

    def to_screen(self, value: float) -> float:
        """SI → screen, to six digits: what a number box shows."""
        return float(f"{value / self.factor:.6g}")

    def to_si(self, number: float) -> float:
        """Screen → SI."""
        return number * self.factor


def screen_unit(parameter: Parameter) -> ScreenUnit:
    """Unit in which ``parameter`` is shown; empty for a plain number."""
    name = SCREEN_UNIT.get(parameter.unit, "" if parameter.unit == "1" else parameter.unit)
    return ScreenUnit(name, UNITS.get(parameter.unit, {}).get(name, 1.0))


def title(parameter: Parameter) -> str:
    """Name of a parameter for a label: last part of its path, with the unit on the screen."""
    words = parameter.path.split(".")[-1].replace("_", " ").capitalize()
    unit = screen_unit(parameter).name
    return f"{words} [{unit}]" if unit else words


def checked(number: object, low: float, high: float, name: str) -> float:
    """A number that came from a browser, within ``low`` … ``high``.

    viser checks nothing on the server: anything can arrive here. A number outside the range is taken as its
    end; what is no finite number raises InputError.
    """
    if isinstance(number, bool) or not isinstance(number, (int, float)) or not math.isfinite(number):
        raise InputError(f"{name}: {str(number)[:40]!r} is not a finite number")
    return min(max(float(number), low), high)


def quantity(value: float, unit: str) -> str:
    """Short text of a value in SI with the unit of the screen, e.g. 0.03, "kg" → "30 g"."""
    name = SCREEN_UNIT.get(unit, "" if unit == "1" else unit)
    factor = UNITS.get(unit, {}).get(name, 1.0)
    if not math.isfinite(value):
        return "–"
    return f"{value / factor:.4g} {name}".strip()
