"""Material files: TOML → :class:`Scene`, and set-up tables in other files that override those of a material.

:class:`MaterialFile` and :class:`BodyTable` define which keys are allowed. Keys of a set-up table are the last parts of
parameter paths (``outlet_height`` in ``[rig]`` is ``rig.outlet_height``); ``name`` in ``[rig]`` chooses the rig.

Measured diameters of a component give the spread of its log-normal sizes about the declared one:

size = { mean = 1.212e-3, sd = 0.139e-3 }                              spread = sd / mean
size = { quantiles = { p05 = 1.105e-3, p50 = 1.204e-3, p95 = … } }     spread = √(exp t² − 1)

t is the slope of ln(quantile) over the quantile's normal deviate, by least squares: exact for log-normal sizes. If
both are given, mean and sd are used. Only the *relative* spread is used.
Source: moments and quantiles of the log-normal distribution, Johnson, Kotz & Balakrishnan 1994, ch. 14.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from solver.assets import asset_path, own_path
from solver.effects import EFFECTS
from solver.laws import CONTACT_LAWS, HertzMindlin
from solver.params import ParameterError, declared, parse_quantity
from solver.rigs import RIGS, Funnel
from solver.scenes.body import SPHERES, TOTAL_TOLERANCE, Body, Members, body_parameters
from solver.scenes.contact_model import ContactModel
from solver.scenes.insertion import Insertion
from solver.scenes.material import Material, Pair
from solver.scenes.numerics import Numerics
from solver.scenes.scene import Scene, canonical, with_rig, with_values
from solver.scenes.sizes import SizeDistribution
from solver.shapes.clump_error import ClumpFit
from solver.shapes.solid import ShapeError, Solid
from solver.toml_file import (
    Like,
    Names,
    Number,
    Quantity,
    Rows,
    Scalar,
    Shaped,
    TomlTable,
    Vector,
    checked,
    naming_file,
    one_of,
    parameters_schema,
    read_toml,
)  # fmt: skip

SET_UP = ("rig", "insertion", "numerics", "contact", "effect")
"""Tables that may override those of a material in any file."""
MESH = "rig.mesh"
"""Path of the parameter that names a file."""
LEAST_EXTENT, LARGEST_EXTENT = 1e-6, 100.0
"""Limits of the longest outer dimension of a body [m]."""
LIGHTEST, HEAVIEST = 1e-2, 1e5
"""Limits of the mass of a body declared by its spheres, over the volume of the ball around them [kg/m3]. The spheres
may fill only a hundredth of the ball, and be only a third of the true shape."""
SMALLEST_MOMENT, LARGEST_MOMENT = 1e-9, 100.0
"""Limits of the moments over mass times the ball's radius squared: a hair, and a needle represented by one sphere."""
QUANTILE = re.compile(r"p(\d{1,2}(?:\.\d+)?)")
SPHERES_BY_HAND = ("sphere_centres", "sphere_radii", "mass", "inertia", "density", "mesh", "unit", "fit")
ELASTIC = ("youngs_modulus", "shear_modulus", "poisson_ratio")


def _rig_schema() -> dict[str, Any]:
    schema = parameters_schema(*RIGS.values())
    schema["properties"]["name"] = {"enum": list(RIGS), "description": "which rig"}
    return schema


def _effects_schema() -> dict[str, Any]:
    return {"type": "object", "properties": {name: parameters_schema(kind) for name, kind in EFFECTS.items()}}


def _material_schema() -> dict[str, Any]:
    schema = parameters_schema(Material)
    young = {"type": ["number", "string"], "description": "Young's modulus [Pa], instead of one of the other two"}
    schema["properties"]["youngs_modulus"] = young
    return schema


Settings = dict[str, Any]
RigTable = Annotated[Settings, Shaped(_rig_schema)]
InsertionTable = Annotated[Settings, Shaped(lambda: parameters_schema(Insertion))]
NumericsTable = Annotated[Settings, Shaped(lambda: parameters_schema(Numerics))]
ContactTable = Annotated[Settings, Shaped(lambda: parameters_schema(ContactModel))]
EffectTables = Annotated[Settings, Shaped(_effects_schema)]


class SizeTable(TomlTable):
    """Measured diameters: mean and sd, or at least two quantiles."""

    mean: Annotated[float, Quantity("m", above=0.0)] | None = None
    sd: Annotated[float, Quantity("m", above=0.0)] | None = None
    quantiles: dict[str, Annotated[float, Quantity("m", above=0.0)]] = Field(default_factory=dict)
    """p05, p50, p95 …: diameter below which that percentage lies."""


class FitTable(TomlTable):
    """How well the member spheres follow the surface, as ``explorer shape`` found."""

    volume_ratio: Annotated[float, Number()]
    covered_ratio: Annotated[float, Number()]
    surface_rms: Annotated[float, Number()]
    surface_max: Annotated[float, Number()]
    extent_errors: Annotated[tuple[float, float, float], Vector(3)]


class BodyTable(TomlTable):
    """One ``[[body]]``: a component of the mixture, by its solid, by its member spheres, or by a file of its own."""

    name: str = ""
    material: str | None = None
    """By default the material of the body's name."""
    mass_fraction: Annotated[float, Quantity("1")] = 1.0
    """Share of the mass, 0 … 1."""
    size_distribution: Annotated[str, Scalar()] = "none"
    """How the sizes scatter: none, uniform or log_normal."""
    size_spread: Annotated[float | str, Scalar()] = 0.0
    size: SizeTable | None = None
    """Measured diameters, instead of distribution and spread."""
    file: str | None = None
    """A file with one such [[body]], as ``explorer shape`` writes it; keys given beside it take precedence."""
    shape: Settings | None = None
    """The solid: { ellipsoid = […] }, cylinder, box, sphere, or { mesh = "grain.stl", unit = "mm" }."""
    spheres: Annotated[int | str, Scalar()] = "standard"
    """How many spheres stand for the solid: coarse, standard, fine or a number."""
    sphere_centres: Annotated[tuple[tuple[float, float, float], ...], Rows(3, "m")] = ()
    sphere_radii: Annotated[tuple[float, ...], Vector(unit="m", above=0.0)] = ()
    mass: Annotated[float, Quantity("kg", above=0.0)] | None = None
    """Mass of a body declared by its spheres [kg]."""
    inertia: Annotated[tuple[float, float, float], Vector(3, above=0.0)] | None = None
    """Principal moments [kg m²]."""
    density: Annotated[float, Quantity("kg/m3", above=0.0)] | None = None
    """With it, mass and inertia follow the material's density."""
    mesh: str | None = None
    """Surface drawn for a body declared by its spheres."""
    unit: str | None = None
    """Unit of the mesh's coordinates."""
    fit: FitTable | None = None


class BodyFile(TomlTable):
    """A file with one body."""

    format: Literal[1]
    body: list[Annotated[Settings, Like(BodyTable)]]


class MaterialFile(TomlTable):
    """A material file: what is poured, and into what."""

    format: Literal[1]
    title: str | None = None
    name: str | None = None
    materials: dict[str, Annotated[Settings, Shaped(_material_schema)]]
    """Name → density, and two of youngs_modulus, shear_modulus, poisson_ratio."""
    body: list[Annotated[Settings, Like(BodyTable)]]
    pair: dict[str, dict[str, Annotated[Settings, Shaped(lambda: parameters_schema(Pair))]]]
    """For every two materials that can touch: static_friction, restitution."""
    wall: str | None = None
    """Material of funnel and plate; by default the one that no body is made of."""
    gravity: Annotated[tuple[float, float, float], Vector(3, "m/s2")] = (0.0, 0.0, -9.81)
    contact_law: str | None = None
    """The same as law in [contact]."""
    assumed: Annotated[tuple[str, ...], Names()] = ()
    """What was not measured: ``materials.seed.density``, ``pair.seed.steel.restitution``, ``body.seed.shape``."""
    measured: Settings = Field(default_factory=dict)
    """Where measured values come from, as ``explorer lab`` writes it."""
    rig: RigTable = Field(default_factory=dict)
    insertion: InsertionTable = Field(default_factory=dict)
    numerics: NumericsTable = Field(default_factory=dict)
    contact: ContactTable = Field(default_factory=dict)
    effect: EffectTables = Field(default_factory=dict)


def load_material(name: str, relative_to: Path | None = None) -> Scene:
    """Scene from a shipped material's name or a material file's path, in the funnel unless the file names a rig."""
    path = asset_path("materials", name, relative_to=relative_to)
    with naming_file(path, ParameterError, ShapeError):
        return scene_from(read_toml(path), path)


FILE_KEYS = ("file", "mesh")
"""Keys of a material file that name another file."""


def files_named_in(table: Mapping[str, Any]) -> Iterator[object]:
    """The files that a parsed material file names, whether or not it is well-formed."""
    bodies = table.get("body")
    tables = [table.get("rig"), *(bodies if isinstance(bodies, list) else [bodies])]
    for one in [entry for entry in tables if isinstance(entry, dict)]:
        shape = one.get("shape")
        both = [inner for inner in (one, shape) if isinstance(inner, dict)]
        yield from (inner[key] for inner in both for key in FILE_KEYS if key in inner)


def is_material(table: dict[str, Any]) -> bool:
    """Whether a parsed TOML file is a material: only those have materials or bodies."""
    return "materials" in table or "body" in table


def scene_from(table: dict[str, Any], path: Path) -> Scene:
    """Scene from a parsed material file; its rig is the default funnel unless it has a table ``[rig]``."""
    file = checked(MaterialFile, table)
    law = one_of(file.contact_law or HertzMindlin.name, "contact_law", CONTACT_LAWS)
    materials = tuple(_material(name, entry) for name, entry in file.materials.items())
    bodies = tuple(_body(entry, materials, path) for entry in file.body)
    if not bodies:
        raise ParameterError("body: at least one [[body]] is needed")
    total = sum(body.mass_fraction for body in bodies)
    if not math.isclose(total, 1.0, abs_tol=TOTAL_TOLERANCE):
        raise ParameterError(f"body.*.mass_fraction: add up to {total:g}, not to 1")
    if len({body.name for body in bodies}) < len(bodies):
        raise ParameterError("body.name: two bodies share a name")
    pairs = tuple(_pairs(file.pair))
    touching = [*(one.name for one in materials), *(one.name for one in bodies)]
    for pair in pairs:
        for name in (pair.a, pair.b):
            if name not in touching:
                known = ", ".join(dict.fromkeys(touching))
                raise ParameterError(f"pair.{pair.a}.{pair.b}: no material or body {name!r}; known: {known}")
    scene = Scene(
        title=file.title or file.name or path.stem,
        materials=materials,
        bodies=bodies,
        pairs=pairs,
        rig=Funnel(wall=_wall(file.wall, materials, bodies)),
        contact=ContactModel(law=law),
        gravity=file.gravity,
        assumed=file.assumed,
    )
    scene = with_set_up(scene, table, path.parent)
    if file.contact_law and scene.contact.law != law:
        raise ParameterError(f"contact_law: {law!r} is not the {scene.contact.law!r} of contact.law")
    return replace(scene, assumed=tuple(_assumed(scene, name) for name in file.assumed))


def _assumed(scene: Scene, name: str) -> str:
    """``name`` as reports look it up: a parameter may be named by its path (``material.…``, a pair in either order) or
    as the file writes it (``materials.…``)."""
    path = name.replace("materials.", "material.", 1)
    try:
        found = canonical(scene, path)
    except ParameterError:  # Young's modulus, a shape: no parameters
        found = path
    return found.replace("material.", "materials.", 1) if found.startswith("material.") else found


def with_set_up(scene: Scene, table: Mapping[str, Any], folder: Path | None = None) -> Scene:
    """``scene`` with the set-up tables in ``table``, a parsed file whose other keys are ignored here.

    A relative path in it, such as the mesh of a rig, is relative to ``folder``; None: to the working directory.
    """
    values: dict[str, Any] = {}
    for kind in SET_UP:
        entries = table.get(kind, {})
        if not isinstance(entries, dict):
            raise ParameterError(f"{kind}: a table is needed, not {entries!r}")
        values |= dict(_by_path(kind, entries))
    if folder is not None and (own := folder / own_path(str(values.get(MESH, "")))).is_file():
        values[MESH] = str(own)
    return with_settings(scene, values)


def _by_path(prefix: str, entries: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in entries.items():
        if isinstance(value, dict):
            yield from _by_path(f"{prefix}.{key}", value)
        else:
            yield f"{prefix}.{key}", value


def with_settings(scene: Scene, values: Mapping[str, Any]) -> Scene:
    """``scene`` with parameters replaced by path (:func:`with_values`), ``rig.name`` first."""
    settings = dict(values)
    name = settings.pop("rig.name", scene.rig.name)
    if name != scene.rig.name:
        scene = with_rig(scene, name if isinstance(name, str) else repr(name))
    return with_values(scene, settings)


def _material(name: str, entry: Settings) -> Material:
    where = f"materials.{name}"
    if not name or "." in name:
        raise ParameterError(f"materials: {name!r} must be a non-empty name without a dot")
    known = declared(Material, where)
    values: dict[str, float] = {}
    for key, raw in entry.items():
        if key == "youngs_modulus":
            values[key] = parse_quantity(raw, "Pa", f"{where}.{key}")
        elif f"{where}.{key}" in known:
            values[key] = float(known[f"{where}.{key}"].check(raw))
        else:
            raise ParameterError(
                f"{where}.{key}: unknown key; allowed: density, youngs_modulus, shear_modulus, poisson_ratio"
            )
    elastic = [key for key in ELASTIC if key in values]
    if len(elastic) != 2:
        raise ParameterError(f"{where}: needs exactly two of {', '.join(ELASTIC)}; has {', '.join(elastic) or 'none'}")
    young = values.pop("youngs_modulus", None)
    if young is not None and "shear_modulus" in values:
        ratio = young / (2.0 * values["shear_modulus"]) - 1.0
        values["poisson_ratio"] = float(known[f"{where}.poisson_ratio"].check(ratio))
    elif young is not None:
        shear = young / (2.0 * (1.0 + values["poisson_ratio"]))
        values["shear_modulus"] = float(known[f"{where}.shear_modulus"].check(shear))
    return Material(name=name, **values)


def _pairs(table: dict[str, dict[str, Settings]]) -> list[Pair]:
    pairs: list[Pair] = []
    for a, partners in table.items():
        for b, entry in partners.items():
            where = f"pair.{a}.{b}"
            known = declared(Pair, where)
            values = {}
            for key, raw in entry.items():
                if f"{where}.{key}" not in known:
                    raise ParameterError(f"{where}.{key}: unknown key; allowed: static_friction, restitution")
                values[key] = float(known[f"{where}.{key}"].check(raw))
            missing = {"static_friction", "restitution"} - set(values)
            if missing:
                raise ParameterError(f"{where}: {sorted(missing)[0]} is missing")
            if any(pair.joins(a, b) for pair in pairs):
                raise ParameterError(f"{where}: this pair appears twice")
            pairs.append(Pair(a, b, **values))
    return pairs


def _wall(given: str | None, materials: tuple[Material, ...], bodies: tuple[Body, ...]) -> str:
    """Material of funnel and plate: ``wall``, or the one material that no body is made of."""
    names = [material.name for material in materials]
    free = [name for name in names if name not in {body.material for body in bodies}]
    wall = given if given is not None or len(free) != 1 else free[0]
    if wall not in names:
        found = "missing" if wall is None else f"{wall!r} is not a material"
        raise ParameterError(f"wall: {found}; allowed for funnel and plate: {', '.join(names)}")
    return str(wall)


def _body(entry: Settings, materials: tuple[Material, ...], path: Path) -> Body:
    """The body that a table declares; ``path`` is the file that it stands in, for files that it names."""
    entry, path = _taken_in(entry, path)
    where = f"body.{entry.get('name', '')}"
    table = checked(BodyTable, entry, where)
    if not table.name or "." in table.name:
        raise ParameterError(f"body.name: {table.name!r} must be a non-empty name without a dot")
    by_spheres = bool(table.sphere_centres)
    foreign = table.model_fields_set & set(("shape", "spheres") if by_spheres else SPHERES_BY_HAND)
    if foreign:
        kind = "by its spheres" if by_spheres else "by its solid"
        raise ParameterError(f"{where}.{min(foreign)}: not allowed for a body declared {kind}")
    names = {material.name: material for material in materials}
    material = names[one_of(table.material or table.name, f"{where}.material", names)]
    if not 0.0 <= table.mass_fraction <= 1.0:
        raise ParameterError(f"{where}.mass_fraction: {table.mass_fraction:g} is outside 0 … 1")
    spheres = str(SPHERES.check(table.spheres))
    shape = _members(table, where, path) if by_spheres else _solid(table, where, path)
    body = Body(table.name, material.name, table.mass_fraction, shape, material.density, spheres)
    if not LEAST_EXTENT <= (longest := max(body.extents)) <= LARGEST_EXTENT:
        raise ParameterError(f"{where}: {longest:g} m long; allowed: {LEAST_EXTENT:g} … {LARGEST_EXTENT:g} m")
    if isinstance(shape, Members) and shape.fit is None:
        _check_members(body, shape, where)
    return replace(body, sizes=_sizes(table, body))


def _taken_in(entry: Settings, path: Path) -> tuple[Settings, Path]:
    """The table, completed by that of its body file, and the file that its paths are relative to."""
    if "file" not in entry:
        return entry, path
    own = path.parent / str(entry["file"])
    file = checked(BodyFile, read_toml(own), f"{own}: ")
    if len(file.body) != 1 or "file" in file.body[0]:
        raise ParameterError(f"{own}: a body file holds format = 1 and one [[body]] without `file`")
    for key in entry:
        if key in (*SPHERES_BY_HAND, "shape", "spheres"):
            raise ParameterError(f"body with file = {entry['file']!r}: {key}: not allowed together with file")
    return {**file.body[0], **{key: value for key, value in entry.items() if key != "file"}}, own


def _sizes(table: BodyTable, body: Body) -> SizeDistribution:
    known, where = body_parameters(body), f"body.{body.name}"
    given = table.model_fields_set
    if table.size is not None:
        if given & {"size_distribution", "size_spread"}:
            raise ParameterError(
                f"{where}.size: given together with size_distribution or size_spread; allowed: one or the other"
            )
        spread = measured_spread(table.size, f"{where}.size")
        return SizeDistribution("log_normal", float(known[f"{where}.size_spread"].check(spread)))
    kind = str(known[f"{where}.size_distribution"].check(table.size_distribution))
    spread = float(known[f"{where}.size_spread"].check(table.size_spread))
    if spread > 0.0 and "size_distribution" not in given:
        raise ParameterError(f"{where}.size_spread: needs size_distribution (uniform or log_normal) as well")
    return SizeDistribution(kind, spread)


def _solid(table: BodyTable, where: str, path: Path) -> Solid:
    if table.shape is None:
        raise ParameterError(
            f"{where}.shape: missing; allowed: a solid, or sphere_centres, sphere_radii, mass and inertia"
        )
    return Solid.from_toml(table.shape, f"{where}.shape", path.parent)


def _members(table: BodyTable, where: str, path: Path) -> Members:
    if len(table.sphere_radii) != len(table.sphere_centres):
        raise ParameterError(
            f"{where}.sphere_radii: {len(table.sphere_radii)} radii for {len(table.sphere_centres)} sphere_centres"
        )
    if min(table.sphere_radii) < LEAST_EXTENT / 2.0:
        raise ParameterError(
            f"{where}.sphere_radii: {min(table.sphere_radii):g} m; allowed: from {LEAST_EXTENT / 2.0:g} m"
        )
    if table.mass is None or table.inertia is None:
        raise ParameterError(f"{where}.{'mass' if table.mass is None else 'inertia'}: missing")
    drawn = None
    if table.mesh is not None:
        surface = {"mesh": table.mesh} | ({} if table.unit is None else {"unit": table.unit})
        drawn = Solid.from_toml(surface, where, path.parent)
    fit = None
    if table.fit is not None:
        numbers = table.fit.model_dump()
        fit = ClumpFit(n_spheres=len(table.sphere_radii), smallest_radius=min(table.sphere_radii), **numbers)
    return Members(table.sphere_centres, table.sphere_radii, table.mass, table.inertia, table.density, drawn, fit)


def _check_members(body: Body, shape: Members, where: str) -> None:
    """Refuse mass and moments that no body of these spheres can have: they must be in another unit."""
    radius = math.hypot(*body.extents) / 2.0
    volume, moment = 4.0 / 3.0 * math.pi * radius**3, body.mass * radius**2
    if not LIGHTEST * volume <= body.mass <= HEAVIEST * volume:
        raise ParameterError(
            f"{where}.mass: {body.mass:g} kg for spheres within a diameter of {2.0 * radius:.3g} m; "
            f"allowed: {LIGHTEST * volume:.3g} … {HEAVIEST * volume:.3g} kg"
        )
    inertia = body.clump.inertia
    if not SMALLEST_MOMENT * moment <= inertia.min() <= inertia.max() <= LARGEST_MOMENT * moment:
        raise ParameterError(
            f"{where}.inertia: {list(shape.inertia)} kg m2 for {body.mass:g} kg within a diameter of "
            f"{2.0 * radius:.3g} m; allowed: {SMALLEST_MOMENT * moment:.3g} … {LARGEST_MOMENT * moment:.3g} kg m2"
        )


def measured_spread(table: SizeTable, where: str) -> float:
    """Standard deviation over mean of the linear size; ``where`` names the table in messages."""
    if (table.mean is None) != (table.sd is None):
        raise ParameterError(f"{where}: mean and sd are needed together")
    percents = {_percent(name, where): diameter for name, diameter in table.quantiles.items()}
    rising = [percents[percent] for percent in sorted(percents)]
    if any(low >= high for low, high in pairwise(rising)):
        raise ParameterError(f"{where}.quantiles: {rising} m; allowed: larger diameters for larger percentages")
    if table.mean is not None and table.sd is not None:
        return table.sd / table.mean
    if len(percents) < 2:
        raise ParameterError(f"{where}: mean and sd, or at least two quantiles (p05, p50, p95), are needed")
    return quantile_spread(percents)


def _percent(name: str, where: str) -> float:
    match = QUANTILE.fullmatch(name)
    percent = float(match[1]) if match else 0.0
    if not 0.0 < percent < 100.0:
        raise ParameterError(
            f"{where}.quantiles.{name}: not a quantile; allowed: p and a percentage above 0 and below 100, as in p05"
        )
    return percent


def quantile_spread(quantiles: dict[float, float]) -> float:
    """Spread of the log-normal sizes with these quantiles: percent below → diameter [m]."""
    from scipy.special import ndtri  # here: few materials have measured sizes

    deviate = ndtri(np.array(list(quantiles)) / 100.0)
    log_size = np.log(np.array(list(quantiles.values())))
    offset = deviate - deviate.mean()
    t = float(offset @ log_size / (offset @ offset))
    return math.sqrt(math.expm1(t**2))
