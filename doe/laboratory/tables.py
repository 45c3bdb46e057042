"""A laboratory's CSV file → rows in SI, with one clear line for whatever is wrong.

First the names of the columns, then one row per reading; cells and numbers as `doe.table_file` reads them. ``#`` starts
a comment: a reading behind it is left out and stays visible. Rows are counted as a spreadsheet does, the first line of
the file being row 1. A column is named ``<stem>_<unit>`` (``force_N``, ``thickness_mm``); the layout of a table says
what each holds, the units that its name may end in, and what values it may have.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from doe.table_file import check_cells
from doe.table_file import read_table as read_cells

LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
AREA = {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6}
FORCE = {"N": 1.0, "kN": 1e3, "mN": 1e-3}
MASS = {"kg": 1.0, "g": 1e-3, "mg": 1e-6}
ANGLE = {"deg": math.pi / 180.0, "rad": 1.0}
SPEED = {"m_s": 1.0, "cm_s": 1e-2, "mm_s": 1e-3}
DENSITY = {"kg_m3": 1.0, "g_cm3": 1e3}
VOLUME = {"m3": 1.0, "l": 1e-3, "cm3": 1e-6, "ml": 1e-6}
TIME = {"s": 1.0, "ms": 1e-3, "min": 60.0}
TURNING = {"rad_s": 1.0, "rpm": math.pi / 30.0}
NUMBER = {"": 1.0}
"""Of a column whose name is its stem alone."""
COMPONENT = ("component",)
PAIR = ("a", "b")
MOST_BYTES = 50_000_000
NAME = re.compile(r"[A-Za-z0-9_-]{1,60}")
"""What a component may be called: its name becomes part of a parameter's path."""
REPLICATE, NOTE = "replicate", "note"
ERROR = "_error"
"""Behind the stem of a column, of its companion with the ± of the readings."""
KEYS = {
    "component": "name of the body or material, as in the material file",
    "a": "name of the one body or material of the pair, as in the material file",
    "b": "name of the other one, or of the wall",
}
"""What stands in the columns that tell specimens apart."""


class LaboratoryError(ValueError):
    """Readings that nothing can be computed from; one line naming file, row, column and what is allowed."""


@dataclass(frozen=True)
class Column:
    """One column: ``low`` < value < ``high`` in SI, or 0 where ``zero``; ``needed`` says if it must be there.

    blank: whether single cells of it may be empty; such a row has no value of this column. says, unit, example: what to
    write, the unit of a template (the first one if empty) and the number of its example row.
    """

    stem: str
    units: dict[str, float]
    low: float = -math.inf
    high: float = math.inf
    zero: bool = False
    needed: bool = True
    blank: bool = False
    says: str = ""
    unit: str = ""
    example: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """The names that it may have in a file."""
        return tuple(f"{self.stem}_{unit}".rstrip("_") for unit in self.units)

    @property
    def sheet_name(self) -> str:
        """Its name in a template."""
        return f"{self.stem}_{self.unit or next(iter(self.units))}".rstrip("_")

    @property
    def error(self) -> Column:
        """The companion with the ± of its readings."""
        return Column(f"{self.stem}{ERROR}", self.units, low=0.0, zero=True, needed=False, blank=True)

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
    """What a test's table looks like: columns of names that tell specimens apart, and columns of numbers.

    gives, replicates, standard: for a template: the formula and what it is of, how many to take, whose test it is.
    """

    keys: tuple[str, ...]
    columns: tuple[Column, ...]
    curves: bool = False
    """Whether one replicate may be many rows, such as the points of a curve."""
    errors: bool = True
    """Whether a column may have a companion with the ± of its readings."""
    gives: str = ""
    replicates: str = ""
    standard: str = ""

    @property
    def known(self) -> tuple[Column, ...]:
        """Every column of numbers that may stand in a file."""
        return (*self.columns, *(column.error for column in self.columns if self.errors))


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


def by_replicate(rows: Iterable[Reading]) -> dict[str, list[Reading]]:
    """The rows of each replicate, in their order."""
    found: dict[str, list[Reading]] = {}
    for row in rows:
        found.setdefault(row.replicate, []).append(row)
    return found


def read_table(path: Path, layout: Layout) -> Table:
    """The readings in ``path``; LaboratoryError in one line naming file, row and column."""
    found = read_cells(path, MOST_BYTES, LaboratoryError, ", row {}", comments=True)
    if not found.rows:
        raise LaboratoryError(f"{path}: no rows; allowed: {_columns_text(layout)}, and readings below")
    (line, header), *readings = found.rows
    columns = _columns(f"{path}, row {line}", header, layout)
    check_cells(found, lambda line, what: LaboratoryError(f"{path}, row {line}: {what}"))
    by_line = [(line, dict(zip(header, cells, strict=True))) for line, cells in readings]
    if not by_line:
        raise LaboratoryError(f"{path}: no readings below the names of the columns")
    # An optional column of a template that nobody has filled in is as good as none.
    columns = {name: one for name, one in columns.items() if one.needed or any(cells[name] for _, cells in by_line)}
    rows = [_row(f"{path}, row {line}", line, cells, columns, layout, found.number) for line, cells in by_line]
    table = Table(str(path), tuple(rows))
    if not layout.curves:
        _check_single(table)
    return table


def positive(
    stem: str,
    units: dict[str, float],
    says: str,
    unit: str = "",
    example: str = "",
    needed: bool = True,
    blank: bool = False,
) -> Column:
    """A column of numbers above zero."""
    return Column(stem, units, low=0.0, needed=needed, blank=blank, says=says, unit=unit, example=example)


def angle(stem: str, says: str, example: str = "", needed: bool = True, blank: bool = False) -> Column:
    """A column of angles from 0 to below 90 degrees."""
    right = math.pi / 2.0
    return Column(stem, ANGLE, 0.0, right, zero=True, needed=needed, blank=blank, says=says, example=example)


PROCESSES = "Processes 2022, 10, 185"
INCLINED_PLANE = Layout(
    PAIR,
    (angle("angle", "slope of the plane at which the body, kept from rolling, begins to slide", "28.5"),),
    gives="static friction of a pair, μ = tan σ",
    replicates="ten of every pair, another specimen each time",
    standard=f"no standard; {PROCESSES}, section 2.4",
)
COMPOSITION = Layout(
    COMPONENT,
    (Column("mass", MASS, low=0.0, zero=True, says="mass of the component in the sample", unit="g", example="758"),),
    errors=False,
    gives="mass fraction of every component, m_i/Σ m; one replicate is one sorted sample, a row for each component",
    replicates="three samples",
    standard=f"no standard; {PROCESSES}, section 2.1",
)
DISPLACEMENT = Column(
    "displacement", LENGTH, says="displacement of the plate, in the order of the test", unit="mm", example="0.05"
)
FORCE_READ = Column("force", FORCE, says="force at that displacement", example="30")
CURVES = "ten specimens of every component; of each one reading, or a curve of eight points or more, a row for each"
FORCE_DISPLACEMENT = Layout(
    COMPONENT,
    (
        positive("thickness", LENGTH, "height over which the displacement is spread", "mm", "5.0"),
        positive("area", AREA, "area that is sheared", "mm2", "20"),
        DISPLACEMENT,
        FORCE_READ,
    ),
    curves=True,
    errors=False,
    gives="shear modulus, G = (F/A)/(ΔL/T)",
    replicates=CURVES,
    standard=f"no standard; {PROCESSES}, Equation (2)",
)
COMPRESSION = Layout(
    COMPONENT,
    (
        positive("thickness", LENGTH, "flat faces: height of the specimen", "mm", "5.0", needed=False, blank=True),
        positive("area", AREA, "flat faces: area under load", "mm2", "20", needed=False, blank=True),
        DISPLACEMENT,
        FORCE_READ,
        positive("radius", LENGTH, "curved body: radius of curvature at the contact", "mm", needed=False, blank=True),
        positive(
            "radius_2", LENGTH, "curved body: the other principal radius; empty: a sphere", "mm", "", False, blank=True
        ),
        Column(
            "poisson_ratio", NUMBER, 0.0, 0.5, zero=True, needed=False, blank=True, says="curved body: its ν, assumed"
        ),
        Column(
            "contacts", NUMBER, 0.0, 3.0, needed=False, blank=True, says="curved body: 2 between two plates, or else 1"
        ),
    ),
    curves=True,
    errors=False,
    gives="Young's modulus, E = (F/A)/(ΔL/T) of flat faces, by Hertz of a curved body",
    replicates=CURVES,
    standard=f"ASAE S368 for whole, curved bodies; {PROCESSES}, Equation (1), for flat faces",
)
DROP = Layout(
    PAIR,
    (
        positive("drop_height", LENGTH, "height of the fall H onto the plate at 45 degrees", "mm", "200"),
        positive("distance", LENGTH, "horizontal distance flown until H below the impact", "mm", "232", needed=False),
        Column("v_x", SPEED, needed=False, says="camera: horizontal speed after the impact, away from the plate"),
        Column("v_z", SPEED, needed=False, says="camera: vertical speed after the impact, upward"),
    ),
    gives="restitution of a pair, e = L/(2H), or (v_x + v_z)/√(2gH) where a camera gives both speeds",
    replicates="ten of every pair",
    standard=f"no standard; {PROCESSES}, Equation (7)",
)
MOISTURE = Layout(
    COMPONENT,
    (
        positive("mass_before", MASS, "tray and sample before drying", "g", "42.31"),
        positive("mass_after", MASS, "tray and sample after drying", "g", "33.75"),
        positive(
            "mass_container", MASS, "the tray alone; empty column: the balance was set to zero", "g", "12.31", False
        ),
    ),
    gives="moisture, (m − m_dry)/m on wet and (m − m_dry)/m_dry on dry basis",
    replicates="three samples of every component",
    standard=f"no standard is named: temperature and time are those of your product's; {PROCESSES}, section 2.1",
)
IMMERSION = Layout(
    COMPONENT,
    (
        positive("mass", MASS, "the dry sample", "g", "8.10"),
        Column(
            "mass_reference",
            MASS,
            low=0.0,
            zero=True,
            says="pycnometer full of liquid, or sinker in the liquid; 0 without a sinker",
            unit="g",
            example="84.30",
        ),
        Column("mass_with_sample", MASS, says="the same with the sample in it", unit="g", example="69.40"),
        positive("liquid_density", DENSITY, "density of the liquid at its temperature", "kg_m3", "998.2"),
        positive("mass_soaked", MASS, "the sample after soaking, where it is porous", "g", "8.75", needed=False),
    ),
    gives="density of a body, m ρ_l/(m + m_ref − m_with)",
    replicates="three samples of every component",
    standard=f"no standard; Archimedes; {PROCESSES}, section 2.2",
)
DIMENSIONS = Layout(
    COMPONENT,
    (
        positive("length", LENGTH, "longest dimension of the piece", "mm", "29.42"),
        positive("width", LENGTH, "across it", "mm", "12.67"),
        positive(
            "thickness", LENGTH, "across both; empty for a component without", "mm", "6.69", needed=False, blank=True
        ),
    ),
    gives="dimensions, geometric mean diameter (LWT)^(1/3), sphericity, spread of sizes; one replicate is one piece",
    replicates="100 pieces of every component: the spread of sizes of 10 is known to a quarter of itself only",
    standard="no standard; Mohsenin 1986, Physical Properties of Plant and Animal Materials, ch. 3",
)


def template(test: str, layout: Layout) -> str:
    """A sheet to fill in: the columns of ``layout``, and above them as comments what to write in each.

    The last comment is a row of made-up numbers; without its # the sheet can be read as it is.
    """
    names = [*layout.keys, REPLICATE, *(column.sheet_name for column in layout.columns), NOTE]
    said = [KEYS[key] for key in layout.keys]
    said.append("a name or number for each repeat" + (", the same in all of its rows" if layout.curves else ""))
    said += [_said(column) for column in layout.columns] + ["whatever you like; it is not read"]
    width = max(map(len, names))
    lines = [f"{test}: {layout.gives}.", f"Replicates: {layout.replicates}.", f"Source: {layout.standard}.", ""]
    lines += [f"{name:{width}}  {text}" for name, text in zip(names, said, strict=True)]
    if layout.errors:
        first = layout.columns[0]
        companion = Column(f"{first.stem}{ERROR}", first.units, unit=first.unit).sheet_name
        lines += [
            "",
            f"Beside any column of numbers one for the ± of its readings may stand, such as {companion}:",
            "half a division of the scale or half a digit, or what the certificate of the instrument says.",
        ]
    cells = [*["seed", "plate"][: len(layout.keys)], "1", *(column.example for column in layout.columns), ""]
    lines += ["", "A row that begins with # does not count. A row with made-up numbers:", ",".join(cells)]
    return "\n".join([*(f"# {line}".rstrip() for line in lines), ",".join(names)]) + "\n"


def _said(column: Column) -> str:
    """What to write in a column, and its other units."""
    others = [f"_{unit}" for unit, name in zip(column.units, column.names, strict=True) if name != column.sheet_name]
    text = ("" if column.needed else "(optional) ") + column.says
    return f"{text} (also {', '.join(others)})" if others else text


def _columns(where: str, header: list[str], layout: Layout) -> dict[str, Column]:
    """Columns of numbers by their name in the file."""
    twice = next((name for name in header if header.count(name) > 1), None)
    if twice is not None:
        raise LaboratoryError(f"{where}, column {twice}: appears twice; allowed: once")
    found: dict[str, Column] = {}
    for name in header:
        if name in (*layout.keys, REPLICATE, NOTE):
            continue
        column = next((column for column in layout.known if name in column.names), None)
        if column is None:
            raise LaboratoryError(f"{where}, column {name!r}: {_why_unknown(name, layout)}")
        if any(other.stem == column.stem for other in found.values()):
            raise LaboratoryError(f"{where}, column {name}: {column.stem} appears in two units; allowed: one")
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
    stems = [c for c in layout.known if name == c.stem or name.startswith(f"{c.stem}_")]
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
    _check_errors(where, cells, columns, values)
    return Reading(line, tuple(cells[key] for key in layout.keys), cells[REPLICATE], values)


def _check_errors(
    where: str, cells: Mapping[str, str], columns: Mapping[str, Column], values: Mapping[str, float]
) -> None:
    """Refuse an error that takes a reading down to a value which its column does not allow."""
    beside = {column.stem: name for name, column in columns.items()}
    for column in columns.values():
        half = values.get(f"{column.stem}{ERROR}", 0.0)
        if not column.zero and half >= values.get(column.stem, math.inf) - column.low:
            name = beside[f"{column.stem}{ERROR}"]
            raise LaboratoryError(
                f"{where}, column {name}: {cells[name]!r}; allowed: an error that keeps the reading within its range"
            )


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
                    row,
                    REPLICATE,
                    f"{row.replicate!r} of {'-'.join(row.of)} is also in row {seen[row.replicate]}; allowed: once",
                )
            seen[row.replicate] = row.line
