"""Parsed TOML as tables, lists and vectors: one clear line for whatever has another form."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from solver.params import ParameterError, parse_quantity


def read_toml(path: Path) -> dict[str, Any]:
    """Parsed TOML file; a missing or malformed file is a :class:`ParameterError` with file and line."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ParameterError(f"{path}: no such file") from None
    except (IsADirectoryError, PermissionError) as error:
        raise ParameterError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ParameterError(f"{path}: not a text file in UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise ParameterError(f"{path}: {error}") from None


def as_table(value: Any, where: str) -> dict[str, Any]:
    """``value`` if it is a table; ``where`` names it in the message."""
    if not isinstance(value, dict):
        raise ParameterError(f"{where}: a table is needed, not {value!r}")
    return value


def table_at(table: dict[str, Any], key: str) -> dict[str, Any]:
    """The table under ``key``, which must be there."""
    if key not in table:
        raise ParameterError(f"[{key}] is missing")
    return as_table(table[key], key)


def list_at(table: dict[str, Any], key: str) -> list[Any]:
    """The list under ``key``; empty if it is missing."""
    value = table.get(key, [])
    if not isinstance(value, list):
        raise ParameterError(f"{key}: a list is needed, not {value!r}")
    return value


def vector(value: Any, where: str) -> tuple[float, float, float]:
    """Three finite numbers."""
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise ParameterError(f"{where}: three numbers are needed, not {value!r}")
    x, y, z = (parse_quantity(part, "1", where) for part in value)
    return x, y, z


def refuse_unknown(table: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    """Raise :class:`ParameterError` for a key that is not among ``known``."""
    unknown = sorted(set(table) - set(known))
    if unknown:
        raise ParameterError(f"{where}{unknown[0]}: unknown key; allowed: {', '.join(known)}")
