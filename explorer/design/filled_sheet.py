"""Reading a filled sheet: from this program, from a spreadsheet that saved it, or from any CSV with a factors file.

Comma, semicolon or tab between cells; with the last two also a decimal comma. A cell that cannot be read is named by
its line in the file (the row of a spreadsheet) and its column.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from doe.errors import StudyFileError
from doe.text_file import read_text
from explorer.design.factors_file import RESERVED, Factor, make_factor, no_repeats
from explorer.errors import CommandError

DELIMITERS = (",", ";", "\t")
MISSING = ("", "NA", "-", "–")
MOST_BYTES = 10_000_000
HEADER_CELL = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<unit>[^\]]*)\])?$")


@dataclass(frozen=True)
class Sheet:
    """A sheet as it stands: cells by line, before one response is chosen. ``lines``: their numbers in the file."""

    path: Path
    design: str
    factors: tuple[Factor, ...]
    columns: dict[str, int]
    units: dict[str, str]
    cells: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    decimal_comma: bool

    @property
    def responses(self) -> list[str]:
        """Columns that are neither factors nor the sheet's own."""
        return [name for name in self.columns if name not in {*(f.name for f in self.factors), *RESERVED}]

    def number(self, position: int, column: str) -> float:
        """A cell as a number, NaN where it is empty; raises CommandError with line and column."""
        text = self.cells[position][self.columns[column]].strip()
        if text in MISSING:
            return math.nan
        plain = text.replace(",", ".") if self.decimal_comma else text
        try:
            value = float(plain.replace("−", "-"))
        except ValueError:
            value = math.inf
        if "_" in plain or not math.isfinite(value):
            raise CommandError(
                f"{self.path}, line {self.lines[position]}, column {column}: {short(text)} is not a number; "
                "allowed: a number, or an empty cell for a missing run"
            )
        return value


def read_sheet(path: Path, factors: Sequence[Factor] = ()) -> Sheet:
    """Read a sheet; ``factors`` take the place of those that its comments declare.

    Raises CommandError with one line: file, line, column, what is allowed.
    """
    design, declared, rest = _comments(path, read_text(path, MOST_BYTES, CommandError))
    known = tuple(factors) or declared
    if not known:
        raise CommandError(f"{path}: no line '# factor | name | low | high | unit'; allowed: with --factors FILE")
    if not rest:
        raise CommandError(f"{path}: no header line with the names of the columns")
    delimiter = max(DELIMITERS, key=rest[0][1].count)
    parsed = [(line, _row(path, line, text, delimiter)) for line, text in rest]
    header = [HEADER_CELL.match(cell.strip()) for cell in parsed[0][1]]
    titles = [(match["name"], match["unit"] or "") for match in header if match is not None]
    columns = _columns(path, titles)
    units = dict(titles)
    for factor in known:
        if factor.name not in columns:
            raise CommandError(f"{path}: no column {factor.name!r}; the columns are {', '.join(columns)}")
        if units[factor.name] and units[factor.name] != (factor.unit or "1"):
            raise CommandError(
                f"{path}: column {factor.name} is in [{units[factor.name]}], the factor in [{factor.unit or '1'}]; "
                "allowed: one unit"
            )
    cells, lines = [], []
    for line, row in parsed[1:]:
        if any(cell.strip() for cell in row[len(titles) :]):
            raise CommandError(f"{path}, line {line}: {len(row)} cells; allowed: {len(titles)} as in the header")
        if any(cell.strip() for cell in row):
            cells.append(tuple([*row, *[""] * len(titles)][: len(titles)]))
            lines.append(line)
    if not cells:
        raise CommandError(f"{path}: no line with a run below the header")
    return Sheet(path, design, known, columns, units, tuple(cells), tuple(lines), delimiter != ",")


def _row(path: Path, line: int, text: str, delimiter: str) -> list[str]:
    try:
        return next(csv.reader([text], delimiter=delimiter), [])
    except csv.Error as error:
        raise CommandError(f"{path}, line {line}: cannot be read as cells: {error}") from None


def _comments(path: Path, text: str) -> tuple[str, tuple[Factor, ...], list[tuple[int, str]]]:
    """Design and factors of the comments, and all other lines with their numbers."""
    design, factors, rest = "", [], []
    for line, content in enumerate(text.splitlines(), 1):
        bare = content.strip().strip('"').rstrip(",;\t\"' ")
        if not bare.startswith("#"):
            if content.strip():
                rest.append((line, content))
            continue
        parts = [part.strip() for part in bare.lstrip("# ").split("|")]
        if parts[0] == "design" and len(parts) > 1:
            design = parts[1]
        if parts[0] == "factor":
            factors.append(_declared(path, line, parts[1:]))
    try:
        no_repeats(tuple(factors), ())
    except StudyFileError as error:
        raise CommandError(f"{path}: {error}") from None
    return design, tuple(factors), rest


def _declared(path: Path, line: int, parts: list[str]) -> Factor:
    where = f"{path}, line {line}"
    if len(parts) not in (3, 4, 5):
        raise CommandError(f"{where}: allowed is '# factor | name | low | high | unit | reference'")
    numbers: list[float] = []
    for text in (*parts[1:3], *parts[4:]):
        try:
            numbers.append(float(text.replace(",", ".")))
        except ValueError:
            raise CommandError(f"{where}: {short(text)} is not a number; allowed: low, high, reference") from None
    reference = numbers[2] if len(numbers) == 3 else None
    try:
        return make_factor(parts[0], numbers[0], numbers[1], parts[3] if len(parts) > 3 else "", reference, "factor")
    except StudyFileError as error:
        raise CommandError(f"{where}: {error}") from None


def _columns(path: Path, titles: list[tuple[str, str]]) -> dict[str, int]:
    names = [name for name, _ in titles]
    for name in names:
        if name and names.count(name) > 1:
            raise CommandError(f"{path}: column {short(name)} stands twice; allowed: each name once")
    return {name: position for position, name in enumerate(names) if name}


def short(text: str) -> str:
    """``text`` in quotes, with its first 37 characters where it is long."""
    return repr(text if len(text) <= 40 else text[:37] + "…")
