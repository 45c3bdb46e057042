"""EDEM's values as tables: of materials, and of pairs of them; and the folders that are exported for it.

G and ν are as here, so E = 2 G (1 + ν). Rolling friction is a constant torque μ_r F_n R_i there, R_i from the contact
to the centre of the body; here a spring with the cap μ_r R* F_n (`explorer/export/material_table.py`).
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from explorer.errors import CommandError
from explorer.imported.found import Found, grains, one_rolling, text_of
from solver import ParameterError
from solver.params import parse_quantity

EDEM_KEYS = {
    "poisson_s_ratio": ("poisson_ratio", ""),
    "poisson_ratio": ("poisson_ratio", ""),
    "solids_density": ("density", "kg/m3"),
    "density": ("density", "kg/m3"),
    "shear_modulus": ("shear_modulus", "Pa"),
    "poissons_ratio": ("poisson_ratio", ""),
    "young_s_modulus": ("youngs_modulus", "Pa"),
    "youngs_modulus": ("youngs_modulus", "Pa"),
    "coefficient_of_restitution": ("restitution", ""),
    "restitution": ("restitution", ""),
    "coefficient_of_static_friction": ("static_friction", ""),
    "static_friction": ("static_friction", ""),
    "coefficient_of_rolling_friction": ("rolling", ""),
    "rolling_friction": ("rolling", ""),
    "rolling_friction_here": ("rolling_here", ""),
}
"""EDEM's names, and those of `explorer export --to edem`, in lower case with _ between words → ours, unit."""
NAMES = re.compile(r"material|body|bodies|particle|component|partner|geometry|wall|other|second|with")
"""Words of a second column that holds names."""
OWN_TABLES = ("bodies.csv", "materials.csv", "interactions.csv")
"""Of our own export, in the order in which they are read: pairs name bodies, bodies name materials."""
ROUNDED = 1e-3
"""Relative difference by which a Young's modulus may differ from what G and ν say."""
SILENT = {"restitution_same_damping", "mass_kg", "ixx_kg_m2", "iyy_kg_m2", "izz_kg_m2", "member_spheres"}
"""Columns of our own export that say the same once more, or what cannot be read back."""


@dataclass
class Rows:
    """A table: keys and units of its columns, and its rows."""

    columns: list[tuple[str, str]]
    rows: list[list[str]] = field(default_factory=list)


def read_edem(file: Path) -> Found:
    """What tables of EDEM's values say of materials and of pairs of them: a file, or a folder that was exported to."""
    found, material_of = Found(), dict[str, str]()
    rolling: dict[str, dict[frozenset[str], float]] = {"rolling": {}, "rolling_here": {}}
    for path in [file / name for name in OWN_TABLES if (file / name).is_file()] if file.is_dir() else [file]:
        for table in _tables(path):
            if table.columns[0][0] == "body":
                _edem_bodies(path, found, material_of, table)
            else:
                _edem_numbers(path, found, rolling, material_of, table)
    poured = [body["material"] for body in found.bodies.values()] or grains(found)
    if poured and any(rolling["rolling_here"].values()):
        one_rolling(found, rolling["rolling_here"], poured)
    elif poured and any(rolling["rolling"].values()):
        one_rolling(found, rolling["rolling"], poured)
        found.notes.append(
            "rolling friction: there a constant torque mu_r F_n R_i with the arm to the centre, here a spring with the "
            "cap mu_r R* F_n: the number is a start, no equal"
        )
    own = {next(iter(pair)) for pair in found.pairs if len(pair) == 1}
    walls = [name for name in found.materials if name not in own]
    found.wall = walls[0] if walls and own else ""
    for name, entry in found.materials.items():
        if {"youngs_modulus", "shear_modulus", "poisson_ratio"} <= set(entry):
            young, follows = entry.pop("youngs_modulus"), 2.0 * entry["shear_modulus"] * (1.0 + entry["poisson_ratio"])
            if not math.isclose(young, follows, rel_tol=ROUNDED):
                raise CommandError(
                    f"{file}: {name}: Young's modulus {young:g}: differs from 2 G (1 + nu); allowed: {follows:g}, or "
                    "no Young's modulus"
                )
    if any("shear_modulus" in entry for entry in found.materials.values()):
        found.notes.append("elasticity: G and nu as there, so E = 2 G (1 + nu)")
    return found


def _tables(path: Path) -> list[Rows]:
    """The tables of a text; a row with EDEM's names begins another one.

    Between cells is a comma, or a semicolon or a tab; beside these a comma in a number is its decimal sign.
    """
    found: list[Rows] = []
    for line in text_of(path).splitlines():
        mark = next((mark for mark in "\t;," if mark in line), ",")
        row = [cell.strip() for cell in next(csv.reader([line], delimiter=mark), [])]
        if mark != ",":
            row = [re.sub(r"(?<=\d),(?=\d)", ".", cell) for cell in row]
        columns = [_column(cell) for cell in row]
        if any(key in EDEM_KEYS for key, _ in columns) or columns[:2] == [("body", ""), ("material", "")]:
            found.append(Rows(columns))
        elif any(row) and found and not line.startswith("#"):
            found[-1].rows.append(row)
    return found


def _column(cell: str) -> tuple[str, str]:
    """Key and unit of ``Shear Modulus [Pa]``, ``Solids Density (kg/m3)`` or ``shear_modulus_Pa``."""
    match = re.fullmatch(r"(.*?)\s*[\[(](.*)[\])]", cell)
    name, unit = (match[1], match[2].replace("^", "").replace("³", "3")) if match else (cell, "")
    key = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    return re.sub(r"_(pa|kg_m3)$", "", key) if key not in SILENT else key, "" if unit in ("-", "1") else unit


def _edem_bodies(path: Path, found: Found, material_of: dict[str, str], table: Rows) -> None:
    for row in table.rows:
        cells = dict(zip((key for key, _ in table.columns), row, strict=False))
        if not cells.get("material"):
            raise CommandError(f"{path}: {row[0]}: material is missing")
        material_of[cells["body"]] = material = _name(cells["material"])
        body: dict[str, Any] = {"material": material}
        if cells.get("mass_fraction"):
            body["mass_fraction"] = _cell(path, "mass_fraction", cells["mass_fraction"], "")
        found.bodies[cells["body"]] = body
    found.notes.append("bodies.csv: mass, moments, spheres and sizes are not taken")


def _edem_numbers(
    path: Path,
    found: Found,
    rolling: Mapping[str, dict[frozenset[str], float]],
    material_of: Mapping[str, str],
    table: Rows,
) -> None:
    """A table of materials, or of pairs: one or two columns of names before the numbers."""
    width = next(k for k, (key, _) in enumerate(table.columns) if key in EDEM_KEYS)
    if width not in (1, 2):
        raise CommandError(f"{path}: {width} columns before the numbers; allowed: a material, or two of a pair")
    if width == 2 and not _is_named(table.columns[1][0], [row[1] for row in table.rows if len(row) > 1], found, table):
        width = 1  # of materials, after all
    for key, _ in table.columns[width:]:
        if key and key not in EDEM_KEYS and key not in SILENT:
            found.notes.append(f"{key}: no counterpart, not taken")
    for row in table.rows:
        names = row[:width] if width == 2 else [part.strip() for part in row[0].split(":")]
        names = [_name(material_of.get(name, name)) for name in names]
        for (key, unit), text in zip(table.columns[width:], row[width:], strict=False):
            if key not in EDEM_KEYS or not text:
                continue
            ours, usual = EDEM_KEYS[key]
            value = _cell(path, f"{' : '.join(names)}: {key}", text + unit, usual)
            if ours in rolling:
                rolling[ours][frozenset(names)] = value
            elif ours in ("restitution", "static_friction"):
                entry = found.pairs.setdefault(frozenset(names), {})
                if entry.get(ours, value) != value:
                    found.notes.append(
                        f"{' and '.join(names)}: {ours} {entry[ours]:g}, then {value:g}; the last is taken"
                    )
                entry[ours] = value
            else:
                found.materials.setdefault(names[0], {})[ours] = value


def _is_named(header: str, cells: list[str], found: Found, table: Rows) -> bool:
    """Whether a second column names the other material of a pair."""
    known = {*found.materials, *found.bodies, *(_name(row[0]) for row in table.rows)}
    return not header or NAMES.search(header) is not None or all(_name(cell) in known for cell in cells)


def _name(name: str) -> str:
    """As a path has it: no blank, no dot."""
    return re.sub(r"[.\s]+", "_", name)


def _cell(path: Path, where: str, text: str, unit: str) -> float:
    try:
        return parse_quantity(text if unit and not _plain(text) else float(text), unit or "1", where)
    except (ParameterError, ValueError) as error:
        raise CommandError(f"{path}: {where}: {text!r} is not a number: {error}") from None


def _plain(text: str) -> bool:
    return re.fullmatch(r"[-+0-9.eE]+", text) is not None
