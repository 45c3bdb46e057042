"""Material files: TOML → :class:`Scene` (schema below), with one clear line for whatever is wrong.

format = 1
gravity = [0.0, 0.0, -9.81]
contact_law = "hertz_mindlin"
assumed = [paths of values that nobody measured]
[materials.<name>]       density, and two of youngs_modulus, shear_modulus, poisson_ratio (SI or with a unit)
[[body]]                 name, material, mass_fraction, shape = { ellipsoid = […] } and spheres = "standard",
                         or sphere_centres, sphere_radii, mass, inertia
[pair.<a>.<b>]           static_friction, restitution
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

from solver.assets import asset_path
from solver.body import RESOLUTION, Body, Members
from solver.material import Material, Pair
from solver.params import ParameterError, declared, parse_quantity
from solver.rigs import Funnel
from solver.scene import Scene, check
from solver.shape import ShapeError, Solid

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
}


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


def load_material(name: str, relative_to: Path | None = None) -> Scene:
    """Scene with the default funnel from a shipped material's name or the path of a material file."""
    path = asset_path("materials", name, relative_to=relative_to)
    try:
        return scene_from(read_toml(path), path)
    except (ParameterError, ShapeError) as error:
        text = str(error)
        raise ParameterError(text if text.startswith(str(path)) else f"{path}: {text}") from None


def scene_from(table: dict[str, Any], path: Path) -> Scene:
    """Scene with the default rig from a parsed material file."""
    unknown = sorted(set(table) - KNOWN)
    if unknown:
        raise ParameterError(f"unknown key {unknown[0]!r}; allowed: {', '.join(sorted(KNOWN))}")
    if table.get("format") != 1:
        raise ParameterError(f"format: {table.get('format')!r} is not 1")
    if table.get("contact_law", "hertz_mindlin") != "hertz_mindlin":
        raise ParameterError(f"contact_law: {table['contact_law']!r} is not hertz_mindlin")
    materials = tuple(_material(name, entry) for name, entry in _table(table, "materials").items())
    bodies = tuple(_body(entry, materials, path) for entry in _list(table, "body"))
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
        pairs=tuple(_pairs(_table(table, "pair"))),
        rig=Funnel(wall=_wall(table, materials, bodies)),
        gravity=_vector(table.get("gravity", (0.0, 0.0, -9.81)), "gravity"),
        assumed=tuple(str(name) for name in _list(table, "assumed")),
    )
    check(scene)
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
    for key, raw in _as_table(entry, where).items():
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


def _body(entry: Any, materials: tuple[Material, ...], path: Path) -> Body:
    entry = _as_table(entry, "body")
    name = str(entry.get("name", ""))
    where = f"body.{name}"
    if not name or "." in name:
        raise ParameterError(f"body.name: {name!r} must be a non-empty name without a dot")
    names = {material.name: material for material in materials}
    material = names.get(str(entry.get("material", name)))
    if material is None:
        raise ParameterError(f"{where}.material: {entry.get('material')!r} is not one of {', '.join(names)}")
    fraction = parse_quantity(entry.get("mass_fraction", 1.0), "1", f"{where}.mass_fraction")
    if not 0.0 <= fraction <= 1.0:
        raise ParameterError(f"{where}.mass_fraction: {fraction:g} is outside 0 … 1")
    spheres = RESOLUTION.check(entry.get("spheres", "standard"))
    shape = _members(entry, where) if "sphere_centres" in entry else _solid(entry, where, path)
    return Body(name, material.name, fraction, shape, material.density, spheres)  # type: ignore[arg-type]


def _solid(entry: dict[str, Any], where: str, path: Path) -> Solid:
    shape = dict(_as_table(entry.get("shape"), f"{where}.shape"))
    if "mesh" in shape:
        shape["mesh"] = str(path.parent / str(shape["mesh"]))
    return Solid.from_toml(shape, f"{where}.shape")


def _members(entry: dict[str, Any], where: str) -> Members:
    centres = tuple(_vector(row, f"{where}.sphere_centres") for row in _list(entry, "sphere_centres"))
    radii = tuple(parse_quantity(r, "m", f"{where}.sphere_radii") for r in _list(entry, "sphere_radii"))
    mass = parse_quantity(entry.get("mass", 0.0), "kg", f"{where}.mass")
    inertia = _vector(entry.get("inertia", ()), f"{where}.inertia")
    if len(radii) != len(centres) or not centres:
        raise ParameterError(f"{where}.sphere_radii: {len(radii)} radii for {len(centres)} sphere_centres")
    if min(radii) <= 0.0 or mass <= 0.0 or min(inertia) <= 0.0:
        raise ParameterError(f"{where}: sphere_radii, mass and inertia must be positive")
    return Members(centres, radii, mass, inertia)


def _pairs(table: dict[str, Any]) -> list[Pair]:
    pairs: list[Pair] = []
    for a, partners in table.items():
        for b, entry in _as_table(partners, f"pair.{a}").items():
            where = f"pair.{a}.{b}"
            known = declared(Pair, where)
            values = {}
            for key, raw in _as_table(entry, where).items():
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


def _table(table: dict[str, Any], key: str) -> dict[str, Any]:
    if key not in table:
        raise ParameterError(f"[{key}] is missing")
    return _as_table(table[key], key)


def _list(table: dict[str, Any], key: str) -> list[Any]:
    value = table.get(key, [])
    if not isinstance(value, list):
        raise ParameterError(f"{key}: a list is needed, not {value!r}")
    return value


def _as_table(value: Any, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ParameterError(f"{where}: a table is needed, not {value!r}")
    return value


def _vector(value: Any, where: str) -> tuple[float, float, float]:
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise ParameterError(f"{where}: three numbers are needed, not {value!r}")
    x, y, z = (parse_quantity(part, "1", where) for part in value)
    return x, y, z
