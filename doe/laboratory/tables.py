"""A laboratory's CSV file → rows in SI, with one clear line for whatever is wrong.

First the names of the columns, then one row per reading; cells and numbers as `doe.table_file` reads them. ``#`` starts
a comment: a reading behind it is left out and stays visible. Rows are counted as a spreadsheet does, the first line of
the file being row 1. A column is named ``<stem>_<unit>`` (``force_N``, ``thickness_mm``); the layout of a table says
what each holds, the units that its name may end in, and what values it may have.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from doe.table_file import read_table as read_cells

LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
AREA = {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6}
FORCE = {"N": 1.0, "kN": 1e3, "mN": 1e-3}
MASS = {"kg": 1.0, "g": 1e-3, "mg": 1e-6}
ANGLE = {"deg": math.pi / 180.0, "rad": 1.0}
SPEED = {"m_s": 1.0, "cm_s": 1e-2, "mm_s": 1e-3}
DENSITY = {"kg_m3": 1.0, "g_cm3": 1e3}
NUMBER = {"": 1.0}
"""Of a column whose name is its stem alone."""
COMPONENT = ("component",)
PAIR = ("a", "b")
MOST_BYTES = 50_000_000
NAME = re.compile(r"[A-Za-z0-9_-]{1,60}")
"""What a component may be called: its name becomes part of a parameter's path."""
REPLICATE, NOTE = "replicate", "note"


class LaboratoryError(ValueError):
    """Readings that nothing can be computed from; one line naming file, row, column and what is allowed."""


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
        return tuple(f"{self.stem}_{unit}".rstrip("_") for unit in self.units)

    def factor(self, name: str) -> float:
        """Factor to SI of the column ``name``."""
        return self.units[name.removeprefix(self.stem).removeprefix("_")]

    def allowed(self, value: float) -> bool:
        """True if ``value`` [SI] may stand in this column."""
        return self.low < value < self.high or (self.zero and value == 0.0)

    def range_text(self, name: str) -> str:
        """What may stand in the column ``name``, in its own unit."""
        unit = name.removeprefix(self.stem).removeprefix("_").replace("_", "/")
        low, high = self.low / self.factor(name), self.high / self.factor(name)
        bounds = [f"above {low:g}"] * math.isfinite(low) + [f"below {high:g}"] * math.isfinite(high)
        number = "a number " + " and ".join(bounds) if bounds else "a finite number"
        return f"{number} {unit}".rstrip() if bounds else f"{number} in {unit}"


@dataclass(frozen=True)
class Layout:
    """What a test's table looks like: columns of names that tell specimens apart, and columns of numbers."""

    keys: tuple[str, ...]
    columns: tuple[Column, ...]
    curves: bool = False
    """Whether one replicate may be many rows, the points of a curve."""


INCLINED_PLANE = Layout(PAIR, (Column("angle", ANGLE, low=0.0, high=math.pi / 2.0, zero=True),))
COMPOSITION = Layout(COMPONENT, (Column("mass", MASS, low=0.0, zero=True),))


@dataclass(frozen=True)
class Reading:
    """One reading: its row in the file, whose it is, and the numbers by column (SI)."""

    line: int
    of: tuple[str, ...]
    replicate: str
    values: dict[str, float]


@dataclass(frozen=True)
class Table:
    """All readings of a file, in its order."""

    file: str
    rows: tuple[Reading, ...]

    def groups(self) -> dict[tuple[str, ...], tuple[Reading, ...]]:
        """Rows by whose they are; a pair means the same in either order."""
        found: dict[tuple[str, ...], list[Reading]] = {}
        for row in self.rows:
            turned = row.of[::-1]
            found.setdefault(turned if turned in found else row.of, []).append(row)
        return {of: tuple(rows) for of, rows in found.items()}

    def wrong(self, row: Reading, column: str, text: str) -> LaboratoryError:
        """An error about one cell."""
        return LaboratoryError(f"{self.file}, row {row.line}, column {column}: {text}")


def read_table(path: Path, layout: Layout) -> Table:
    """The readings in ``path``; LaboratoryError in one line naming file, row and column."""
    found = read_cells(path, MOST_BYTES, LaboratoryError, ", row {}", comments=True)
    if not found.rows:
        raise LaboratoryError(f"{path}: no rows; allowed: {_columns_text(layout)}, and readings below")
    (line, header), *readings = found.rows
    columns = _columns(f"{path}, row {line}", header, layout)
    rows = []
    for line, cells in readings:
        where = f"{path}, row {line}"
        if len(cells) != len(header):
            raise LaboratoryError(
                f"{where}: {len(cells)} cells; allowed: {len(header)}, one per column (between commas, decimals with a "
                "point)"
            )
        rows.append(_row(where, line, dict(zip(header, cells, strict=True)), columns, layout, found.number))
    if not rows:
        raise LaboratoryError(f"{path}: no readings below the names of the columns")
    table = Table(str(path), tuple(rows))
    if not layout.curves:
        _check_single(table)
    return table


def positive(stem: str, units: dict[str, float], needed: bool = True, blank: bool = False) -> Column:
    """A column of numbers above zero."""
    return Column(stem, units, low=0.0, needed=needed, blank=blank)


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
COMPRESSION = Layout(
    COMPONENT,
    (
        positive("thickness", LENGTH, needed=False, blank=True),
        positive("area", AREA, needed=False, blank=True),
        Column("displacement", LENGTH),
        Column("force", FORCE),
        positive("radius", LENGTH, needed=False, blank=True),
        positive("radius_2", LENGTH, needed=False, blank=True),
        Column("poisson_ratio", NUMBER, low=0.0, high=0.5, zero=True, needed=False, blank=True),
        Column("contacts", NUMBER, low=0.0, high=3.0, needed=False, blank=True),
    ),
    curves=True,
)
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
DIMENSIONS = Layout(
    COMPONENT,
    (
        positive("length", LENGTH),
        positive("width", LENGTH),
        Column("thickness", LENGTH, low=0.0, needed=False, blank=True),
    ),
)


def _columns(where: str, header: list[str], layout: Layout) -> dict[str, Column]:
    """Columns of numbers by their name in the file."""
    twice = next((name for name in header if header.count(name) > 1), None)
    if twice is not None:
        raise LaboratoryError(f"{where}, column {twice}: stands twice; allowed: once")
    found: dict[str, Column] = {}
    for name in header:
        if name in (*layout.keys, REPLICATE, NOTE):
            continue
        column = next((column for column in layout.columns if name in column.names), None)
        if column is None:
            raise LaboratoryError(f"{where}, column {name!r}: {_why_unknown(name, layout)}")
        if any(other.stem == column.stem for other in found.values()):
            raise LaboratoryError(f"{where}, column {name}: {column.stem} stands twice; allowed: in one unit")
        found[name] = column
    for key in (*layout.keys, REPLICATE):
        if key not in header:
            raise LaboratoryError(f"{where}: column {key} is missing; allowed: {_columns_text(layout)}")
    for column in layout.columns:
        if column.needed and column not in found.values():
            raise LaboratoryError(f"{where}: column {column.names[0]} is missing (or {', '.join(column.names[1:])})")
    return found


def _why_unknown(name: str, layout: Layout) -> str:
    """A name that only its unit keeps from being a column gets the units that are allowed."""
    stems = [c for c in layout.columns if name == c.stem or name.startswith(f"{c.stem}_")]
    if stems:
        nearest = max(stems, key=lambda column: len(column.stem))
        return f"wrong or missing unit; allowed: {', '.join(nearest.names)}"
    return f"unknown; allowed: {_columns_text(layout)}"


def _columns_text(layout: Layout) -> str:
    numbers = [column.names[0] if column.needed else f"[{column.names[0]}]" for column in layout.columns]
    return ",".join([*layout.keys, REPLICATE, *numbers])


def _row(
    where: str,
    line: int,
    cells: dict[str, str],
    columns: dict[str, Column],
    layout: Layout,
    number: Callable[[str], float],
) -> Reading:
    for key in (*layout.keys, REPLICATE):
        if not NAME.fullmatch(cells[key]):
            raise LaboratoryError(f"{where}, column {key}: {cells[key]!r}; allowed: letters, digits, _ and -")
    values = {
        column.stem: _value(where, name, cells[name], column, number)
        for name, column in columns.items()
        if cells[name] or not column.blank
    }
    return Reading(line, tuple(cells[key] for key in layout.keys), cells[REPLICATE], values)


def _value(where: str, name: str, text: str, column: Column, number: Callable[[str], float]) -> float:
    value = number(text) * column.factor(name)
    if not (math.isfinite(value) and column.allowed(value)):
        raise LaboratoryError(f"{where}, column {name}: {text!r}; allowed: {column.range_text(name)}")
    return value


def _check_single(table: Table) -> None:
    for rows in table.groups().values():
        seen: dict[str, int] = {}
        for row in rows:
            if row.replicate in seen:
                raise table.wrong(
                    row, REPLICATE, f"{row.replicate!r} of {'-'.join(row.of)} stands in row {seen[row.replicate]} too"
                )
            seen[row.replicate] = row.line
