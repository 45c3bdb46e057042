"""Any run of a result as a scene."""

import dataclasses

import pytest

from doe.campaign import run_campaign
from doe.runner import Setting
from doe.study import load_study, with_profile
from explorer.study.runs import STAGES, scene_of, settings_of, study_runs
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
    stages = {}
    for stage in STAGES:
        for run in study_runs(result, stage):
            stages[stage] = stages.get(stage, 0) + 1
            assert settings_of(result, stage, run.label) == pytest.approx(runner.asked[stage, run.label])
    assert stages == result["runs"]["by_stage"]


def test_every_scene_is_the_stored_one_to_the_last_bit(keyed):
    result, _ = keyed
    for stage in STAGES:
        firsts = [run for run in study_runs(result, stage) if run.replicate == 0]
        for run in (firsts[0], firsts[-1]):
            scene, same = scene_of(result, run)
            assert same, run
            assert not scene_of(result, dataclasses.replace(run, seed=run.seed + 1))[1]
    assert scene.rig.mass == 0.020  # of the profile "quick"


def test_a_study_file_that_is_gone_or_a_label_that_nobody_gave_is_one_line(keyed):
    result, _ = keyed
    run = study_runs(result, "surface")[0]
    lost = result | {"study": result["study"] | {"file": "/nowhere/study.toml"}}
    with pytest.raises(ValueError, match=r"/nowhere/study.toml"):
        scene_of(lost, run)
    for stage, label in (("surface", "point 99"), ("surface", "row 1"), ("scan", "x = 1"), ("verification", "best"),
                         ("screening", "row 0"), ("ascent", "step"), ("pilot", "<b>")):  # fmt: skip
        with pytest.raises(ValueError, match="is no setting of the stage"):
            settings_of(result, stage, label)
    with pytest.raises(ValueError, match="no such stage"):
        settings_of(result, "optimum", "optimum")
    with pytest.raises(ValueError, match="there are pilot"):
        settings_of({"pilot": result["pilot"]}, "surface", "point 1")


def test_a_stage_that_has_not_begun_has_no_runs():
    assert study_runs({}, "pilot") == ()
    assert study_runs({"scan": None}, "scan") == ()
