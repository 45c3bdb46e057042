"""A filled sheet and its runs: as this program wrote it, as a spreadsheet saved it, or any CSV with a factors file.

`doe.table_file` reads cells and numbers. A message about an unreadable cell names its line in the file (the row of a
spreadsheet) and its column. The runs of one response have coded levels, replicates side by side, and a label for each
run.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from doe.analysis.surface import Blocks
from doe.designs.morris import Morris
from doe.errors import StudyFileError
from doe.table_file import CellTable, read_table
from explorer.design.factors_file import (
    EXCLUDED,
    RESERVED,
    DesignFactor,
    make_factor,
    make_names,
    no_repeats,
    region_of,
)
from explorer.errors import CommandError

Array = npt.NDArray[np.float64]

EMPTY_CELLS = ("", "NA", "-", "–")
MOST_BYTES = 10_000_000
MOST_SEEDS = 2**53
"""Whole numbers below this are exact in a cell."""
FLAGS = ("yes", "no", "true", "false", "y", "n", "x")
"""Entries of other programs, which record whether a run is left out, but not why."""
HEADER_CELL = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<unit>[^\]]*)\])?$")
WORDS = re.compile(r"[^<>&\"'`\x00-\x1f]{0,60}")
SNAP = 1e-6
"""A coded level this close to low, middle or high is that level; covers rounding to twelve digits in a spreadsheet."""


@dataclass(frozen=True)
class Sheet:
    """A sheet as read: cells by line, before a response is chosen. ``lines``: the numbers of the lines in the file.

    ``table``: the table that the sheet was read from.
    """

    path: Path
    design: str
    factors: tuple[DesignFactor, ...]
    columns: dict[str, int]
    units: dict[str, str]
    cells: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    table: CellTable

    def is_words(self, column: str) -> bool:
        """Whether ``column`` has filled cells and none of them is a number."""
        filled = [cell for row in self.cells if (cell := row[self.columns[column]]) not in EMPTY_CELLS]
        return bool(filled) and all(math.isnan(self.table.number(cell)) for cell in filled)

    @property
    def responses(self) -> list[str]:
        """Columns that are neither factors nor the sheet's own."""
        return [name for name in self.columns if name not in {*(f.name for f in self.factors), *RESERVED}]

    def number(self, position: int, column: str) -> float:
        """A cell as a number, NaN if it is empty; raises CommandError with line and column."""
        text = self.cells[position][self.columns[column]]
        if text in EMPTY_CELLS:
            return math.nan
        value = self.table.number(text)
        if math.isnan(value):
            raise CommandError(
                f"{self.path}, line {self.lines[position]}, column {column}: {short(text)} is not a number; "
                "allowed: a number, or an empty cell for a missing run"
            )
        return value

    def why_excluded(self, position: int) -> str:
        """Why a run is left out; empty if it is not. Raises CommandError for a number or one of ``FLAGS``."""
        text = self.cells[position][self.columns[EXCLUDED]] if EXCLUDED in self.columns else ""
        if text in EMPTY_CELLS:
            return ""
        if text.lower() in FLAGS or not math.isnan(self.table.number(text)):
            raise CommandError(
                f"{self.path}, line {self.lines[position]}, column {EXCLUDED}: {short(text)} is not a reason; "
                "allowed: words that state why the run is left out, or an empty cell"
            )
        return text

    def level(self, position: int, factor: DesignFactor) -> float:
        """The level of a factor, coded if it is a name; NaN if the cell is empty."""
        if not factor.levels:
            return self.number(position, factor.name)
        text = self.cells[position][self.columns[factor.name]]
        if text in EMPTY_CELLS:
            return math.nan
        if text not in factor.levels:
            raise CommandError(
                f"{self.path}, line {self.lines[position]}, column {factor.name}: {short(text)}; "
                f"allowed: {', '.join(factor.levels)}"
            )
        return factor.codes[factor.levels.index(text)]


def read_sheet(path: Path, factors: Sequence[DesignFactor] = ()) -> Sheet:
    """Read a sheet; ``factors`` take the place of those that its comments declare.

    Raises CommandError with one line: file, line, column and what is allowed.
    """
    table = read_table(path, MOST_BYTES, CommandError)
    design, declared = _declarations(path, table)
    known = tuple(factors) or declared
    if not known:
        raise CommandError(f"{path}: no line '# factor | name | low | high | unit'; needed without it: --factors FILE")
    if not table.rows:
        raise CommandError(f"{path}: no header line with the names of the columns")
    (_, names), *runs = table.rows
    header = [HEADER_CELL.match(name) for name in names]
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
    for line, row in runs:
        if len(row) > len(titles):
            raise CommandError(f"{path}, line {line}: {len(row)} cells; allowed: {len(titles)} as in the header")
        cells.append((*row, *[""] * (len(titles) - len(row))))
        lines.append(line)
    if not cells:
        raise CommandError(f"{path}: no line with a run below the header")
    return Sheet(path, design, known, columns, units, tuple(cells), tuple(lines), table)


def _declarations(path: Path, table: CellTable) -> tuple[str, tuple[DesignFactor, ...]]:
    """The design and the factors that the comments declare."""
    design, factors = "", []
    for line, comment in table.comments:
        parts = [part.strip() for part in comment.lstrip("# ").split("|")]
        if parts[0] == "design" and len(parts) > 1:
            design = parts[1]
        if parts[0] == "factor":
            factors.append(_declared(path, line, parts[1:]))
        if parts[0] == "levels" and len(parts) > 1:
            try:
                factors.append(make_names(parts[1], tuple(parts[2:]), "factor"))
            except StudyFileError as error:
                raise CommandError(f"{path}, line {line}: {error}") from None
    try:
        no_repeats(tuple(factors), ())
    except StudyFileError as error:
        raise CommandError(f"{path}: {error}") from None
    return design, tuple(factors)


def _declared(path: Path, line: int, parts: list[str]) -> DesignFactor:
    where = f"{path}, line {line}"
    if len(parts) not in (3, 4, 5):
        raise CommandError(f"{where}: allowed: '# factor | name | low | high | unit | reference'")
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
            raise CommandError(f"{path}: column {short(name)} appears twice; allowed: each name once")
    return {name: position for position, name in enumerate(names) if name}


def short(text: str) -> str:
    """``text`` in quotes, cut to its first 37 characters if it is long."""
    return repr(text if len(text) <= 40 else text[:37] + "…")


@dataclass(frozen=True)
class Runs:
    """One response of a sheet. coded (rows, k); responses, labels (rows, replicates): NaN and "" for missing runs."""

    design: str
    factors: tuple[DesignFactor, ...]
    response: str
    unit: str
    coded: Array
    responses: Array
    labels: tuple[tuple[str, ...], ...]
    missing: int
    place: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    """Place of each run in time, (rows, replicates): its number in the column "run", else its position in the file."""
    blocks: Blocks | None = None
    """Block in which each run was made; None if no column states it."""
    groups: Blocks | None = None
    """The same for random groups."""
    excluded: tuple[tuple[str, str], ...] = ()
    """Label and reason of each run that has a result but is left out."""
    others: Array | None = None
    """Coded levels of omitted factors of a Morris design, which still delimit its steps."""
    grouping: tuple[str, ...] = ()
    """Unused columns whose cells repeat, as those for days, batches or operators do."""


def runs_of(sheet: Sheet, response: str, only: Sequence[str] = (), block: str = "", random: str = "") -> Runs:
    """The runs of one response, with all factors or ``only`` some; columns ``block`` and ``random`` give their groups.

    Raises CommandError as `read_sheet` does.
    """
    factors = _kept(sheet, only)
    for option, column in (("--block", block), ("--random", random)):
        if column and (column not in sheet.columns or column in (response, *(factor.name for factor in factors))):
            offered = ", ".join(name for name in sheet.responses if name != response) or "none"
            raise CommandError(
                f"{sheet.path}: {option} {column}: no such column for blocks; the other columns are {offered}"
            )
    _check_words(sheet, response)
    if response not in sheet.responses:
        offered = ", ".join(sheet.responses) or "none"
        raise CommandError(f"{sheet.path}: --response {response}: no such column; the responses are {offered}")
    values = [sheet.number(position, response) for position in range(len(sheet.cells))]
    if all(map(math.isnan, values)):
        raise CommandError(f"{sheet.path}, column {response}: every cell is empty; fill in the results of the runs")
    excluded = [k for k, value in enumerate(values) if sheet.why_excluded(k) and not math.isnan(value)]
    for k in excluded:
        values[k] = math.nan
    if all(map(math.isnan, values)):
        raise CommandError(f"{sheet.path}, column {EXCLUDED}: every run with a result in {response} is left out")
    natural = np.array([_levels(sheet, factors, k, not math.isnan(value)) for k, value in enumerate(values)])
    used = np.flatnonzero(~np.isnan(natural).any(axis=1))
    coded = _snapped(region_of(factors).coded(natural[used]))
    rows = _rows(sheet, used, coded)
    first = [members[0] for members in rows]
    width = max(map(len, rows))
    responses = np.full((len(rows), width), np.nan)
    labels = [[""] * width for _ in rows]
    place = np.zeros((len(rows), width), dtype=np.int64)
    positions = [used[members] for members in rows]
    for row, members in enumerate(rows):
        for replicate, member in enumerate(members):
            responses[row, replicate] = values[used[member]]
            labels[row][replicate] = _label(sheet, int(used[member]))
            place[row, replicate] = _place(sheet, int(used[member]))
    return Runs(
        design=sheet.design,
        factors=factors,
        response=response,
        unit=sheet.units[response],
        coded=coded[first],
        responses=responses,
        labels=tuple(map(tuple, labels)),
        missing=sum(map(math.isnan, values)),
        blocks=_blocks(sheet, block, positions, width),
        groups=_blocks(sheet, random, positions, width),
        place=place,
        others=_others(sheet, factors, used[first]),
        excluded=tuple((_label(sheet, k), sheet.why_excluded(k)) for k in excluded),
        grouping=tuple(
            name for name in sheet.responses if name not in (response, block, random) and _groups(sheet, name)
        ),
    )


@dataclass(frozen=True)
class FinishedRuns:
    """The runs of a sheet that have a result: coded levels (runs, factors), responses as cells, seeds (NaN: none)."""

    coded: Array
    cells: tuple[tuple[str, ...], ...]
    seeds: Array


def finished_runs(sheet: Sheet, responses: Sequence[str]) -> FinishedRuns:
    """The runs that have a result in at least one of the responses.

    Raises CommandError as `read_sheet` does, and if no run has a result.
    """
    known = [name for name in responses if name in sheet.columns]
    filled = [
        k
        for k, row in enumerate(sheet.cells)
        if not sheet.why_excluded(k) and any(row[sheet.columns[name]] not in EMPTY_CELLS for name in known)
    ]
    if not filled:
        raise CommandError(
            f"{sheet.path}: no run with a result in {', '.join(responses)}; allowed: a sheet with results"
        )
    natural = np.array([_levels(sheet, sheet.factors, k, needed=True) for k in filled])
    cells = []
    for k in filled:
        numbers = [sheet.number(k, name) if name in known else math.nan for name in responses]
        cells.append(tuple("" if math.isnan(number) else f"{number:.12g}" for number in numbers))
    seeds = np.array([_seed(sheet, k) for k in filled])
    return FinishedRuns(_snapped(region_of(sheet.factors).coded(natural)), tuple(cells), seeds)


def _seed(sheet: Sheet, position: int) -> float:
    """The seed of a run; NaN if the sheet gives none."""
    seed = sheet.number(position, "seed") if "seed" in sheet.columns else math.nan
    if not math.isnan(seed) and not (0 <= seed < MOST_SEEDS and seed.is_integer()):
        raise CommandError(
            f"{sheet.path}, line {sheet.lines[position]}, column seed: {seed:.12g}; "
            "allowed: a whole number of at least 0, or an empty cell"
        )
    return seed


def _others(sheet: Sheet, kept: Sequence[DesignFactor], positions: npt.NDArray[np.int64]) -> Array | None:
    """Coded levels, at positions, of the factors of a Morris design that are not kept; None if there are none."""
    others = tuple(factor for factor in sheet.factors if factor not in kept)
    if sheet.design != Morris.name or not others:
        return None
    natural = np.array([_levels(sheet, others, int(k), needed=False) for k in positions])
    return _snapped(region_of(others).coded(natural))


def _blocks(sheet: Sheet, column: str, rows: Sequence[npt.NDArray[np.int64]], width: int) -> Blocks | None:
    """The block of each run at the positions in ``rows``, from a column; None without a column."""
    if not column:
        return None
    place = sheet.columns[column]
    every = sorted(int(position) for row in rows for position in row)
    for position in every:
        if sheet.cells[position][place] in EMPTY_CELLS:
            raise CommandError(
                f"{sheet.path}, line {sheet.lines[position]}, column {column}: is empty; allowed: a name"
            )
    names = tuple(dict.fromkeys(sheet.cells[position][place] for position in every))
    of_run = np.zeros((len(rows), width), dtype=np.int64)
    for row, positions in enumerate(rows):
        of_run[row, : len(positions)] = [names.index(sheet.cells[position][place]) for position in positions]
    return Blocks(names, of_run)


def _check_words(sheet: Sheet, response: str) -> None:
    """Check name and unit of a response: they go into chart titles, which interpret some HTML."""
    for what, text in (("name", response), ("unit", sheet.units.get(response, ""))):
        if not WORDS.fullmatch(text):
            raise CommandError(
                f"{sheet.path}: {what} {short(text)} of a response; allowed: up to 60 characters, no < > & or quotes"
            )


def _kept(sheet: Sheet, only: Sequence[str]) -> tuple[DesignFactor, ...]:
    names = [factor.name for factor in sheet.factors]
    for name in only:
        if name not in names:
            raise CommandError(f"--only {name}: no such factor; the factors are {', '.join(names)}")
    return tuple(factor for factor in sheet.factors if not only or factor.name in only)


def _levels(sheet: Sheet, factors: Sequence[DesignFactor], position: int, needed: bool) -> list[float]:
    """Levels of a run; an empty level is refused if it is ``needed`` because the run has a response."""
    levels = [sheet.level(position, factor) for factor in factors]
    for factor, level in zip(factors, levels, strict=True):
        if needed and math.isnan(level):
            raise CommandError(
                f"{sheet.path}, line {sheet.lines[position]}, column {factor.name}: is empty; "
                "allowed: the level at which the run was made"
            )
    return levels


def _snapped(coded: Array) -> Array:
    nearest = np.clip(np.rint(coded), -1, 1)
    return np.asarray(np.where(np.abs(coded - nearest) < SNAP, nearest, coded))


def _rows(sheet: Sheet, used: npt.NDArray[np.int64], coded: Array) -> list[list[int]]:
    """Runs that repeat one row of the design, by the column "row"; every run by itself if levels or numbers differ.

    Rows of the design come in order, so that a two-level design is recognised in its table.
    """
    if "row" not in sheet.columns:
        return [[k] for k in range(len(used))]
    numbers = [sheet.number(int(position), "row") for position in used]
    members: dict[float, list[int]] = {}
    for k, number in enumerate(numbers):
        members.setdefault(number, []).append(k)
    rows = [members[number] for number in sorted(members)] if not any(map(math.isnan, numbers)) else []
    same = all((coded[row] == coded[row[0]]).all() for row in rows)
    return rows if rows and same else [[k] for k in range(len(used))]


def _groups(sheet: Sheet, column: str) -> bool:
    """Whether the cells of ``column`` fall into a few groups, each of several runs."""
    cells = [row[sheet.columns[column]] for row in sheet.cells]
    counts = Counter(cell for cell in cells if cell not in EMPTY_CELLS)
    return len(counts) > 1 and min(counts.values()) > 1


def _place(sheet: Sheet, position: int) -> int:
    number = sheet.number(position, "run") if "run" in sheet.columns else math.nan
    return position if math.isnan(number) else int(number)


def _label(sheet: Sheet, position: int) -> str:
    """Label of a run: its number in the sheet, else its line."""
    if "run" in sheet.columns:
        return sheet.cells[position][sheet.columns["run"]][:20] or f"line {sheet.lines[position]}"
    return f"line {sheet.lines[position]}"
