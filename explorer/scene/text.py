"""A scene as the text of a material file, and a body as the text of a body file: both read back unchanged.

A material file (`solver.scenes.material_file`) has everything in SI: materials, bodies, pairs, rig, insertion,
numerics, contact-law settings that are not the default, and the effects that are on. Numbers keep all their digits;
meshes are named by their full path. A body file, which `explorer shape` writes and a material file can include,
declares one body by its spheres.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from datetime import date, time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from solver import Scene, parameters, value
from solver.scenes.body import Body, Members
from solver.scenes.contact_model import ContactModel
from solver.shapes.clump_error import measured_fit
from solver.shapes.solid import Solid, mass_properties

Array = npt.NDArray[np.float64]

SET_UP = ("rig", "insertion", "numerics")
DIGITS = 9
"""Significant digits: a nanometre on a metre."""


def material_toml(scene: Scene, heading: str = "") -> str:
    """The file; ``heading`` becomes comment lines at its top."""
    parts = ["".join(f"# {line}".rstrip() + "\n" for line in heading.splitlines()), _head(scene)]
    parts += [_table(f"materials.{toml_key(m.name)}", _fields(m, ("density", "shear_modulus", "poisson_ratio")))
              for m in scene.materials]  # fmt: skip
    parts += ["[[body]]\n" + _lines(dict(_body(body))) for body in scene.bodies]
    parts += [_table(f"pair.{toml_key(p.a)}.{toml_key(p.b)}", _fields(p, ("static_friction", "restitution")))
              for p in scene.pairs]  # fmt: skip
    parts += [_table(kind, _set_up(scene, kind)) for kind in SET_UP]
    parts.append(_table("contact", _contact(scene)))
    parts += [_table(f"effect.{effect.name}", _of_effect(scene, effect.name)) for effect in scene.effects]
    return "\n".join(part for part in parts if part)


def _head(scene: Scene) -> str:
    return _lines(
        {
            "format": 1,
            "title": scene.title,
            "gravity": list(scene.gravity),
            "wall": scene.rig.wall,
            "assumed": list(scene.assumed),
        }
    )


def _body(body: Body) -> Iterator[tuple[str, Any]]:
    yield from _fields(body, ("name", "material", "mass_fraction")).items()
    yield "size_distribution", body.sizes.kind
    yield "size_spread", body.sizes.spread
    if isinstance(body.shape, Members):
        yield from _members(body.shape)
    else:
        yield "spheres", body.spheres
        yield "shape", _solid(body.shape)


def _members(shape: Members) -> Iterator[tuple[str, Any]]:
    yield from _fields(shape, ("mass", "inertia")).items()
    if shape.density is not None:
        yield "density", shape.density
    yield "sphere_centres", [list(centre) for centre in shape.centres]
    yield "sphere_radii", list(shape.radii)
    if shape.drawn is not None:
        yield from _solid(shape.drawn).items()
    if shape.fit is not None:
        yield (
            "fit",
            _fields(shape.fit, ("volume_ratio", "covered_ratio", "surface_rms", "surface_max", "extent_errors")),
        )


def _solid(solid: Solid) -> dict[str, Any]:
    table = solid.to_toml()
    return table | {"mesh": str(Path(table["mesh"]).absolute())} if "mesh" in table else table


def _set_up(scene: Scene, kind: str) -> dict[str, Any]:
    known = (path for path in parameters(scene) if path.split(".")[0] == kind)
    table = {path.removeprefix(f"{kind}."): value(scene, path) for path in known}
    return {"name": scene.rig.name} | table if kind == "rig" else table


def _contact(scene: Scene) -> dict[str, Any]:
    """The contact settings that differ from those of a file that states none."""
    usual = ContactModel()
    return {key: entry for key, entry in _set_up(scene, "contact").items() if entry != getattr(usual, key)}


def _of_effect(scene: Scene, name: str) -> dict[str, Any]:
    prefix = f"effect.{name}."
    return {path.removeprefix(prefix): value(scene, path) for path in parameters(scene) if path.startswith(prefix)}


def _fields(thing: Any, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: getattr(thing, name) for name in names}


def _table(name: str, entries: Mapping[str, Any]) -> str:
    return f"[{name}]\n{_lines(entries)}" if entries else ""


def _lines(entries: Mapping[str, Any]) -> str:
    return "".join(f"{toml_key(key)} = {toml_value(entry)}\n" for key, entry in entries.items())


def body_text(
    name: str,
    file: str,
    solid: Solid,
    centres: Array,
    radii: Array,
    density: float,
    drawn: Path | None,
) -> str:
    """Text of a body file.

    Args:
        name: name of the body.
        file: name of the body file.
        solid: the mesh that the spheres represent.
        centres: (n, 3) in its principal frame [m].
        radii: (n,) [m].
        density: density [kg/m3] for the mass that is written.
        drawn: path of the mesh as seen from the body file; None to draw the spheres instead.
    """
    true, fit = mass_properties(solid, density), measured_fit(solid, centres, radii)
    size = " × ".join(f"{1e3 * extent:.4g}" for extent in true.extents)
    mesh = ""
    if drawn is not None:
        mesh = f"mesh = {toml_value(drawn.as_posix())}   # drawn instead of the spheres\n"
        mesh += f"unit = {toml_value(solid.unit)}\n"
    rows = ",\n".join(f"    [{_numbers(centre)}]" for centre in centres)
    numbers = {
        "volume_ratio": fit.volume_ratio,
        "covered_ratio": fit.covered_ratio,
        "surface_rms": fit.surface_rms,
        "surface_max": fit.surface_max,
    }
    stated = ", ".join(f"{key} = {number:.4g}" for key, number in numbers.items())
    errors = ", ".join(f"{error:.4g}" for error in fit.extent_errors)
    return f"""\
# Body {name}: {len(radii)} spheres for {Path(solid.file).name} ({size} mm). SI.
# In a material file: [[body]] with file = "{file}", material and mass_fraction; or copy the table below.
# Frame: centre of mass and principal axes of the mesh. Mass and inertia are those of the mesh, not of the spheres, and
# follow the density of the material that the body is made of.

format = 1

[[body]]
name = {toml_value(name)}
density = {density:.{DIGITS}g}   # [kg/m3], at which mass and inertia hold
mass = {true.mass:.{DIGITS}g}   # [kg]
inertia = [{_numbers(true.inertia)}]   # principal moments [kg m2]
{mesh}fit = {{ {stated}, extent_errors = [{errors}] }}
sphere_centres = [   # [m]
{rows},
]
sphere_radii = [{_numbers(radii)}]   # [m]
"""


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.{DIGITS}g}" for value in values)


def toml_key(name: str) -> str:
    """``name`` as a key, quoted if necessary."""
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else toml_value(name)


def toml_value(entry: Any) -> str:
    """A value of a plain type; every float with the digits that reproduce it exactly."""
    if isinstance(entry, Mapping):
        return "{ " + ", ".join(f"{toml_key(key)} = {toml_value(item)}" for key, item in entry.items()) + " }"
    if isinstance(entry, list | tuple):
        return "[" + ", ".join(toml_value(item) for item in entry) + "]"
    if isinstance(entry, str):
        # JSON escapes a character beyond U+FFFF as two halves, which TOML refuses, and leaves U+007F as it is.
        return json.dumps(entry, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(entry, bool):
        return "true" if entry else "false"
    if isinstance(entry, int):
        return str(entry)
    if isinstance(entry, date | time):
        return entry.isoformat()
    return repr(float(entry))
