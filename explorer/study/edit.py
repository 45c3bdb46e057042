"""A study with other ranges and another target: the study's file, changed, as a file of its own.

What is changed is given by the names of factors and, for the first target, by its keys; everything else stays as it is
in the file. The result is read back by the loader of every study before anything is started.
"""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from doe.studies.study import Study, study_from
from explorer.errors import CommandError
from explorer.scene.text import toml_key, toml_value
from solver import ParameterError, asset_path, read_toml
from solver.assets import shipped_assets

TARGET_KEYS = ("mean", "sd", "n", "margin")
RANGE_KEYS = ("low", "high", "reference")


@dataclass(frozen=True)
class StudyEdits:
    """What is asked otherwise than in the file; SI. Empty: nothing."""

    factors: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Factor's name → some of ``RANGE_KEYS`` → value."""
    target: Mapping[str, float] = field(default_factory=dict)
    """Some of ``TARGET_KEYS`` of the first target → value."""

    def __bool__(self) -> bool:
        return bool(self.target) or any(self.factors.values())


def edited_study(file: Path, edits: StudyEdits) -> tuple[str, Study]:
    """Text of the changed study and the study that it gives. Raises a ValueError with one line."""
    text = study_toml(edited_table(read_toml(file), edits, file.parent), _heading(file, edits))
    try:
        return text, study_from(tomllib.loads(text), file)
    except ValueError as error:
        raise CommandError(f"changed study: {error}") from None


def edited_table(table: Mapping[str, Any], edits: StudyEdits, folder: Path) -> dict[str, Any]:
    """``table`` of a study file in ``folder`` with the changes; a material's own file is named by its full path."""
    changed = copy.deepcopy(dict(table))
    entries = {str(entry.get("name")): entry for entry in changed.get("factor", [])}
    for name, values in edits.factors.items():
        if name not in entries:
            raise ParameterError(f"factor {name!r} is not in the study; allowed: {', '.join(entries)}")
        entries[name].update({key: values[key] for key in RANGE_KEYS if key in values})
    if edits.target and changed.get("target"):
        target = changed["target"][0]
        target.update({key: edits.target[key] for key in TARGET_KEYS if key in edits.target})
        if "n" in edits.target:
            target["n"] = int(edits.target["n"])
    own = asset_path("materials", str(changed["material"]), relative_to=folder)
    if own.stem not in shipped_assets("materials") or own != asset_path("materials", own.stem):
        changed["material"] = str(own.absolute())
    return changed


def study_toml(table: Mapping[str, Any], heading: str = "") -> str:
    """A study's table as TOML: plain keys, then its tables, then its lists of tables."""
    parts = ["".join(f"# {line}\n" for line in heading.splitlines())]
    parts.append(_lines({key: value for key, value in table.items() if not _is_table(value)}))
    for key, value in table.items():
        if isinstance(value, Mapping):
            nested = {name: entry for name, entry in value.items() if isinstance(entry, Mapping)}
            own = {name: entry for name, entry in value.items() if name not in nested}
            parts += [f"[{toml_key(key)}]\n{_lines(own)}"] if own or not nested else []
            parts += [f"[{toml_key(key)}.{toml_key(name)}]\n{_lines(entry)}" for name, entry in nested.items()]
        elif _is_table(value):
            parts += [f"[[{toml_key(key)}]]\n{_lines(entry)}" for entry in value]
    return "\n".join(part for part in parts if part)


def listed_edits(study: Study, edits: StudyEdits) -> list[tuple[str, str, float | str | None, float]]:
    """(whose, key, value in the file, changed value) of every change, SI; whose: a factor's name, or "target"."""
    factors = {factor.name: factor for factor in study.factors}
    rows: list[tuple[str, str, float | str | None, float]] = [
        (name, key, getattr(factors[name], key), value)
        for name, values in edits.factors.items()
        for key, value in values.items()
    ]
    rows += [("target", key, getattr(study.targets[0], key), value) for key, value in edits.target.items()]
    return rows


def _heading(file: Path, edits: StudyEdits) -> str:
    changed = [*(name for name, values in edits.factors.items() if values), *(["target"] if edits.target else [])]
    return f"{file.name}, changed on the page: {', '.join(changed)}. SI unless a unit is written."


def _is_table(value: Any) -> bool:
    listed = isinstance(value, list) and value and all(isinstance(entry, Mapping) for entry in value)
    return bool(isinstance(value, Mapping) or listed)


def _lines(entries: Mapping[str, Any]) -> str:
    return "".join(f"{toml_key(key)} = {toml_value(entry)}\n" for key, entry in entries.items())
