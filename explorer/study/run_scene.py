"""The scene of any run of a study's result."""

from __future__ import annotations

from dataclasses import replace

from doe.run_records import Run
from doe.studies.study import Values, load_study, with_profile
from doe.studies.study_result import AnyStudy
from explorer.errors import CommandError
from explorer.units import MISSING, observed
from solver import Scene, pour_key, with_values


def stages_with_runs(result: AnyStudy) -> tuple[str, ...]:
    """The stages that have made runs, in running order."""
    return tuple(stage for stage in result.stage_names() if result.runs_of(stage))


def settings_of(result: AnyStudy, stage: str, label: str) -> Values:
    """What the setting ``label`` of ``stage`` changes in the study's scene: path → SI or name."""
    begun = stages_with_runs(result)
    if stage not in begun:
        raise CommandError(f"{stage}: no such stage in this study; allowed: {', '.join(begun) or 'none yet'}")
    settings = {setting.label: setting.values for setting in result.settings_of(stage)}
    if not settings:
        raise CommandError(
            f"{stage}: this result lacks the settings of its runs, as an older version of the program made it"
        )
    if label not in settings:
        raise CommandError(f"{label!r} is not a setting of the stage {stage}")
    return settings[label]


def scene_of(result: AnyStudy, stage: str, run: Run) -> tuple[Scene, bool]:
    """The scene of a run of ``stage``, and whether it is the stored one to the last bit (the same key).

    It is not if the program, the study file or its material has changed since. Raises a ValueError if the study file is
    gone or no longer knows the parameters.
    """
    # The profile as it was: the one in the file may have been changed since.
    profile = result.study.profile
    study = replace(load_study(result.study.file), profiles={profile.name: profile})
    study, _ = with_profile(study, profile.name)
    scene = with_values(study.scene_of(run.experiment), settings_of(result, stage, run.label))
    return scene, pour_key(scene, run.seed) == run.key


def observed_of(run: Run, observable: str) -> str:
    """What was read off a run, with its unit; a dash if the run does not count."""
    value = run.observables.get(observable)
    return observed(observable, value) if value is not None and run.valid else MISSING
