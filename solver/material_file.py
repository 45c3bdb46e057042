"""Material files: TOML → :class:`Scene` (schema below), with one clear line for whatever is wrong.

format = 1
gravity = [0.0, 0.0, -9.81]
contact_law = "hertz_mindlin"        the same as law in [contact]
assumed = [paths of values that nobody measured]
[materials.<name>]       density, and two of youngs_modulus, shear_modulus, poisson_ratio (SI or with a unit)
[[body]]                 name, material, mass_fraction, shape, … (`solver.body_table`)
[pair.<a>.<b>]           static_friction, restitution
[rig] [insertion] [numerics] [contact] [effect.<name>]     optional: another rig than the default funnel, settings,
                                 conventions of the contact law, effects that are switched on (see set_up.py)
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from solver.assets import asset_path
from solver.body import Body
from solver.body_table import read_body
from solver.contact_model import ContactModel
from solver.laws import CONTACT_LAWS, HertzMindlin
from solver.material import Material, Pair
from solver.params import ParameterError, declared, parse_quantity
from solver.rigs import Funnel
from solver.scene import Scene
from solver.set_up import TABLES, with_set_up
from solver.shape import ShapeError
from solver.toml_table import as_table, list_at, read_toml, table_at, vector

WALL = "rigid_sieve_plate"
KNOWN = {
    "format",
    "title",
    "name",
    "gravity",
    "contact_law",
    "assumed",
    "materials",
    "body",
    "pair",
    "measured",
    "wall",
    *TABLES,
}


def load_material(name: str, relative_to: Path | None = None) -> Scene:
    """Scene from a shipped material's name or a material file's path, in the funnel unless the file says else."""
    path = asset_path("materials", name, relative_to=relative_to)
    try:
        return scene_from(read_toml(path), path)
    except (ParameterError, ShapeError) as error:
        text = str(error)
        raise ParameterError(text if text.startswith(str(path)) else f"{path}: {text}") from None


def is_material(table: dict[str, Any]) -> bool:
    """Whether a parsed TOML file is a material: only those have materials or bodies."""
    return "materials" in table or "body" in table


def scene_from(table: dict[str, Any], path: Path) -> Scene:
    """Scene from a parsed material file; its rig is the default funnel unless it has a table ``[rig]``."""
    unknown = sorted(set(table) - KNOWN)
    if unknown:
        raise ParameterError(f"unknown key {unknown[0]!r}; allowed: {', '.join(sorted(KNOWN))}")
    if table.get("format") != 1:
        raise ParameterError(f"format: {table.get('format')!r} is not 1")
    law = str(table.get("contact_law", HertzMindlin.name))
    if law not in CONTACT_LAWS:
        raise ParameterError(f"contact_law: {law!r} is not one of {', '.join(CONTACT_LAWS)}")
    materials = tuple(_material(name, entry) for name, entry in table_at(table, "materials").items())
    bodies = tuple(read_body(entry, materials, path) for entry in list_at(table, "body"))
    if not bodies:
        raise ParameterError("body: at least one [[body]] is needed")
    total = sum(body.mass_fraction for body in bodies)
    if not math.isclose(total, 1.0, abs_tol=1e-6):
        raise ParameterError(f"body.*.mass_fraction: add up to {total:g}, not to 1")
    if len({body.name for body in bodies}) < len(bodies):
        raise ParameterError("body.name: two bodies share a name")
    scene = Scene(
        title=str(table.get("title", table.get("name", path.stem))),
        materials=materials,
        bodies=bodies,
        pairs=tuple(_pairs(table_at(table, "pair"))),
        rig=Funnel(wall=_wall(table, materials, bodies)),
        contact=ContactModel(law=law),
        gravity=vector(table.get("gravity", (0.0, 0.0, -9.81)), "gravity"),
        assumed=tuple(str(name) for name in list_at(table, "assumed")),
    )
    scene = with_set_up(scene, table, path.parent)
    if "contact_law" in table and scene.contact.law != law:
        raise ParameterError(f"contact_law: {law!r} is not the {scene.contact.law!r} of contact.law")
    return scene


def _wall(table: dict[str, Any], materials: tuple[Material, ...], bodies: tuple[Body, ...]) -> str:
    """Material of funnel and plate: ``wall``, or the one material that no body is made of."""
    names = [material.name for material in materials]
    free = [name for name in names if name not in {body.material for body in bodies}]
    wall = table.get("wall", free[0] if len(free) == 1 else None)
    if wall not in names:
        raise ParameterError(f"wall: {wall!r} names no material for funnel and plate; known: {', '.join(names)}")
    return str(wall)


def _material(name: str, entry: Any) -> Material:
    where = f"materials.{name}"
    known = declared(Material, where)
    values: dict[str, float] = {}
    for key, raw in as_table(entry, where).items():
        if key == "youngs_modulus":
            values[key] = parse_quantity(raw, "Pa", f"{where}.{key}")
        elif f"{where}.{key}" in known:
            values[key] = float(known[f"{where}.{key}"].check(raw))
        else:
            raise ParameterError(
                f"{where}.{key}: unknown key; allowed: density, youngs_modulus, shear_modulus, poisson_ratio"
            )
    elastic = [key for key in ("youngs_modulus", "shear_modulus", "poisson_ratio") if key in values]
    if len(elastic) != 2:
        raise ParameterError(
            f"{where}: needs exactly two of youngs_modulus, shear_modulus, poisson_ratio; "
            f"has {', '.join(elastic) or 'none'}"
        )
    young = values.pop("youngs_modulus", None)
    if young is not None and "shear_modulus" in values:
        ratio = young / (2.0 * values["shear_modulus"]) - 1.0
        values["poisson_ratio"] = float(known[f"{where}.poisson_ratio"].check(ratio))
    elif young is not None:
        shear = young / (2.0 * (1.0 + values["poisson_ratio"]))
        values["shear_modulus"] = float(known[f"{where}.shear_modulus"].check(shear))
    return Material(name=name, **values)


def _pairs(table: dict[str, Any]) -> list[Pair]:
    pairs: list[Pair] = []
    for a, partners in table.items():
        for b, entry in as_table(partners, f"pair.{a}").items():
            where = f"pair.{a}.{b}"
            known = declared(Pair, where)
            values = {}
            for key, raw in as_table(entry, where).items():
                if f"{where}.{key}" not in known:
                    raise ParameterError(f"{where}.{key}: unknown key; allowed: static_friction, restitution")
                values[key] = float(known[f"{where}.{key}"].check(raw))
            missing = {"static_friction", "restitution"} - set(values)
            if missing:
                raise ParameterError(f"{where}: {sorted(missing)[0]} is missing")
            if any(pair.joins(a, b) for pair in pairs):
                raise ParameterError(f"{where}: this pair stands twice")
            pairs.append(Pair(a, b, **values))
    return pairs
