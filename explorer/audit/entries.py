"""The entries of a study.toml: numbers keep the digits that they are printed with, and a wrong key is one line."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from doe.audit import Printed, printed
from doe.errors import AuditError

FILE = "study.toml"


class Digits(str):
    """The text of a TOML float: 0.50 stays "0.50"."""


def read_entries(folder: Path) -> TableEntries:
    """``study.toml`` of a folder. Raises AuditError where it is missing or is no TOML."""
    path = folder / FILE
    if not path.is_file():
        raise AuditError(f"{path}: no such file; doe/audit/README.md describes its content")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"), parse_float=Digits)
    except UnicodeDecodeError:
        raise AuditError(f"{path}: not a text file in UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise AuditError(f"{path}: {error}") from None
    return TableEntries(table, FILE)


class TableEntries:
    """One table of the file; every key that is asked for is taken, and `finish` refuses what is left."""

    def __init__(self, table: Mapping[str, Any], where: str) -> None:
        self._table, self._where, self._taken = table, where, set[str]()

    def __contains__(self, key: str) -> bool:
        return key in self._table

    def names(self) -> tuple[str, ...]:
        """Keys in the order of the file."""
        return tuple(self._table)

    def text(self, key: str, default: str | None = None) -> str:
        """A text; AuditError where it is missing without a default."""
        value = self._get(key, default)
        if not isinstance(value, str) or isinstance(value, Digits):
            raise self.error(key, f"a string is needed, not {value!r}")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of texts."""
        value = self._get(key)
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self.error(key, "a list of strings is needed")
        return tuple(map(str, value))

    def figure(self, key: str) -> Printed:
        """A number as printed: 24.68, or "<0.0001" in quotes."""
        value = self._get(key)
        if isinstance(value, bool) or not isinstance(value, str | int):
            raise self.error(key, f"a number is needed, not {value!r}")
        try:
            return printed(str(value))
        except AuditError as error:
            raise self.error(key, str(error)) from None

    def figure_or_none(self, key: str) -> Printed | None:
        """The same where it may be missing."""
        return self.figure(key) if key in self else None

    def number(self, key: str, low: float = -math.inf, high: float = math.inf) -> float:
        """A number with low < number ≤ high."""
        value = self.figure(key).value
        if not low < value <= high:
            raise self.error(key, f"{value:g} is not allowed; allowed: above {low:g}, up to {high:g}")
        return value

    def whole(self, key: str, low: int, high: int = 1_000_000) -> int:
        """A whole number within [low, high]."""
        value = self._get(key)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.error(key, f"{value!r} is not allowed; allowed: whole numbers {low} … {high}")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """true or false."""
        value = self._get(key, default)
        if not isinstance(value, bool):
            raise self.error(key, f"true or false is needed, not {value!r}")
        return value

    def table(self, key: str) -> TableEntries:
        """A table inside this one."""
        value = self._get(key)
        if not isinstance(value, dict):
            raise self.error(key, f"a table [{key}] is needed, not {value!r}")
        return TableEntries(value, self._name(key))

    def tables(self, key: str) -> tuple[TableEntries, ...]:
        """A list of tables, empty where it is missing; a single table is a list of one."""
        value = self._get(key, [])
        if isinstance(value, dict):
            return (TableEntries(value, self._name(key)),)
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            raise self.error(key, f"a list of tables [[{key}]] is needed")
        return tuple(TableEntries(item, f"{self._name(key)} {number}") for number, item in enumerate(value, 1))

    def finish(self) -> None:
        """Raise AuditError for a key that nothing asked for."""
        left = [key for key in self._table if key not in self._taken]
        if left:
            raise self.error(left[0], f"unknown key; allowed: {', '.join(sorted(self._taken))}")

    def error(self, key: str, words: str) -> AuditError:
        """An error about one key of this table."""
        return AuditError(f"{self._name(key)}: {words}")

    def _name(self, key: str) -> str:
        return f"{self._where}: {key}" if self._where == FILE else f"{self._where}.{key}"

    def _get(self, key: str, default: Any = None) -> Any:
        self._taken.add(key)
        if key in self._table:
            return self._table[key]
        if default is None:
            raise self.error(key, "is missing")
        return default
