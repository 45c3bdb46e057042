"""The factors file of a design (:class:`FactorsTable`): what is varied, in which units, and what is measured."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from doe.analysis.steepest_ascent import Region
from doe.designs import factor_letters
from doe.errors import StudyFileError
from doe.record import Record
from explorer.errors import CommandError
from solver import Like, Names, Number, ParameterError, Settings, TomlTable, Whole, checked, read_toml

NAME = re.compile(r"[^\W\d][\w-]{0,59}")
UNIT = re.compile(r"[^\s=@|,;\[\]\"'`<>][^|,;\[\]\"`<>\n]{0,19}")
RESERVED = ("row", "replicate", "run", "seed")
"""Columns of the sheet that are not factors."""
MOST_FACTORS = 47


class FactorTable(TomlTable):
    """A ``[[factor]]``."""

    name: str
    """Letters, digits, _ and -."""
    low: Annotated[float, Number()]
    high: Annotated[float, Number()]
    """In the design low is −1 and high +1."""
    unit: str = ""
    """Shown, never converted."""
    reference: Annotated[float, Number()] | None = None
    """The measured or present value, near which a solution is looked for; by default the middle."""


class FactorsTable(TomlTable):
    """A factors file of `explorer design`."""

    title: str = Field("", max_length=200)
    """What is studied."""
    responses: Annotated[tuple[str, ...], Names()] = ("response",)
    """Columns to fill in."""
    replicates: Annotated[int, Whole(1)] | None = None
    centre: Annotated[int, Whole(0)] | None = None
    seed: Annotated[int, Whole(0)] | None = None
    first_seed: Annotated[int, Whole(0)] | None = None
    factor: list[Annotated[Settings, Like(FactorTable)]] = Field(default_factory=list)


@dataclass(frozen=True)
class DesignFactor(Record):
    """One factor: low, high and reference in ``unit``."""

    name: str
    low: float
    high: float
    unit: str
    reference: float

    @property
    def title(self) -> str:
        """Name with unit, as in the header of the sheet."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class FactorsFile(Record):
    """Factors with what else the file says about the runs; None where it says nothing."""

    title: str
    factors: tuple[DesignFactor, ...]
    responses: tuple[str, ...]
    replicates: int | None = None
    centre: int | None = None
    seed: int | None = None
    first_seed: int | None = None


def region_of(factors: tuple[DesignFactor, ...]) -> Region:
    """The box low … high; factors go by their letters A, B, … there."""
    low, high = (np.array([getattr(factor, end) for factor in factors]) for end in ("low", "high"))
    return Region(factor_letters(len(factors)), (low + high) / 2, (high - low) / 2, ())


def read_factors(path: Path) -> FactorsFile:
    """Read a factors file; raises CommandError with one line: file, key, value, what is allowed."""
    try:
        table = read_toml(path)
    except ParameterError as error:
        raise CommandError(str(error)) from None
    try:
        return _factors_file(checked(FactorsTable, table))
    except (ParameterError, StudyFileError) as error:
        raise CommandError(f"{path}: {error}") from None


def make_factor(name: str, low: float, high: float, unit: str, reference: float | None, where: str) -> DesignFactor:
    """A checked factor; raises StudyFileError."""
    checked_name(name, f"{where}.name")
    if unit and not UNIT.fullmatch(unit):
        raise StudyFileError(f"{where}.unit: {unit!r}; allowed: up to 20 characters without | , ; [ ] or quotes")
    for key, value in (("low", low), ("high", high), ("reference", reference)):
        if value is not None and not math.isfinite(value):
            raise StudyFileError(f"{where}.{key}: {value!r} is not a number")
    if not low < high:
        raise StudyFileError(f"{where}.high: {high:g} is not above low {low:g} ({name})")
    if not math.isfinite(high - low):
        raise StudyFileError(f"{where}: the range {low:g} … {high:g} of {name} is too wide to be a number")
    middle = low + (high - low) / 2 if reference is None else reference
    return DesignFactor(name, low, high, "" if unit == "1" else unit, middle)


def checked_name(name: str, where: str) -> str:
    """A name that can head a column; raises StudyFileError."""
    if not NAME.fullmatch(name):
        raise StudyFileError(
            f"{where}: {name!r}; allowed: up to 60 letters, digits, _ and -, beginning with a letter or _"
        )
    if name in RESERVED:
        raise StudyFileError(f"{where}: {name!r} is a column of the sheet itself; allowed: another name")
    return name


def no_repeats(factors: tuple[DesignFactor, ...], responses: tuple[str, ...]) -> None:
    """Refuse a name that two columns would have; raises StudyFileError."""
    columns = [*(factor.name for factor in factors), *responses]
    for name in columns:
        if columns.count(name) > 1:
            raise StudyFileError(f"name {name!r} stands twice; allowed: each column once")


def _factors_file(table: FactorsTable) -> FactorsFile:
    if not 1 <= len(table.factor) <= MOST_FACTORS:
        raise StudyFileError(f"[[factor]]: {len(table.factor)} of them; allowed: 1 to {MOST_FACTORS}")
    entries = [checked(FactorTable, entry, f"factor[{k}]") for k, entry in enumerate(table.factor, start=1)]
    factors = tuple(
        make_factor(one.name, one.low, one.high, one.unit, one.reference, f"factor[{k}]")
        for k, one in enumerate(entries, start=1)
    )
    if not table.responses:
        raise StudyFileError("responses: []; allowed: a list of names")
    responses = tuple(checked_name(name, "responses") for name in table.responses)
    no_repeats(factors, responses)
    title = " ".join(table.title.split())
    return FactorsFile(title, factors, responses, table.replicates, table.centre, table.seed, table.first_seed)
