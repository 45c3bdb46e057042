"""Columns of a laboratory's tables: what each holds, the units that its name may end in, and what it may be.

A column is named ``<stem>_<unit>`` (``force_N``, ``thickness_mm``). Values are SI inside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
AREA = {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6}
FORCE = {"N": 1.0, "kN": 1e3, "mN": 1e-3}
MASS = {"kg": 1.0, "g": 1e-3, "mg": 1e-6}
ANGLE = {"deg": math.pi / 180.0, "rad": 1.0}
SPEED = {"m_s": 1.0, "cm_s": 1e-2, "mm_s": 1e-3}
DENSITY = {"kg_m3": 1.0, "g_cm3": 1e3}


@dataclass(frozen=True)
class Column:
    """One column: ``low`` < value < ``high`` in SI, or 0 where ``zero``; ``needed`` says if it must be there.

    blank: whether single cells of it may be empty; such a row has no value of this column.
    """

    stem: str
    units: dict[str, float]
    low: float = -math.inf
    high: float = math.inf
    zero: bool = False
    needed: bool = True
    blank: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The names that it may have in a file."""
        return tuple(f"{self.stem}_{unit}" for unit in self.units)

    def factor(self, name: str) -> float:
        """Factor to SI of the column ``name``."""
        return self.units[name.removeprefix(f"{self.stem}_")]

    def allowed(self, value: float) -> bool:
        """True if ``value`` [SI] may stand in this column."""
        return self.low < value < self.high or (self.zero and value == 0.0)

    def range_text(self, name: str) -> str:
        """What may stand in the column ``name``, in its own unit."""
        unit = name.removeprefix(f"{self.stem}_").replace("_", "/")
        low, high = self.low / self.factor(name), self.high / self.factor(name)
        bounds = [f"above {low:g}"] * math.isfinite(low) + [f"below {high:g}"] * math.isfinite(high)
        number = "a number " + " and ".join(bounds) if bounds else "a finite number"
        return f"{number} {unit}" if bounds else f"{number} in {unit}"


def positive(stem: str, units: dict[str, float], needed: bool = True) -> Column:
    """A column of numbers above zero."""
    return Column(stem, units, low=0.0, needed=needed)


@dataclass(frozen=True)
class Layout:
    """What a test's table looks like: columns of names that tell specimens apart, and columns of numbers."""

    keys: tuple[str, ...]
    columns: tuple[Column, ...]
    curves: bool = False
    """Whether one replicate may be many rows, the points of a curve."""


COMPONENT = ("component",)
PAIR = ("a", "b")

FORCE_DISPLACEMENT = Layout(
    COMPONENT,
    (
        positive("thickness", LENGTH),
        positive("area", AREA),
        Column("displacement", LENGTH),
        Column("force", FORCE),
    ),
    curves=True,
)
INCLINED_PLANE = Layout(PAIR, (Column("angle", ANGLE, low=0.0, high=math.pi / 2.0, zero=True),))
DROP = Layout(
    PAIR,
    (
        positive("drop_height", LENGTH),
        positive("distance", LENGTH, needed=False),
        Column("v_x", SPEED, needed=False),
        Column("v_z", SPEED, needed=False),
    ),
)
MOISTURE = Layout(
    COMPONENT,
    (positive("mass_before", MASS), positive("mass_after", MASS), positive("mass_container", MASS, needed=False)),
)
IMMERSION = Layout(
    COMPONENT,
    (
        positive("mass", MASS),
        Column("mass_reference", MASS, low=0.0, zero=True),
        Column("mass_with_sample", MASS),
        positive("liquid_density", DENSITY),
        positive("mass_soaked", MASS, needed=False),
    ),
)
COMPOSITION = Layout(COMPONENT, (Column("mass", MASS, low=0.0, zero=True),))
DIMENSIONS = Layout(
    COMPONENT,
    (
        positive("length", LENGTH),
        positive("width", LENGTH),
        Column("thickness", LENGTH, low=0.0, needed=False, blank=True),
    ),
)
