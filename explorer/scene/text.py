"""A scene as the text of a material file that `solver.scenes.material_file` reads back as the same scene.

Everything is written out in SI: materials, bodies, pairs, rig, insertion, numerics and the effects that are on. Numbers
keep all their digits; meshes are named by their full path.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from solver import Scene, parameters, value
from solver.scenes.body import Body, Members
from solver.shapes.solid import Solid

SET_UP = ("rig", "insertion", "numerics")


def material_toml(scene: Scene, heading: str = "") -> str:
    """The file; ``heading`` becomes comment lines at its top."""
    parts = ["".join(f"# {line}".rstrip() + "\n" for line in heading.splitlines()), _head(scene)]
    parts += [_table(f"materials.{toml_key(m.name)}", _fields(m, ("density", "shear_modulus", "poisson_ratio")))
              for m in scene.materials]  # fmt: skip
    parts += ["[[body]]\n" + _lines(dict(_body(body))) for body in scene.bodies]
    parts += [_table(f"pair.{toml_key(p.a)}.{toml_key(p.b)}", _fields(p, ("static_friction", "restitution")))
              for p in scene.pairs]  # fmt: skip
    parts += [_table(kind, _set_up(scene, kind)) for kind in SET_UP]
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


def _of_effect(scene: Scene, name: str) -> dict[str, Any]:
    prefix = f"effect.{name}."
    return {path.removeprefix(prefix): value(scene, path) for path in parameters(scene) if path.startswith(prefix)}


def _fields(thing: Any, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: getattr(thing, name) for name in names}


def _table(name: str, entries: Mapping[str, Any]) -> str:
    return f"[{name}]\n{_lines(entries)}" if entries else ""


def _lines(entries: Mapping[str, Any]) -> str:
    return "".join(f"{toml_key(key)} = {toml_value(entry)}\n" for key, entry in entries.items())


def toml_key(name: str) -> str:
    """``name`` as a key, quoted where it has to be."""
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else json.dumps(name)


def toml_value(entry: Any) -> str:
    """A value of a plain type; every float in the digits that give it back."""
    if isinstance(entry, Mapping):
        return "{ " + ", ".join(f"{toml_key(key)} = {toml_value(item)}" for key, item in entry.items()) + " }"
    if isinstance(entry, list | tuple):
        return "[" + ", ".join(toml_value(item) for item in entry) + "]"
    if isinstance(entry, str):
        return json.dumps(entry, ensure_ascii=False)
    if isinstance(entry, bool):
        return "true" if entry else "false"
    if isinstance(entry, int):
        return str(entry)
    return repr(float(entry))
