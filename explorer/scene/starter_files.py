"""Files from which users start a material or a study of their own. They run as they are.

The texts are templates beside this file; a study's factors are read off the material that it calibrates.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from explorer.errors import CommandError
from explorer.scene.file import load_scene, material_scene
from solver import Parameter, Scene, is_material, parameters, read_toml, value
from solver.assets import own_path, shipped_assets
from solver.rigs.lifting_cylinder import LiftingCylinder
from solver.scenes.material_file import scene_from

TEMPLATES = Path(__file__).parents[1] / "templates"
NAME = re.compile(r"[A-Za-z0-9_-]+")
STUDY_ENDING = "_study"
SPAN = 0.2
"""Half the width of a factor's range, as a fraction of its reference."""
MOST_FACTORS = 8
CUT = "\n#---\n"
"""Separates the parts of a study template that depend on its rig."""


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
    """The scene of a new study of ``material``: its own rig if that is a lifted cylinder, otherwise the funnel."""
    own = material_scene(material)
    return own if isinstance(own.rig, LiftingCylinder) else load_scene("funnel", material)


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
        FACTORS=factors,
        **_rig_words(scene),
    )


def _rig_words(scene: Scene) -> dict[str, str]:
    """Texts of a study that depend on its rig: set-up, assumptions, declared change and scan, poured masses [kg]."""
    words = {"QUICK_MASS": "0.012", "MASS": "0.030"}
    template = "study_in_funnel.toml"
    if isinstance(scene.rig, LiftingCylinder):
        # A cylinder that holds too little for a heap leaves a flat layer: every profile pours all of it.
        words = dict.fromkeys(words, f"{scene.rig.mass:g}")
        template = "study_in_cylinder.toml"
    numbers = {"RIG": scene.rig.name} | {
        f"{word}{path.split('.')[1].upper()}": f"{share * float(value(scene, path)):.6g}"
        for path in ("insertion.rate", "insertion.drop_speed", "rig.lift_speed")
        if path in parameters(scene)
        for word, share in (("HALF_", 0.5), ("", 1.0), ("TWICE_", 2.0))
    }
    parts = _filled(template, **numbers).rstrip("\n").split(CUT)
    return words | dict(zip(("SET_UP", "SCREENED", "CHANGED"), parts, strict=True))


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
        f"low = {low:.6g}{unit}\nhigh = {high:.6g}\nreference = {reference:.6g}\n"
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
