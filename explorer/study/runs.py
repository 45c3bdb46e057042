"""The runs of a study's result, and the scene of any of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from doe.profile import Profile
from doe.study import Factor, load_study, with_profile
from explorer.errors import CommandError
from solver import Scene, pour_key, with_values

Plain = dict[str, Any]
Values = dict[str, float | str]

STAGES = ("pilot", "screening", "assumptions", "scan", "ascent", "surface", "verification")


@dataclass(frozen=True)
class StudyRun:
    """One run of a study. ``observables``: name → value, None where nothing could be read."""

    stage: str
    label: str
    replicate: int
    attempt: int
    seed: int
    outcome: str
    observables: Mapping[str, float | None]
    key: str


def study_runs(result: Plain, stage: str) -> tuple[StudyRun, ...]:
    """The runs of ``stage`` in the order of its settings, failed ones included; none where it has not begun."""
    part = result.get(stage)
    if not part:
        return ()
    listed = [part["runs"]] if stage == "verification" else part["runs"]
    names = ("label", "replicate", "attempt", "seed", "outcome", "observables", "key")
    return tuple(StudyRun(stage, *(run[name] for name in names)) for runs in listed for run in runs)


def settings_of(result: Plain, stage: str, label: str) -> Values:
    """What was changed against the study's scene in the setting ``label`` of ``stage``: path → SI or name."""
    part = result.get(stage)
    if stage not in SETTINGS or not part:
        raise CommandError(f"{stage}: no such stage in this study; there are {', '.join(_begun(result)) or 'none yet'}")
    try:
        return SETTINGS[stage](result, part, label)
    except (KeyError, IndexError, ValueError, StopIteration):
        raise CommandError(f"{label!r} is no setting of the stage {stage}") from None


def scene_of(result: Plain, run: StudyRun) -> tuple[Scene, bool]:
    """The scene of ``run``, and whether it is the stored one to the last bit (the same key).

    It is not where the program, the study file or its material have changed since. Raises a ValueError where the study
    file is gone or does not know the parameters any more.
    """
    # The profile as it was: the file's own may have been changed since.
    profile = Profile(**result["study"]["profile"])
    study = replace(load_study(str(result["study"]["file"])), profiles={profile.name: profile})
    study, _ = with_profile(study, profile.name)
    scene = with_values(study.scene, settings_of(result, run.stage, run.label))
    return scene, pour_key(scene, run.seed) == run.key


def _begun(result: Plain) -> list[str]:
    return [stage for stage in STAGES if result.get(stage)]


def _numbered(label: str, word: str) -> int:
    """ "row 3", "row" → 2."""
    first, number = label.split()
    if first != word or int(number) < 1:
        raise ValueError(label)
    return int(number) - 1


def _pilot(result: Plain, part: Plain, label: str) -> Values:
    return {} if label == "reference" else dict(result["study"]["changes"][label])


def _two_level(result: Plain, part: Plain, label: str) -> Values:
    row = part["design"][_numbered(label, "row")]
    # The columns of the dummies come after those of the factors.
    return {f["path"]: Factor(**f).level(level) for f, level in zip(part["factors"], row, strict=False)}


def _scan(result: Plain, part: Plain, label: str) -> Values:
    value = next(value for value in part["values"] if label == f"{part['path']} = {value:g}")
    return {part["path"]: value}


def _ascent(result: Plain, part: Plain, label: str) -> Values:
    return _row(part["factors"], part["path"]["natural"][_numbered(label, "step")])


def _surface(result: Plain, part: Plain, label: str) -> Values:
    return _row(part["factors"], part["natural"][_numbered(label, "point")])


def _verification(result: Plain, part: Plain, label: str) -> Values:
    if label != "optimum":
        raise ValueError(label)
    return dict(part["values"])


def _row(factors: list[Plain], values: list[float]) -> Values:
    return {factor["path"]: value for factor, value in zip(factors, values, strict=True)}


SETTINGS: dict[str, Callable[[Plain, Plain, str], Values]] = {
    "pilot": _pilot,
    "screening": _two_level,
    "assumptions": _two_level,
    "scan": _scan,
    "ascent": _ascent,
    "surface": _surface,
    "verification": _verification,
}
