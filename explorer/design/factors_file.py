"""The factors file of a design (:class:`FactorsTable`): what is varied, in which units, and what is measured."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

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
LEVEL = re.compile(r"[^\s=@|,;\[\]\"'`<>][^|,;\[\]\"`<>\n]{0,39}")
RESPONSE = re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^\]]*)\]\s*")
EXCLUDED = "excluded"
"""Column of the sheet that says why a run is left out of the analysis; empty if it is not left out."""
RESERVED = ("row", "replicate", "run", "seed", EXCLUDED)
"""Columns of the sheet that are not factors."""
MOST_FACTORS = 47


class FactorTable(TomlTable):
    """A ``[[factor]]``."""

    name: str
    """Letters, digits, _ and -."""
    low: Annotated[float, Number()] | None = None
    high: Annotated[float, Number()] | None = None
    """In the design low is −1 and high +1."""
    levels: Annotated[tuple[str, ...], Names()] = ()
    """Instead of low and high: two or more names."""
    unit: str = ""
    """Shown, never converted."""
    reference: Annotated[float, Number()] | None = None
    """The measured or present value, near which a solution is looked for; by default the middle."""


class FactorsTable(TomlTable):
    """A factors file of `explorer design`."""

    title: str = Field("", max_length=200)
    """What is studied."""
    responses: Annotated[tuple[str, ...], Names()] = ("response",)
    """Columns to fill in, with their units where they have any: "strength [MPa]"."""
    replicates: Annotated[int, Whole(1)] | None = None
    centre: Annotated[int, Whole(0)] | None = None
    seed: Annotated[int, Whole(0)] | None = None
    first_seed: Annotated[int, Whole(0)] | None = None
    factor: list[Annotated[Settings, Like(FactorTable)]] = Field(default_factory=list)


@dataclass(frozen=True)
class DesignFactor(Record):
    """One factor: low, high and reference in ``unit``; a factor of names has ``levels``, and low −1 and high +1."""

    name: str
    low: float
    high: float
    unit: str
    reference: float
    levels: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; levels only if there are any."""
        found = super().to_dict()
        return found if self.levels else {name: value for name, value in found.items() if name != "levels"}

    @property
    def codes(self) -> tuple[float, ...]:
        """Coded values of the levels, −1 … +1 in equal steps."""
        return tuple(np.linspace(-1.0, 1.0, len(self.levels)).tolist())

    @property
    def title(self) -> str:
        """Name with unit, as in the header of the sheet."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class FactorsFile(Record):
    """Factors, and what else the file says about the runs; None if it says nothing."""

    title: str
    factors: tuple[DesignFactor, ...]
    responses: tuple[str, ...]
    replicates: int | None = None
    centre: int | None = None
    seed: int | None = None
    first_seed: int | None = None
    response_units: tuple[str, ...] = ()

    @property
    def response_titles(self) -> tuple[str, ...]:
        """Names with units, as in the header of the sheet."""
        units = self.response_units or ("",) * len(self.responses)
        return tuple(f"{name} [{unit}]" if unit else name for name, unit in zip(self.responses, units, strict=True))


def region_of(factors: tuple[DesignFactor, ...]) -> Region:
    """The box low … high; its factors are named by their letters A, B, …"""
    low, high = (np.array([getattr(factor, end) for factor in factors]) for end in ("low", "high"))
    return Region(factor_letters(len(factors)), (low + high) / 2, (high - low) / 2, ())


def read_factors(path: Path) -> FactorsFile:
    """Read a factors file. Raises CommandError with one line: file, key, value and what is allowed."""
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
        raise StudyFileError(f"{where}.unit: {unit!r}; allowed: up to 20 characters without | , ; < > [ ] or quotes")
    for key, value in (("low", low), ("high", high), ("reference", reference)):
        if value is not None and not math.isfinite(value):
            raise StudyFileError(f"{where}.{key}: {value!r} is not a finite number")
    if not low < high:
        raise StudyFileError(f"{where}.high: {high:g} is not above low {low:g} ({name})")
    if not math.isfinite(high - low):
        raise StudyFileError(
            f"{where}: the range {low:g} … {high:g} of {name} is too wide; allowed: a finite difference"
        )
    middle = low + (high - low) / 2 if reference is None else reference
    return DesignFactor(name, low, high, "" if unit == "1" else unit, middle)


def make_names(name: str, levels: tuple[str, ...], where: str) -> DesignFactor:
    """A checked factor with named levels; raises StudyFileError."""
    checked_name(name, f"{where}.name")
    if len(levels) < 2 or len(set(levels)) < len(levels):
        raise StudyFileError(f"{where}.levels: {list(levels)}; allowed: two or more different names ({name})")
    for level in levels:
        if not LEVEL.fullmatch(level) or is_number(level):
            raise StudyFileError(
                f"{where}.levels: {level!r}; allowed: names of up to 40 characters without | , ; < > [ ] or quotes "
                f"({name})"
            )
    return DesignFactor(name, -1.0, 1.0, "", 0.0, levels)


def is_number(text: str) -> bool:
    """Whether ``text`` reads as a number."""
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def factor_words(factors: tuple[DesignFactor, ...]) -> dict[str, int]:
    """Names and letters of the factors → their positions; a letter that is the name of any factor means that factor."""
    names = {factor.name: k for k, factor in enumerate(factors)}
    letters = enumerate(factor_letters(len(factors)))
    return names | {letter: k for k, letter in letters if letter not in names}


def coded_constraint(text: str, factors: tuple[DesignFactor, ...]) -> tuple[float, ...]:
    """A constraint such as "A + 2 B <= 30" in the factors' units, as a_1, …, a_k, b of a x <= b in coded units.

    `factor_words` gives the allowed names of factors. Raises CommandError.
    """
    allowed = "allowed: the form A + 2*B <= 30, with letters or names of factors"
    sides = re.split("<=|>=|≤|≥", text)
    if len(sides) != 2:
        raise CommandError(f"--constraint {text!r}: {allowed}")
    known = factor_words(factors)
    name = "|".join(re.escape(one) for one in sorted(known, key=len, reverse=True))
    # "2E+3" is 2000, but twice a factor E, and 3 more, where there is one.
    exponent = "" if {"e", "E"} & set(known) else r"(?:[eE][+-]?\d+)?"
    number = rf"\d+\.?\d*{exponent}|\.\d+"
    term = re.compile(rf"([+\-−]?)\s*(?:({number})\s*(?:\*?\s*({name})(?!\w))?|({name})(?!\w))\s*")
    weights, bound = np.zeros(len(factors)), 0.0
    for side, part in zip((1.0, -1.0), sides, strict=True):
        rest = part.strip()
        while rest:
            match = term.match(rest)
            if match is None or (not match[1] and rest != part.strip()):
                raise CommandError(f"--constraint {text!r}: cannot read {rest!r}; {allowed}: {', '.join(known)}")
            size, named = (
                side * (-1.0 if match[1] in {"-", "−"} else 1.0) * float(match[2] or 1.0),
                match[3] or match[4],
            )
            if named is None:
                bound -= size
            elif factors[known[named]].levels:
                raise CommandError(f"--constraint {text!r}: {named} has named levels; {allowed} that are numbers")
            else:
                weights[known[named]] += size
            rest = rest[match.end() :]
    if not weights.any():
        raise CommandError(f"--constraint {text!r}: names no factor; {allowed}: {', '.join(known)}")
    turn = -1.0 if re.search(">=|≥", text) else 1.0
    region = region_of(factors)
    coded = weights * region.half_width
    return tuple((turn * np.append(coded, bound - weights @ region.centre)).tolist())


def checked_name(name: str, where: str) -> str:
    """A name that can head a column; raises StudyFileError."""
    if not NAME.fullmatch(name):
        raise StudyFileError(
            f"{where}: {name!r}; allowed: up to 60 letters, digits, _ and -, beginning with a letter or _"
        )
    if name in RESERVED:
        raise StudyFileError(f"{where}: {name!r} is a reserved column name; allowed: another name")
    return name


def no_repeats(factors: tuple[DesignFactor, ...], responses: tuple[str, ...]) -> None:
    """Raise StudyFileError for a name that two columns would share."""
    columns = [*(factor.name for factor in factors), *responses]
    for name in columns:
        if columns.count(name) > 1:
            raise StudyFileError(f"name {name!r} appears twice; allowed: each column once")


def _factor(table: FactorTable, where: str) -> DesignFactor:
    """A factor with low and high, or with levels."""
    if table.levels:
        for key, value in (("low", table.low), ("high", table.high), ("reference", table.reference)):
            if value is not None:
                raise StudyFileError(
                    f"{where}.{key}: {value:g} together with levels ({table.name}); allowed: one or the other"
                )
        return make_names(table.name, table.levels, where)
    if table.low is None or table.high is None:
        key = "low" if table.low is None else "high"
        raise StudyFileError(f"{where}.{key}: missing in {table.name}; needed: low and high, or levels")
    return make_factor(table.name, table.low, table.high, table.unit, table.reference, where)


def _factors_file(table: FactorsTable) -> FactorsFile:
    if not 1 <= len(table.factor) <= MOST_FACTORS:
        raise StudyFileError(f"[[factor]]: {len(table.factor)} of them; allowed: 1 to {MOST_FACTORS}")
    entries = [checked(FactorTable, entry, f"factor[{k}]") for k, entry in enumerate(table.factor, start=1)]
    factors = tuple(_factor(one, f"factor[{k}]") for k, one in enumerate(entries, start=1))
    if not table.responses:
        raise StudyFileError("responses: []; allowed: a list of names")
    heads = [RESPONSE.fullmatch(text) for text in table.responses]
    for text, head in zip(table.responses, heads, strict=True):
        if head is not None and head["unit"] and not UNIT.fullmatch(head["unit"]):
            raise StudyFileError(
                f"responses: unit of {text!r}; allowed: up to 20 characters without | , ; < > or quotes"
            )
    responses = tuple(
        checked_name(text if head is None else head["name"], "responses")
        for text, head in zip(table.responses, heads, strict=True)
    )
    units = tuple("" if head is None else head["unit"] or "" for head in heads)
    no_repeats(factors, responses)
    title = " ".join(table.title.split())
    numbers = (table.replicates, table.centre, table.seed, table.first_seed)
    return FactorsFile(title, factors, responses, *numbers, response_units=units if any(units) else ())
