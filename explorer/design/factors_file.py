"""The factors file of a design, TOML.

title = "…"                       what is studied
responses = ["strength_MPa"]      columns to fill in (one called "response" if not given)
replicates, centre, seed, first_seed    defaults of the options of `explorer design`

[[factor]]
name = "temperature"              letters, digits, _ and -
low, high                         the range; in the design −1 and +1
unit = "°C"                       shown, never converted
reference                         the measured or present value, near which a solution is looked for; by default the
                                  middle
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from doe.analysis.steepest_ascent import Region
from doe.designs import factor_letters
from doe.errors import StudyFileError
from doe.record import Record
from doe.studies.study_table import entries, number, only, required, whole
from explorer.errors import CommandError

NAME = re.compile(r"[^\W\d][\w-]{0,59}")
UNIT = re.compile(r"[^\s=@|,;\[\]\"'`<>][^|,;\[\]\"`<>\n]{0,19}")
RESERVED = ("row", "replicate", "run", "seed")
"""Columns of the sheet that are not factors."""
MOST_FACTORS = 47
TOP_KEYS = ("title", "responses", "replicates", "centre", "seed", "first_seed", "factor")
FACTOR_KEYS = ("name", "low", "high", "unit", "reference")


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
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise CommandError(f"{path}: is not a text file in UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise CommandError(f"{path}: not TOML: {error}") from None
    try:
        return _checked(table)
    except StudyFileError as error:
        raise CommandError(f"{path}: {error}") from None


def make_factor(name: Any, low: Any, high: Any, unit: Any, reference: Any, where: str) -> DesignFactor:
    """A checked factor; raises StudyFileError."""
    checked_name(name, f"{where}.name")
    if not isinstance(unit, str) or (unit and not UNIT.fullmatch(unit)):
        raise StudyFileError(f"{where}.unit: {unit!r}; allowed: up to 20 characters without | , ; [ ] or quotes")
    least, most = number(low, f"{where}.low"), number(high, f"{where}.high")
    if not least < most:
        raise StudyFileError(f"{where}.high: {most:g} is not above low {least:g} ({name})")
    if not np.isfinite(most - least):
        raise StudyFileError(f"{where}: the range {least:g} … {most:g} of {name} is too wide to be a number")
    middle = least + (most - least) / 2 if reference is None else number(reference, f"{where}.reference")
    return DesignFactor(name, least, most, "" if unit == "1" else unit, middle)


def checked_name(name: Any, where: str) -> str:
    """A name that can head a column; raises StudyFileError."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
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


def _checked(table: dict[str, Any]) -> FactorsFile:
    only(table, TOP_KEYS, "")
    title = table.get("title", "")
    if not isinstance(title, str) or len(title) > 200:
        raise StudyFileError(f"title: {title!r}; allowed: a text of up to 200 characters")
    found = entries(table, "factor")
    if not 1 <= len(found) <= MOST_FACTORS:
        raise StudyFileError(f"[[factor]]: {len(found)} of them; allowed: 1 to {MOST_FACTORS}")
    factors = tuple(_factor(entry, k + 1) for k, entry in enumerate(found))
    given = table.get("responses", ["response"])
    if not isinstance(given, list) or not given:
        raise StudyFileError(f"responses: {given!r}; allowed: a list of names")
    responses = tuple(checked_name(name, "responses") for name in given)
    no_repeats(factors, responses)
    optional = {
        key: whole(table[key], key, least)
        for key, least in (("replicates", 1), ("centre", 0), ("seed", 0), ("first_seed", 0))
        if key in table
    }
    return FactorsFile(" ".join(title.split()), factors, responses, **optional)


def _factor(entry: dict[str, Any], position: int) -> DesignFactor:
    where = f"factor[{position}]"
    only(entry, FACTOR_KEYS, where)
    required(entry, ("name", "low", "high"), where)
    return make_factor(entry["name"], entry["low"], entry["high"], entry.get("unit", ""), entry.get("reference"), where)
