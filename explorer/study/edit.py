"""A study with other ranges and another target: the study's file, changed, as a file of its own.

What is changed is given by the names of factors and, for the first target, by its keys; everything else stays as it is
in the file, comments included. The result is read back by the loader of every study before anything is started.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomlkit

from doe.studies.study import Study, study_from
from explorer.errors import CommandError
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
    read_toml(file)  # refuses in one line what is no TOML
    document = tomlkit.parse(file.read_text(encoding="utf-8-sig"))
    _edit(document, edits, file.parent)
    text = _heading(file, edits) + tomlkit.dumps(document)
    try:
        return text, study_from(tomlkit.parse(text).unwrap(), file)
    except ValueError as error:
        raise CommandError(f"changed study: {error}") from None


def _edit(document: tomlkit.TOMLDocument, edits: StudyEdits, folder: Path) -> None:
    """Change a study that stands in ``folder``; a material's own file is named by its full path."""
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
