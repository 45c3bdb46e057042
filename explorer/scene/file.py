"""From a name on the command line to a scene: a rig, material, study or calibration, with settings on top.

A file with ``material`` but neither targets nor factors is a set-up: its tables ``[rig]``, ``[insertion]``,
``[numerics]`` and ``[effect.<name>]`` lie over the material (``solver/scenes/material_file.py``), as they may in a
material file itself. With targets or factors it is a study and is read as `explorer calibrate` does. The folder of a
finished calibration means its study's set-up with the factors at the optimum.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from explorer.errors import CommandError
from solver import ParameterError, Scene, is_material, load_material, naming_file, read_toml, with_set_up, with_values
from solver.assets import AssetKind, AssetNotFoundError, asset_path, own_path, shipped_assets
from solver.rigs import BENCH_RIGS, RIGS
from solver.scenes.material_file import SET_UP
from solver.scenes.material_file import with_settings as with_values_and_rig
from solver.scenes.scene import with_rig
from solver.shapes.solid import ShapeError

DEFAULT_MATERIAL = "sunflower_extract"
DEFAULT_STUDY = "sunflower_extract"
SHIPPED: tuple[AssetKind, ...] = ("materials", "studies", "benchmarks", "scenes")
"""Where a shipped name is looked up, in this order."""

SET_UP_KEYS = ("format", "title", "material", *SET_UP)

SOURCES = (*RIGS, *BENCH_RIGS)
"""Rigs that can be named on the command line."""
RESULT = "result.json"
WRONG = (ParameterError, AssetNotFoundError, ShapeError)
"""Exceptions that the contents of a file can raise."""


def load_scene(source: str, material: str | None = None) -> Scene:
    """The scene that ``source`` names.

    Args:
        source: a rig ("funnel", "rotating_drum"), or a material, set-up or study by the path of its file or its
            shipped name (shipped set-ups are benchmarks). If a material and a study share a shipped name, the name
            means the material.
        material: path or shipped name of the material in the rig; only a rig takes one.

    Raises:
        ParameterError, AssetNotFoundError: one line with file, key, value and what is allowed.

    A rig with its default dimensions is not checked against the bodies here: :func:`with_settings` does that.
    """
    if source in SOURCES:
        scene = material_scene(material or DEFAULT_MATERIAL)
        return scene if scene.rig.name == source else with_rig(scene, source)
    path = _file_of(source)
    if material is not None:
        raise ParameterError(f"--material {material}: {path} has its own material; allowed only with the name of a rig")
    table = read_toml(path)
    if is_material(table):
        return material_scene(str(path))
    if "target" in table or "factor" in table:
        return study_scene(path)
    with naming_file(path, *WRONG):
        return _set_up_scene(table, path)


def named_scene(source: str, material: str | None = None) -> tuple[Scene, str]:
    """The scene from :func:`load_scene`, or for a calibration's folder :func:`calibrated_scene` with its caution."""
    if material is None and is_calibration(source):
        return calibrated_scene(source)
    return load_scene(source, material), ""


def _file_of(source: str) -> Path:
    own = own_path(source)
    if own.is_file():
        return own
    stem = source.removesuffix(".toml")
    for kind in SHIPPED:
        if stem in shipped_assets(kind):
            return asset_path(kind, stem)
    if is_calibration(source):
        raise ParameterError(
            f"{source}: a folder with a result.json; allowed here: a rig, a material, a set-up or a study "
            "(`explorer export` takes the folder of a finished calibration, without --material)"
        )
    if own.is_dir():
        raise ParameterError(f"{source}: the folder holds no result.json of a finished calibration")
    rigs, materials, studies, benchmarks, scenes = map(", ".join, (SOURCES, *map(shipped_assets, SHIPPED)))
    raise ParameterError(
        f"{source}: no such file, and no rig ({rigs}), shipped material ({materials}), study ({studies}), "
        f"benchmark ({benchmarks}) or prepared scene ({scenes}) of that name"
    )


def material_scene(name: str, relative_to: Path | None = None) -> Scene:
    """The scene of a material by its path or shipped name; its rig is the funnel unless the file says otherwise."""
    path = asset_path("materials", name, relative_to=relative_to)
    with naming_file(path, *WRONG):
        return load_material(str(path))


def _set_up_scene(table: dict[str, Any], path: Path) -> Scene:
    for key in table:
        if key not in SET_UP_KEYS:
            raise ParameterError(f"{key}: unknown key; allowed: {', '.join(SET_UP_KEYS)}")
    if table.get("format") != 1:
        raise ParameterError(f"format: {table.get('format')!r} is not 1")
    material = table.get("material")
    if not isinstance(material, str):
        raise ParameterError(f"material: a name or a path is needed, not {material!r}")
    return with_set_up(material_scene(material, path.parent), table, path.parent)


def study_scene(path: Path) -> Scene:
    """The scene of a study file: its material and set-up with every factor at its reference."""
    from doe.studies.study import load_study  # here: most scenes are of no study, whose modules take a second to load

    with naming_file(path, *WRONG):
        return load_study(str(path)).scene


def study_path(study: str) -> Path:
    """The file of a study, by its path or shipped name."""
    return asset_path("studies", study)


def with_settings(scene: Scene, settings: Sequence[str]) -> Scene:
    """``scene`` with settings ``path=value`` (``rig.mass=12g``); if a path is set twice, the last setting counts."""
    values: dict[str, Any] = {}
    for setting in settings:
        path, equals, value = setting.partition("=")
        if not equals or not path.strip():
            raise ParameterError(f"--set {setting}: write path=value, such as rig.outlet_height=65mm")
        values.pop(path.strip(), None)
        values[path.strip()] = value.strip()
    try:
        return with_values_and_rig(scene, values)
    except ParameterError as error:
        raise ParameterError(f"--set: {error}") from None


def is_calibration(source: str) -> bool:
    """Whether ``source`` names the folder of a finished calibration."""
    return (own_path(source) / RESULT).is_file()


def calibrated_scene(source: str) -> tuple[Scene, str]:
    """The scene at the optimum of the calibration in folder ``source``, and a caution, which may be empty.

    A caution is due if the surface is not better than noise, or if the target leaves factors open: their values are
    then chosen by rule, and the caution states the ranges that give the target.

    Raises CommandError for a result that is not from `explorer calibrate`, and ParameterError or AssetNotFoundError if
    its study no longer exists or has changed so that the optimum does not fit it.
    """
    from doe.studies.study import load_study, with_profile
    from doe.studies.study_result import StudyResult
    from explorer.report.identified import settings

    path = own_path(source) / RESULT
    try:
        result = StudyResult.from_dict(json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, OSError):
        raise CommandError(f"{path}: is not the result of `explorer calibrate`") from None
    study, optimum = result.study, result.optimum
    name = study.file if Path(study.file).is_file() else study.name
    open_factors = [setting for setting in settings(optimum) if not setting.identified]
    try:
        scene = with_values(with_profile(load_study(name), study.profile.name)[0].scene, dict(optimum.values))
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from None
    if not optimum.single.better_than_noise:
        return scene, f"{path}: its response surface is not better than noise, so this is not a calibration"
    if not open_factors:
        return scene, ""
    answers = "; ".join(f"{setting.label} {setting.answer}" for setting in open_factors)
    return scene, f"{path}: the target does not identify every factor: {answers}"
