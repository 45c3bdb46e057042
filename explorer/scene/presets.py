"""Named sets of parameter values (:class:`PresetFile`): shipped ones, and those that a user has saved."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from platformdirs import user_data_path

from explorer.errors import CommandError
from explorer.files.output_file import write_whole
from explorer.scene.source import Difference
from explorer.scene.text import toml_value
from solver.assets import asset_path, shipped_assets
from solver.params import ParameterError
from solver.scenes.scene import Scene, canonical, parameters
from solver.toml_file import TomlTable, checked, read_toml

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,39}")
OWN_MARK = " (own)"
"""Suffix of the name of a user's preset in a list."""
MOST_BYTES = 100_000


class PresetFile(TomlTable):
    """A preset as a TOML file."""

    format: Literal[1]
    title: str | None = None
    about: str = ""
    """What it is for, in a sentence."""
    values: dict[str, Any]
    """Path → value in SI or with a unit, such as "pair.*.*.static_friction" = 0.0, where * is any one name."""


@dataclass(frozen=True)
class Preset:
    """Values by path; ``*`` in a path stands for any one name."""

    title: str
    about: str
    values: Mapping[str, Any]


def preset_names(folder: Path) -> tuple[str, ...]:
    """The presets on offer: the shipped ones, then those in ``folder``, marked as the user's own."""
    own = sorted(path.stem for path in folder.glob("*.toml")) if folder.is_dir() else []
    return (*shipped_assets("presets"), *(f"{name}{OWN_MARK}" for name in own))


def preset_path(name: str, folder: Path) -> Path:
    """The file of one of :func:`preset_names`. Raises CommandError for any other name."""
    if name not in preset_names(folder):
        raise CommandError(f"preset {name[:60]!r}: no such preset")
    own = name.removesuffix(OWN_MARK)
    return asset_path("presets", name) if own == name else folder / f"{own}.toml"


def read_preset(path: Path) -> Preset:
    """The preset in ``path``. Raises ParameterError, in one line that names file, key and what is allowed."""
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        raise ParameterError(f"{path}: {path.stat().st_size} bytes; allowed: up to {MOST_BYTES}")
    table = read_toml(path)
    try:
        file = checked(PresetFile, table)
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from None
    return Preset(file.title or path.stem, file.about, _flat(file.values))


def preset_values(preset: Preset, scene: Scene) -> dict[str, float | str]:
    """Values for ``scene`` by path, each checked; later lines of the file override earlier ones.

    Raises ParameterError for a path that the scene does not have and for a value that is not allowed.
    """
    found: dict[str, float | str] = {}
    known = parameters(scene)
    for pattern, raw in preset.values.items():
        paths = _matching(pattern, known) if "*" in pattern else [canonical(scene, pattern)]
        if not paths:
            raise ParameterError(f"{preset.title}: {pattern}: no parameter of this scene has this name")
        found |= {path: known[path].check(raw) for path in paths}
    return found


def save_preset(name: str, folder: Path, changed: Iterable[Difference]) -> Path:
    """Write what differs from the default as the preset ``name``; an existing preset of that name is replaced.

    Raises CommandError for a name that is not allowed, and if nothing differs.
    """
    if not NAME.fullmatch(name):
        raise CommandError(f"preset {name[:60]!r}: up to 40 letters, digits, blanks, - and _ are allowed")
    rows = [f"{toml_value(one.path)} = {toml_value(one.now)}" for one in changed]
    if not rows:
        raise CommandError("preset: nothing differs from the default, so there is nothing to save")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.toml"
    heading = f'# Preset; values in SI.\nformat = 1\ntitle = {toml_value(name)}\nabout = "saved from the page"\n'
    write_whole(path, "\n".join((heading, "[values]", *rows, "")))
    return path


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Entries by path, whether a path is written as one quoted key or as nested tables."""
    found: dict[str, Any] = {}
    for key, entry in table.items():
        path = f"{prefix}{key}"
        found |= _flat(entry, f"{path}.") if isinstance(entry, dict) else {path: entry}
    return found


def _matching(pattern: str, paths: Iterable[str]) -> list[str]:
    form = re.compile(re.escape(pattern).replace(r"\*", r"[^.]+"))
    return [path for path in paths if form.fullmatch(path)]


def data_folder() -> Path:
    """Folder of this user's studies, diagnoses, presets, uploads and recordings."""
    return user_data_path("repose-explorer")
