"""What a finished calibration found, as a scene: its study's set-up with the factors at the optimum."""

from __future__ import annotations

import json
from pathlib import Path

from doe.studies.study import load_study, with_profile
from doe.studies.study_result import StudyResult
from explorer.errors import CommandError
from explorer.report.identified import settings
from solver import ParameterError, Scene, with_values

RESULT = "result.json"


def is_calibration(source: str) -> bool:
    """Whether ``source`` names the folder of a finished calibration."""
    return (Path(source).expanduser() / RESULT).is_file()


def calibrated_scene(source: str) -> tuple[Scene, str]:
    """The scene at the optimum of the calibration in folder ``source``, and a caution; empty where none is due.

    It is due where the surface is not better than noise, and where the target leaves factors open: their values are
    then chosen by rule, and the ranges that give the target are told.

    Raises CommandError for a result that is not one of `explorer calibrate`, ParameterError or AssetNotFoundError where
    its study is not there any more or has changed so that the optimum does not fit it.
    """
    path = Path(source).expanduser() / RESULT
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
