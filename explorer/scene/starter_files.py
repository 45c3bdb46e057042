"""Files from which users start a material or a study of their own. They run as they are.

The texts are templates beside this file; a study's factors are read off the material that it calibrates.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path

from explorer.errors import CommandError
from explorer.scene.file import load_scene, material_scene
from explorer.scene.text import toml_value
from solver import Parameter, Scene, is_material, observable_names, parameters, read_toml, value
from solver.assets import own_path, shipped_assets
from solver.rigs import RIGS
from solver.rigs.funnel import Funnel
from solver.scenes.material_file import scene_from

TEMPLATES = Path(__file__).parents[1] / "templates"
NAME = re.compile(r"[A-Za-z0-9_-]+")
STUDY_ENDING = "_study"
SPAN = 0.2
"""Half the width of a factor's range, as a fraction of its reference."""
MOST_FACTORS = 8
MEANS = {"funnel": 17.0}
"""Rig → mean of the example target [°], which the starter material reaches there; 25° elsewhere."""
UNWRITTEN: dict[str, tuple[str, float, float, float]] = {
    "rig.outlet_height": ("outlet_height", 0.85, 1.15, 1.25),
    "rig.lift_speed": ("lift_speed", 0.5, 2.0, 3.0),
    "rig.slot_width": ("slot_width", 0.9, 1.1, 1.2),
    "rig.speed_rpm": ("speed_rpm", 0.8, 1.2, 1.5),
    "rig.filled_volume": ("filled_volume", 0.9, 1.1, 1.2),
    "insertion.rate": ("feed_rate", 0.5, 2.0, 3.0),
    "insertion.drop_speed": ("drop_speed", 0.5, 2.0, 3.0),
}
"""What nobody writes down about a set-up: path → name; low, high and a declared change, as multiples of the value."""
MOST_UNWRITTEN = 3


def write_material(folder: Path, name: str) -> Path:
    """Write ``NAME.toml`` into ``folder``; :class:`CommandError` if it exists or the name is not allowed."""
    path = folder / f"{check_name(name)}.toml"
    return write_new(path, material_text(path))


def new_path(folder: Path, name: str) -> Path:
    """Path of a new material ``NAME.toml``; :class:`CommandError` if it exists or the name is not allowed."""
    path = folder / f"{check_name(name)}.toml"
    if path.exists():
        raise CommandError(f"{path}: exists already; choose another name")
    return path


def write_study(folder: Path, name: str, material: str | None) -> list[Path]:
    """Write ``NAME_study.toml`` into ``folder``, and first the material if that is missing.

    ``name`` may be the name of the study's file: a trailing ``_study`` is dropped. ``material`` is the path or shipped
    name of the material to calibrate; None means ``NAME.toml`` in ``folder``.
    """
    name = name.removesuffix(STUDY_ENDING) or name
    study = folder / f"{check_name(name)}{STUDY_ENDING}.toml"
    if study.exists():
        raise CommandError(f"{study}: exists already; choose another name")
    if material is not None:
        named = material if _is_shipped(material) else str(own_path(material).absolute())
        return [write_new(study, study_text(study, named, study_scene(material)))]
    own = folder / f"{name}.toml"
    if own.exists() and not is_material(read_toml(own)):
        raise CommandError(f"{own} exists and is not a material; choose another name, or name one with --material")
    written = [] if own.exists() else [write_material(folder, name)]
    return [*written, write_new(study, study_text(study, own.name, study_scene(str(own))))]


def material_text(path: Path) -> str:
    """The commented material file."""
    return _filled("material.toml", NAME=path.stem, FILE=path.name)


def starter_scene(path: Path) -> Scene:
    """The scene of the material file that :func:`write_material` would write as ``path``."""
    return scene_from(tomllib.loads(material_text(path)), path)


def study_scene(material: str) -> Scene:
    """The scene of a new study of ``material``: in its own rig if that pours, otherwise through the funnel."""
    own = material_scene(material)
    return own if own.rig.name in RIGS else load_scene("funnel", material)


def study_text(path: Path, material: str, scene: Scene) -> str:
    """The commented study of ``scene``, whose file or shipped name is ``material``."""
    paths = factor_paths(scene)
    declared = parameters(scene)
    factors = "".join(
        _factor_text(f"X{k}", float(value(scene, entry)), declared[entry]) for k, entry in enumerate(paths, start=1)
    )
    return _filled(
        "study.toml",
        NAME=path.stem,
        FILE=path.name,
        MATERIAL=material,
        NAMED=toml_value(material),
        FACTORS=factors,
        SET_UP=_set_up_text(scene),
        OBSERVABLE=observable_names(scene)[0],
        MEAN=f"{MEANS.get(scene.rig.name, 25.0):.1f}",
        **_unwritten_texts(scene),
    )


def _set_up_text(scene: Scene) -> str:
    """The tables of the set-up: the funnel with all its numbers; any other rig is that of the material file."""
    template = "study_in_funnel.toml" if isinstance(scene.rig, Funnel) else "study_in_own_rig.toml"
    numbers = {
        path.upper(): one if isinstance(one, str) else f"{float(one):.6g}"
        for path in parameters(scene)
        if path.startswith(("rig.", "insertion."))
        for one in [value(scene, path)]
    }
    return _filled(template, **numbers, **{"RIG.NAME": scene.rig.name}).rstrip("\n")


def _unwritten_texts(scene: Scene) -> dict[str, str]:
    """Assumptions about the set-up; the first of them makes the declared change and the scan."""
    found = [path for path in UNWRITTEN if path in parameters(scene) and float(value(scene, path)) > 0.0]
    tables = []
    for path in found[:MOST_UNWRITTEN]:
        name, *shares = UNWRITTEN[path]
        low, high, _ = _multiples(scene, path, shares)
        unit = parameters(scene)[path].unit
        tables.append(f'[[assumption]]\nname = "{name}"\npath = "{path}"   # [{unit}]\nlow = {low}\nhigh = {high}')
    path = found[0]
    name, *shares = UNWRITTEN[path]
    scanned, unit = _multiples(scene, path, shares), parameters(scene)[path].unit
    change = f'[[change]]\nname = "{name} of {scanned[-1]} {unit}"\nvalues = {{ "{path}" = {scanned[-1]} }}'
    scan = f'[scan]\npath = "{path}"\nvalues = [{", ".join(scanned)}]   # [{unit}]'
    return {
        "SCREENED": "\n\n".join(tables),
        "CHANGED": f"{change}\n\n# The angle over one assumption, in steps.\n\n{scan}",
    }


def _multiples(scene: Scene, path: str, shares: Sequence[float]) -> list[str]:
    return [f"{share * float(value(scene, path)):.6g}" for share in shares]


def factor_paths(scene: Scene) -> list[str]:
    """At most eight parameters that a pile may depend on, friction first, heaviest components first."""
    by_share = sorted(scene.bodies, key=lambda body: -body.mass_fraction)
    names = list(dict.fromkeys(body.material for body in by_share))
    pairs = [pair for pair in scene.pairs if {pair.a, pair.b} <= {*names, scene.rig.wall}]
    pairs.sort(key=lambda pair: sum(names.index(end) if end in names else 0 for end in (pair.a, pair.b)))
    of_pairs = [f"pair.{p.a}.{p.b}.{key}" for p in pairs for key in ("static_friction", "restitution")]
    of_materials = [f"material.{name}.{key}" for name in names for key in ("shear_modulus", "poisson_ratio")]
    room = MOST_FACTORS - min(len(of_materials), 2)
    chosen = of_pairs[:room] + of_materials
    return [path for path in chosen if float(value(scene, path)) > 0.0][:MOST_FACTORS]


def _factor_text(name: str, reference: float, entry: Parameter) -> str:
    low = max(entry.low, (1.0 - SPAN) * reference)
    high = min(entry.high, (1.0 + SPAN) * reference)
    unit = "" if entry.unit == "1" else f"   # [{entry.unit}]"
    return (
        f'\n[[factor]]\nname = "{name}"\npath = "{entry.path}"   # {entry.doc}\n'
        f"low = {low:.6g}{unit}\nhigh = {high:.6g}\n"
    )


def _is_shipped(material: str) -> bool:
    return not Path(material).is_file() and material.removesuffix(".toml") in shipped_assets("materials")


def _filled(template: str, **words: str) -> str:
    text = (TEMPLATES / template).read_text(encoding="utf-8")
    for key, word in words.items():
        text = text.replace(f"@{key}@", word)
    return text


def check_name(name: str) -> str:
    """``name`` if it is allowed as the name of a file; otherwise raises :class:`CommandError`."""
    if not NAME.fullmatch(name):
        raise CommandError(f"NAME {name!r}: letters, digits, - and _ are allowed")
    return name


def write_new(path: Path, text: str) -> Path:
    """Write ``path``, and create its folder; :class:`CommandError` if the file exists."""
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise CommandError(f"{path}: exists already; choose another name") from None
    return path
