"""Checks of a parsed study file that need no scene: keys, types and plain numbers.

Every function returns the checked value or raises StudyFileError with one line: key, value, what is allowed.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

from doe.errors import StudyFileError

Table = dict[str, Any]


def only(table: Table, allowed: Collection[str], where: str) -> None:
    """Refuse a key that is not one of ``allowed``."""
    for key in table:
        if key not in allowed:
            raise StudyFileError(f"{_full(where, key)}: unknown key; allowed: {', '.join(sorted(allowed))}")


def section(table: Table, key: str) -> Table:
    """The table [key], empty if it is not there."""
    found = table.get(key, {})
    if not isinstance(found, dict):
        raise StudyFileError(f"{key}: a table is needed, not {found!r}")
    return found


def entries(table: Table, key: str) -> list[Table]:
    """The tables [[key]], none if there are none."""
    found = table.get(key, [])
    if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
        raise StudyFileError(f"{key}: tables [[{key}]] are needed, not {found!r}")
    return found


def required(table: Table, keys: Collection[str], where: str) -> None:
    """Refuse a table in which one of ``keys`` is missing."""
    for key in keys:
        if key not in table:
            raise StudyFileError(f"{where}.{key}: missing in {table.get('name', 'an entry')}")


def number(value: Any, key: str, least: float = -math.inf) -> float:
    """A finite number of at least ``least``; text is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise StudyFileError(f"{key}: {value!r} is not a number")
    if value < least:
        raise StudyFileError(f"{key}: {value:g} is below {least:g}")
    return float(value)


def positive(value: Any, key: str) -> float:
    """A finite number above zero."""
    if not number(value, key) > 0:
        raise StudyFileError(f"{key}: {value:g} must be positive")
    return float(value)


def whole(value: Any, key: str, least: int) -> int:
    """A whole number of at least ``least``."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise StudyFileError(f"{key}: {value!r} is not a whole number of at least {least}")
    return value


def names(value: Any, key: str, allowed: Collection[str]) -> tuple[str, ...]:
    """A list of names, each one of ``allowed`` and none twice."""
    if not isinstance(value, list):
        raise StudyFileError(f"{key}: a list of names is needed, not {value!r}")
    for name in value:
        one_of(name, key, allowed)
        if value.count(name) > 1:
            raise StudyFileError(f"{key}: {name!r} stands twice")
    return tuple(value)


def one_of(value: Any, key: str, allowed: Collection[str]) -> str:
    """A name that is one of ``allowed``."""
    if not isinstance(value, str) or value not in allowed:
        raise StudyFileError(f"{key}: {value!r} is not one of {', '.join(allowed)}")
    return value


def _full(where: str, key: str) -> str:
    return f"{where}.{key}" if where else key
