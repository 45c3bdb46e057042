"""A study with other ranges or another target: the study's file, changed, as a file of its own; or a measured target,
written into the file itself.

Changes are given by the names of factors and, for the first target, by its keys. Everything else stays as it is in the
file, comments included. The loader that reads every study reads the result back before anything is started.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomlkit

from doe.studies.study import Study, study_from
from doe.target import Target
from explorer.errors import CommandError
from solver import ParameterError, asset_path, read_toml
from solver.assets import shipped_assets

TARGET_KEYS = ("mean", "sd", "n", "margin")
RANGE_KEYS = ("low", "high", "reference")
MEASURED_KEYS = ("mean", "sd", "n", "sd_source")
"""Keys of a target that a measurement replaces; weight and margin are decisions and stay."""
TARGET_LINE = re.compile(r"\s*\[\[\s*target\s*\]\]")
KEY_LINE = re.compile(r"""(\s*)(\w+)(\s*=\s*)("[^"]*"|'[^']*'|[^\s#]+)(.*)""", re.DOTALL)


@dataclass(frozen=True)
class StudyEdits:
    """What is to differ from the file; SI. Empty: nothing."""

    factors: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Factor's name → some of ``RANGE_KEYS`` → value."""
    target: Mapping[str, float] = field(default_factory=dict)
    """Some of ``TARGET_KEYS`` of the first target → value."""

    def __bool__(self) -> bool:
        return bool(self.target) or any(self.factors.values())


def edited_study(file: Path, edits: StudyEdits) -> tuple[str, Study]:
    """Text of the changed study, and the study itself. Raises a ValueError in one line."""
    read_toml(file)  # refuses invalid TOML in one line
    document = tomlkit.parse(file.read_text(encoding="utf-8-sig"))
    _edit(document, edits, file.parent)
    text = _heading(file, edits) + tomlkit.dumps(document)
    try:
        return text, study_from(tomlkit.parse(text).unwrap(), file)
    except ValueError as error:
        raise CommandError(f"changed study: {error}") from None


def _edit(document: tomlkit.TOMLDocument, edits: StudyEdits, folder: Path) -> None:
    """Change a study whose file is in ``folder``; a material file of the user's own is named by its full path."""
    entries: dict[str, Any] = {str(entry.get("name")): entry for entry in document.get("factor", [])}
    for name, values in edits.factors.items():
        if name not in entries:
            raise ParameterError(f"factor {name!r} is not in the study; allowed: {', '.join(entries)}")
        entries[name].update({key: values[key] for key in RANGE_KEYS if key in values})
    if edits.target and document.get("target"):
        whole = {"n": int(edits.target["n"])} if "n" in edits.target else {}
        document["target"][0].update({key: edits.target[key] for key in TARGET_KEYS if key in edits.target} | whole)
    own = asset_path("materials", str(document["material"]), relative_to=folder)
    if own.stem not in shipped_assets("materials") or own != asset_path("materials", own.stem):
        document["material"] = str(own.absolute())


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
    how = f"changed on the page: {', '.join(changed)}" if changed else "as it was started on the page"
    return f"# {file.name}, {how}. SI unless a unit is written.\n\n"


def remeasured(file: Path, target: Target, note: str) -> str:
    """Text of the study ``file``, in which ``target`` replaces the target with the same observable.

    Only the lines of ``MEASURED_KEYS`` change; whatever follows a value, and line endings, stay. ``note`` becomes a
    comment above ``mean`` and replaces an earlier one that begins with the same word.

    Raises CommandError in one line if the file does not write that target with one line per key.
    """
    before = read_toml(file)
    place = next(k for k, one in enumerate(before["target"]) if one["observable"] == target.observable)
    values = {key: value for key in MEASURED_KEYS if (value := getattr(target, key)) is not None}
    lines = file.read_bytes().decode("utf-8").splitlines(keepends=True)
    heads = [k for k, line in enumerate(lines) if TARGET_LINE.match(line)]
    wanted = {key: value for key, value in before["target"][place].items() if key not in MEASURED_KEYS} | values
    if place < len(heads):
        first = heads[place] + 1
        last = next((k for k in range(first, len(lines)) if lines[k].lstrip().startswith("[")), len(lines))
        lines[first:last] = _remeasured_lines(lines[first:last], values, f"# {note}")
    text = "".join(lines)
    try:
        now = tomlkit.parse(text.removeprefix("\ufeff")).unwrap()
    except ValueError:
        now = {}
    targets = [*before["target"][:place], wanted, *before["target"][place + 1 :]]
    if now != {**before, "target": targets}:
        raise CommandError(f"{file}: target {target.observable}: allowed: a [[target]] with a line for each key")
    study_from(now, file)
    return text


def _remeasured_lines(lines: list[str], values: Mapping[str, float | str], note: str) -> list[str]:
    """The lines of a target with new ``values``: a missing key is added after ``mean``, one without value removed."""
    there = {match[2] for line in lines if (match := KEY_LINE.match(line))}
    found: list[str] = []
    for line in lines:
        match = KEY_LINE.match(line)
        if line.lstrip().startswith(note.partition(":")[0] + ":"):
            continue
        if not match or match[2] not in MEASURED_KEYS:
            found.append(line)
            continue
        indent, key, equals, old, behind = match.groups()
        behind, end = behind.rstrip("\r\n"), line[len(line.rstrip("\r\n")) :] or "\n"
        if key == "mean":
            found.append(f"{indent}{note}{end}")
        if key in values:
            new, comment = _toml(values[key]), behind.lstrip()
            # A comment stays in its column if the new value leaves room.
            gap = max(1, len(old) + len(behind) - len(comment) - len(new)) if comment else 0
            found.append(f"{indent}{key}{equals}{new}{' ' * gap}{comment}{end}")
        if key == "mean":
            missing = [other for other in MEASURED_KEYS if other in values and other not in there]
            found += [f"{indent}{other} = {_toml(values[other])}{end}" for other in missing]
    return found


def _toml(value: float | str) -> str:
    return tomlkit.item(value).as_string()
