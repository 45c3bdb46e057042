"""Any run of a result as a scene."""

import dataclasses

import pytest

from doe.run_records import Setting
from doe.studies.campaign import run_campaign
from doe.studies.study import load_study, with_profile
from doe.studies.study_result import PartialStudy, StudyResult
from explorer.study.run_scene import scene_of, settings_of, stages_with_runs
from solver import pour_key, with_values
from tests.doe.formula_runner import FormulaRunner
from tests.explorer import reported_studies


class Keyed(FormulaRunner):
    """Gives every run the key that its pour would have, and remembers the settings asked for."""

    def __init__(self, scene, formula, **more):
        super().__init__(formula, **more)
        self.scene, self.asked = scene, {}

    def run(self, stage, settings):
        self.asked |= {(stage, setting.label): setting.values for setting in settings}
        return super().run(stage, settings)

    def _once(self, stage, row, setting: Setting, replicate, attempt):
        run = super()._once(stage, row, setting, replicate, attempt)
        if replicate:  # one of each setting is enough, and quicker
            return run
        key = pour_key(with_values(self.scene, setting.values), run.seed)
        return dataclasses.replace(run, key=key)


@pytest.fixture(scope="module")
def keyed():
    study, profile = with_profile(load_study("sunflower_extract"), "quick")
    runner = Keyed(study.scene, reported_studies.planted, sigma=1.0, jam=0.05)
    found = run_campaign(study, profile, runner, reported_studies.BIAS)
    return reported_studies.result_of(study, profile, found, 1.0), runner


def test_the_settings_of_every_run_are_those_that_were_asked_for(keyed):
    result, runner = keyed
    for stage in stages_with_runs(result):
        for runs in result.runs_of(stage):
            for run in runs:
                assert settings_of(result, stage, run.label) == pytest.approx(runner.asked[stage, run.label])
    assert set(stages_with_runs(result)) == set(result.runs.by_stage)
    assert sum(result.runs.by_stage.values()) == result.runs.total == len(list(result.all_runs()))


def test_every_scene_is_the_stored_one_to_the_last_bit(keyed):
    result, _ = keyed
    for stage in stages_with_runs(result):
        firsts = [run for runs in result.runs_of(stage) for run in runs if run.replicate == 0]
        for run in (firsts[0], firsts[-1]):
            scene, same = scene_of(result, stage, run)
            assert same, run
            assert not scene_of(result, stage, dataclasses.replace(run, seed=run.seed + 1))[1]
    assert scene.rig.mass == 0.020  # of the profile "quick"


def test_a_study_file_that_is_gone_or_a_label_that_nobody_gave_is_one_line(keyed):
    result, _ = keyed
    run = result.surface.runs[0][0]
    lost = dataclasses.replace(result, study=dataclasses.replace(result.study, file="/nowhere/study.toml"))
    with pytest.raises(ValueError, match=r"/nowhere/study.toml"):
        scene_of(lost, "surface", run)
    for stage, label in (("surface", "point 99"), ("surface", "row 1"), ("scan", "x = 1"), ("verification", "best"),
                         ("screening", "row 0"), ("ascent", "step"), ("pilot", "<b>")):  # fmt: skip
        with pytest.raises(ValueError, match="is not a setting of the stage"):
            settings_of(result, stage, label)
    with pytest.raises(ValueError, match="no such stage"):
        settings_of(result, "optimum", "optimum")
    begun = PartialStudy(study=result.study, pilot=result.pilot)
    with pytest.raises(ValueError, match="allowed: pilot"):
        settings_of(begun, "surface", "point 1")


def test_a_result_of_before_settings_were_kept_says_so(keyed):
    result, _ = keyed
    content = result.to_dict()
    del content["ascent"]["settings"]
    with pytest.raises(ValueError, match=r"^ascent: .* an older version of the program made it$"):
        settings_of(StudyResult.from_dict(content), "ascent", "step 1")


def test_a_stage_that_has_not_begun_has_no_runs(keyed):
    result, _ = keyed
    assert stages_with_runs(PartialStudy(study=result.study)) == ()
    assert PartialStudy(study=result.study).runs_of("scan") == ()
