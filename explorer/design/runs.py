"""The runs of one response of a filled sheet: coded levels, replicates side by side, and what each run is called."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explorer.design.factors_file import Factor, region_of
from explorer.design.filled_sheet import Sheet, short
from explorer.errors import CommandError

Array = npt.NDArray[np.float64]
WORDS = re.compile(r"[^<>&\"'`\x00-\x1f]{0,60}")
SNAP = 1e-6
"""A coded level this near to low, middle or high is that level: what twelve digits and a spreadsheet leave."""


@dataclass(frozen=True)
class Runs:
    """One response of a sheet. coded (rows, k); responses, labels (rows, replicates): NaN and "" where missing."""

    design: str
    factors: tuple[Factor, ...]
    response: str
    unit: str
    coded: Array
    responses: Array
    labels: tuple[tuple[str, ...], ...]
    missing: int


def runs_of(sheet: Sheet, response: str, only: Sequence[str] = ()) -> Runs:
    """The runs of one response, with all factors or with ``only`` some; raises CommandError as `read_sheet` does."""
    factors = _kept(sheet, only)
    _check_words(sheet, response)
    if response not in sheet.responses:
        offered = ", ".join(sheet.responses) or "none"
        raise CommandError(f"{sheet.path}: --response {response}: no such column; the responses are {offered}")
    values = [sheet.number(position, response) for position in range(len(sheet.cells))]
    if all(map(math.isnan, values)):
        raise CommandError(f"{sheet.path}, column {response}: every cell is empty; fill in what came out of the runs")
    natural = np.array([_levels(sheet, factors, k, not math.isnan(value)) for k, value in enumerate(values)])
    used = np.flatnonzero(~np.isnan(natural).any(axis=1))
    coded = _snapped(region_of(factors).coded(natural[used]))
    rows = _rows(sheet, used, coded)
    width = max(map(len, rows))
    responses = np.full((len(rows), width), np.nan)
    labels = [[""] * width for _ in rows]
    for row, members in enumerate(rows):
        for replicate, member in enumerate(members):
            responses[row, replicate] = values[used[member]]
            labels[row][replicate] = _label(sheet, int(used[member]))
    return Runs(
        design=sheet.design,
        factors=factors,
        response=response,
        unit=sheet.units[response],
        coded=coded[[members[0] for members in rows]],
        responses=responses,
        labels=tuple(map(tuple, labels)),
        missing=sum(map(math.isnan, values)),
    )


def _check_words(sheet: Sheet, response: str) -> None:
    """Name and unit of a response go into titles of charts, which read a little HTML."""
    for what, text in (("name", response), ("unit", sheet.units.get(response, ""))):
        if not WORDS.fullmatch(text):
            raise CommandError(
                f"{sheet.path}: {what} {short(text)} of a response; allowed: up to 60 characters, no < > & or quotes"
            )


def _kept(sheet: Sheet, only: Sequence[str]) -> tuple[Factor, ...]:
    names = [factor.name for factor in sheet.factors]
    for name in only:
        if name not in names:
            raise CommandError(f"--only {name}: no such factor; the factors are {', '.join(names)}")
    return tuple(factor for factor in sheet.factors if not only or factor.name in only)


def _levels(sheet: Sheet, factors: Sequence[Factor], position: int, needed: bool) -> list[float]:
    """Levels of a run; an empty one is refused where the run has a response."""
    levels = [sheet.number(position, factor.name) for factor in factors]
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
    """Runs that repeat one row of the design, by the column "row"; every run by itself where levels or numbers differ.

    Rows of the design come in their order, so that a two-level design is found again in its table.
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


def _label(sheet: Sheet, position: int) -> str:
    """What a run is called: its number in the sheet, else its line."""
    if "run" in sheet.columns:
        return sheet.cells[position][sheet.columns["run"]][:20] or f"line {sheet.lines[position]}"
    return f"line {sheet.lines[position]}"
