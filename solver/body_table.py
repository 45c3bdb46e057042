"""One ``[[body]]`` of a material file → :class:`Body`.

name, material, mass_fraction      which material (by default that of the body's name), its share of the mass
size_distribution, size_spread     how the sizes scatter (`solver.sizes`)
size                               instead of these two, measured diameters: { mean, sd } or { quantiles = { p05, … } }
                                   become log-normal sizes about the declared one (`solver.size_table`)

and one of

shape, spheres                     a solid, { ellipsoid = […] } or { mesh = "grain.stl", unit = "mm" }, and how many
                                   spheres stand for it: coarse, standard, fine or a number
sphere_centres, sphere_radii, mass, inertia
                                   the spheres themselves, SI; with density, mass and inertia follow the material's
                                   density; with mesh and unit, that surface is drawn; fit keeps how well they follow it
file                               a file with one such [[body]], as `explorer shape` writes it; keys that stand beside
                                   ``file`` replace those in it
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from solver.body import SPHERES, Body, Members, body_parameters
from solver.clump_fit import ClumpFit
from solver.material import Material
from solver.params import ParameterError, parse_quantity
from solver.shape import Solid
from solver.size_table import measured_spread
from solver.sizes import SizeDistribution
from solver.toml_table import as_table, list_at, read_toml, refuse_unknown, vector

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
