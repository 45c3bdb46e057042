"""When two pours are the same pour: the key under which a pour is kept.

A key covers what decides the bits of a pour and nothing else: the declared scene, the contents of mesh files, the seed,
and the version of the physics. Parameters at their declared default are left out, so that a new parameter whose default
changes nothing leaves every key as it was; a changed default is a change of the physics (`solver.version`). For a rig
or an effect from another package, the version of the package counts. So does the kind of processor (CPU or GPU).
Titles, docstrings, and code that cannot affect a pour have no part in it.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from solver.arch import chosen
from solver.assets import asset_path
from solver.effects.effect import Effect
from solver.plugins import origin
from solver.scenes.body import Body, Members
from solver.scenes.scene import Scene
from solver.version import PHYSICS


def pour_key(scene: Scene, seed: int, variant: str = "") -> str:
    """Return the digest of everything that decides the bits of a pour of ``scene``.

    Parameters
    ----------
    scene, seed:
        What is poured.
    variant:
        What else was done to the pour that is not in the scene, such as an effect from outside the library.

    Returns
    -------
    str
        64 hexadecimal digits (SHA-256).
    """
    return pour_keys(scene, (seed,), variant)[seed]


def pour_keys(scene: Scene, seeds: Iterable[int], variant: str = "") -> dict[int, str]:
    """Return the `pour_key` of ``scene`` with each of ``seeds``; the scene, the slow part, is described only once."""
    before, after = json.dumps(PHYSICS), f"{json.dumps(variant)}, {json.dumps(chosen())}"
    described = json.dumps(_decisive(scene), sort_keys=True)
    texts = {seed: f"[{before}, {seed}, {after}, {described}]" for seed in seeds}
    return {seed: hashlib.sha256(text.encode()).hexdigest() for seed, text in texts.items()}


def _decisive(scene: Scene) -> dict[str, Any]:
    """What decides the bits, in JSON types: floats are written with the digits that restore them exactly."""
    return {
        "rig": [scene.rig.name, scene.rig.wall, *_set(scene.rig), *_package("rig", scene.rig.name)],
        "insertion": _set(scene.insertion),
        "numerics": _set(scene.numerics),
        **({"contact": changed} if (changed := _set(scene.contact)) else {}),
        **({"law of": package} if (package := origin("contact_law", scene.contact.law)) else {}),
        "effects": [
            [effect.name, *_set(effect), *_package("effect", effect.name), *_revision(effect)]
            for effect in scene.effects
        ],
        "gravity": scene.gravity,
        "axis": scene.axis,
        "materials": [[material.name, *_set(material)] for material in scene.materials],
        "pairs": [[pair.a, pair.b, *_set(pair)] for pair in scene.pairs],
        "bodies": [_of_body(body) for body in scene.bodies],
    }


def _set(thing: Any) -> list[Any]:
    """[name, value] of every declared parameter of ``thing`` that is not at its default; a file by its contents."""
    found = []
    for field in dataclasses.fields(thing):
        declared, value = field.metadata.get("parameter"), getattr(thing, field.name)
        if declared is None:
            continue
        if declared["files"]:
            # Regardless of its place and name; a shipped file may change as well.
            found.append([field.name, _contents(asset_path("meshes", value))])
        elif value != field.default:
            found.append([field.name, value])
    return found


def _package(kind: str, name: str) -> list[str]:
    """Package and version that a plug-in comes from; nothing for what belongs to this program."""
    package = origin(kind, name)
    return [package] if package else []


def _revision(effect: Effect) -> list[int]:
    """Revision of an effect, if its pours differ from those of its first revision."""
    return [effect.revision] if effect.on and effect.revision > 1 else []


def _of_body(body: Body) -> list[Any]:
    shape = body.shape
    if isinstance(shape, Members):
        # The surface that is only drawn, and how well the spheres follow it, decide nothing.
        described: list[Any] = ["spheres", shape.centres, shape.radii, shape.mass, shape.inertia, shape.density]
    else:
        contents = _contents(Path(shape.file)) if shape.file else ""
        described = [shape.kind, shape.dimensions, contents, shape.unit, body.spheres]
    sizes = [body.sizes.kind, body.sizes.spread]
    return [body.name, body.material, body.mass_fraction, body.density, sizes, described]


def _contents(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()
