"""Material files: TOML → :class:`Scene` (schema below), with one clear line for whatever is wrong.

format = 1
gravity = [0.0, 0.0, -9.81]
contact_law = "hertz_mindlin"        the same as law in [contact]
assumed = [paths of values that nobody measured]
[materials.<name>]       density, and two of youngs_modulus, shear_modulus, poisson_ratio (SI or with a unit)
[[body]]                 name, material, mass_fraction, shape, … (below)
[pair.<a>.<b>]           static_friction, restitution
[rig] [insertion] [numerics] [contact] [effect.<name>]     optional: another rig than the default funnel, settings,
                                 conventions of the contact law, effects that are switched on

**A component**, one ``[[body]]`` → :class:`Body`:

name, material, mass_fraction      which material (by default that of the body's name), its share of the mass
size_distribution, size_spread     how the sizes scatter (`solver.scenes.sizes`)
size                               instead of these two, measured diameters: { mean, sd } or { quantiles = { p05, … } }
                                   become log-normal sizes about the declared one (below)

and one of

shape, spheres                     a solid, { ellipsoid = […] } or { mesh = "grain.stl", unit = "mm" }, and how many
                                   spheres stand for it: coarse, standard, fine or a number
sphere_centres, sphere_radii, mass, inertia
                                   the spheres themselves, SI; with density, mass and inertia follow the material's
                                   density; with mesh and unit, that surface is drawn; fit keeps how well they follow it
file                               a file with one such [[body]], as `explorer shape` writes it; keys that stand beside
                                   ``file`` replace those in it

**Measured diameters** → spread of the sizes:

size = { mean = 1.212e-3, sd = 0.139e-3 }                              spread = sd / mean
size = { quantiles = { p05 = 1.105e-3, p50 = 1.204e-3, p95 = … } }     spread = √(exp t² − 1)

t is the slope of ln(quantile) over the quantile's normal deviate, by least squares: exact for log-normal sizes. Where
both stand, mean and sd count. Only the *relative* spread is taken; the sizes lie about the declared dimensions.
Source: moments and quantiles of the log-normal distribution, Johnson, Kotz & Balakrishnan 1994, ch. 14.

**Settings**, the tables ``[rig]``, ``[insertion]``, ``[numerics]``, ``[contact]`` and ``[effect.…]`` of this file or of
one that lies over a material: keys are the last parts of parameter paths (``outlet_height`` in ``[rig]`` is
``rig.outlet_height``); ``name`` in ``[rig]`` chooses the rig.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from solver.assets import asset_path
from solver.laws import CONTACT_LAWS, HertzMindlin
from solver.params import ParameterError, declared, parse_quantity
from solver.rigs import Funnel
from solver.scenes.body import SPHERES, Body, Members, body_parameters
from solver.scenes.contact_model import ContactModel
from solver.scenes.material import Material, Pair
from solver.scenes.scene import Scene, with_rig, with_values
from solver.scenes.sizes import SizeDistribution
from solver.shapes.clump_error import ClumpFit
from solver.shapes.solid import ShapeError, Solid
from solver.toml_table import as_table, list_at, read_toml, refuse_unknown, table_at, vector

TABLES = ("rig", "insertion", "numerics", "contact", "effect")

MESH = "rig.mesh"

"""Path of the parameter that names a file."""


def with_set_up(scene: Scene, table: Mapping[str, Any], folder: Path | None = None) -> Scene:
    """``scene`` with the set-up tables in ``table``, a parsed file whose other keys are of no concern here.

    A relative path in it, such as the mesh of a rig, starts in ``folder``; None: the working directory.
    """
    values: dict[str, Any] = {}
    for kind in TABLES:
        entries = table.get(kind, {})
        if not isinstance(entries, dict):
            raise ParameterError(f"{kind}: a table is needed, not {entries!r}")
        values |= dict(_by_path(kind, entries))
    if folder is not None and (own := folder / Path(str(values.get(MESH, ""))).expanduser()).is_file():
        values[MESH] = str(own)
    return with_settings(scene, values)


def _by_path(prefix: str, entries: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in entries.items():
        if isinstance(value, dict):
            yield from _by_path(f"{prefix}.{key}", value)
        else:
            yield f"{prefix}.{key}", value


def with_settings(scene: Scene, values: Mapping[str, Any]) -> Scene:
    """``scene`` with parameters replaced by path (:func:`with_values`), ``rig.name`` before them."""
    settings = dict(values)
    name = settings.pop("rig.name", scene.rig.name)
    if name != scene.rig.name:
        scene = with_rig(scene, name if isinstance(name, str) else repr(name))
    return with_values(scene, settings)


QUANTILE = re.compile(r"p(\d{1,2}(?:\.\d+)?)")


def measured_spread(table: dict[str, Any], where: str) -> float:
    """Standard deviation over mean of the linear size; ``where`` names the table in messages."""
    refuse_unknown(table, ("mean", "sd", "quantiles"), f"{where}.")
    if ("mean" in table) != ("sd" in table):
        raise ParameterError(f"{where}: mean and sd are needed together")
    quantiles = as_table(table.get("quantiles", {}), f"{where}.quantiles")
    numbers = {
        percent: _length(value, f"{where}.quantiles.p{percent}") for percent, value in _percents(quantiles, where)
    }
    if "mean" in table:
        return _length(table["sd"], f"{where}.sd") / _length(table["mean"], f"{where}.mean")
    if len(numbers) < 2:
        raise ParameterError(f"{where}: mean and sd, or at least two quantiles (p05, p50, p95), are needed")
    return quantile_spread(numbers)


def quantile_spread(quantiles: dict[float, float]) -> float:
    """Spread of the log-normal sizes with these quantiles: percent below → diameter [m]."""
    from scipy.special import ndtri  # here: few materials have measured sizes

    deviate = ndtri(np.array(list(quantiles)) / 100.0)
    log_size = np.log(np.array(list(quantiles.values())))
    offset = deviate - deviate.mean()
    t = float(offset @ log_size / (offset @ offset))
    return math.sqrt(math.expm1(t**2))


def _percents(quantiles: dict[str, Any], where: str) -> list[tuple[float, Any]]:
    found = []
    for name, value in quantiles.items():
        match = QUANTILE.fullmatch(name)
        percent = float(match[1]) if match else 0.0
        if not 0.0 < percent < 100.0:
            raise ParameterError(f"{where}.quantiles.{name}: not a quantile; allowed: p01 … p99")
        found.append((percent, value))
    return found


def _length(value: Any, where: str) -> float:
    number = parse_quantity(value, "m", where)
    if number <= 0.0:
        raise ParameterError(f"{where}: {number:g} m; allowed: more than 0 m")
    return number


COMMON = ("name", "material", "mass_fraction", "size_distribution", "size_spread", "size", "file")

SOLID = ("shape", "spheres")

DECLARED = ("sphere_centres", "sphere_radii", "mass", "inertia", "density", "mesh", "unit", "fit")

FIT_NUMBERS = ("volume_ratio", "covered_ratio", "surface_rms", "surface_max")


def read_body(entry: Any, materials: tuple[Material, ...], path: Path) -> Body:
    """The body that a table declares; ``path`` is the file that it stands in, for files that it names."""
    entry, path = _taken_in(as_table(entry, "body"), path)
    name = str(entry.get("name", ""))
    where = f"body.{name}"
    if not name or "." in name:
        raise ParameterError(f"body.name: {name!r} must be a non-empty name without a dot")
    refuse_unknown(entry, COMMON + (DECLARED if "sphere_centres" in entry else SOLID), f"{where}.")
    names = {material.name: material for material in materials}
    material = names.get(str(entry.get("material", name)))
    if material is None:
        raise ParameterError(f"{where}.material: {entry.get('material', name)!r} is not one of {', '.join(names)}")
    fraction = parse_quantity(entry.get("mass_fraction", 1.0), "1", f"{where}.mass_fraction")
    if not 0.0 <= fraction <= 1.0:
        raise ParameterError(f"{where}.mass_fraction: {fraction:g} is outside 0 … 1")
    spheres = str(SPHERES.check(entry.get("spheres", "standard")))
    shape = _members(entry, where, path) if "sphere_centres" in entry else _solid(entry, where, path)
    body = Body(name, material.name, fraction, shape, material.density, spheres)
    return replace(body, sizes=_sizes(entry, body))


def _taken_in(entry: dict[str, Any], path: Path) -> tuple[dict[str, Any], Path]:
    """The table with those of its body file below it, and the file that paths in it are relative to."""
    if "file" not in entry:
        return entry, path
    own = path.parent / str(entry["file"])
    table = read_toml(own)
    bodies = list_at(table, "body")
    if table.get("format") != 1 or len(bodies) != 1 or "file" in as_table(bodies[0], "body"):
        raise ParameterError(f"{own}: a body file holds format = 1 and one [[body]] without `file`")
    refuse_unknown(entry, COMMON, f"body with file = {entry['file']!r}: ")
    return {**bodies[0], **{key: value for key, value in entry.items() if key != "file"}}, own


def _sizes(entry: dict[str, Any], body: Body) -> SizeDistribution:
    known, where = body_parameters(body), f"body.{body.name}"
    if "size" in entry:
        if "size_distribution" in entry or "size_spread" in entry:
            raise ParameterError(
                f"{where}.size: stands beside size_distribution or size_spread; allowed: one of the two"
            )
        spread = measured_spread(as_table(entry["size"], f"{where}.size"), f"{where}.size")
        return SizeDistribution("log_normal", float(known[f"{where}.size_spread"].check(spread)))
    kind = str(known[f"{where}.size_distribution"].check(entry.get("size_distribution", "none")))
    spread = float(known[f"{where}.size_spread"].check(entry.get("size_spread", 0.0)))
    if spread > 0.0 and "size_distribution" not in entry:
        raise ParameterError(f"{where}.size_spread: needs size_distribution beside it (uniform or log_normal)")
    return SizeDistribution(kind, spread)


def _solid(entry: dict[str, Any], where: str, path: Path) -> Solid:
    return Solid.from_toml(as_table(entry.get("shape"), f"{where}.shape"), f"{where}.shape", path.parent)


def _members(entry: dict[str, Any], where: str, path: Path) -> Members:
    centres = tuple(vector(row, f"{where}.sphere_centres") for row in list_at(entry, "sphere_centres"))
    radii = tuple(parse_quantity(r, "m", f"{where}.sphere_radii") for r in list_at(entry, "sphere_radii"))
    mass = parse_quantity(entry.get("mass", 0.0), "kg", f"{where}.mass")
    inertia = vector(entry.get("inertia", ()), f"{where}.inertia")
    density = parse_quantity(entry["density"], "kg/m3", f"{where}.density") if "density" in entry else None
    if len(radii) != len(centres) or not centres:
        raise ParameterError(f"{where}.sphere_radii: {len(radii)} radii for {len(centres)} sphere_centres")
    if min(radii) <= 0.0 or mass <= 0.0 or min(inertia) <= 0.0 or (density is not None and density <= 0.0):
        raise ParameterError(f"{where}: sphere_radii, mass, inertia and density must be positive")
    drawn = None
    if "mesh" in entry:
        table: dict[str, Any] = {key: entry[key] for key in ("mesh", "unit") if key in entry}
        drawn = Solid.from_toml(table, where, path.parent)
    return Members(centres, radii, mass, inertia, density, drawn, _fit(entry, where, radii))


def _fit(entry: dict[str, Any], where: str, radii: tuple[float, ...]) -> ClumpFit | None:
    if "fit" not in entry:
        return None
    table = as_table(entry["fit"], f"{where}.fit")
    refuse_unknown(table, (*FIT_NUMBERS, "extent_errors"), f"{where}.fit.")
    numbers = {key: parse_quantity(table.get(key, ""), "1", f"{where}.fit.{key}") for key in FIT_NUMBERS}
    errors = vector(table.get("extent_errors"), f"{where}.fit.extent_errors")
    return ClumpFit(n_spheres=len(radii), extent_errors=errors, smallest_radius=min(radii), **numbers)


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
