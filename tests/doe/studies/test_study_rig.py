"""Studies in other rigs than the funnel: what is set, what can be a target, and what tells their runs apart."""

import copy
import dataclasses

import pytest

from doe.errors import StudyFileError
from doe.run_records import Run
from doe.studies.study import study_from, with_profile
from solver import ParameterError, pour_key, value
from tests.doe.studies.test_study import PATH, TABLE


def study_in(rig, observable="dynamic_angle_deg", **insertion):
    table = copy.deepcopy(TABLE)
    table.update(rig=rig, insertion=insertion, assumption=[], change=[])
    for key in ("scan", "estimators"):
        table.pop(key, None)
    table["target"][0]["observable"] = observable
    return study_from(table, PATH)


def test_a_study_may_turn_a_drum():
    study = study_in({"name": "rotating_drum", "speed_rpm": 30, "filled_volume": "600mL"}, rate="200g/s")
    assert study.scene.rig.name == "rotating_drum"
    assert value(study.scene, "rig.speed_rpm") == 30.0
    assert value(study.scene, "insertion.rate") == 0.2
    assert value(study.scene, "insertion.protocol") == "fill_then_open"
    # The estimators of a free pile are not read in a drum.
    assert study.estimators == ("dynamic_angle_deg",)
    scene, profile = with_profile(study, "quick")
    assert scene.scene.bodies[0].spheres == profile.spheres
    assert value(scene.scene, "rig.filled_volume") == pytest.approx(6e-4)  # a profile's mass is for rigs that have one


def test_a_lifted_cylinder_gives_the_pile_s_estimators():
    study = study_in({"name": "lifting_cylinder"}, "angle_of_repose_deg")
    assert "angle_of_repose_cone_deg" in study.estimators
    with_profile(study, "quick")


@pytest.mark.parametrize(
    ("rig", "observable", "says"),
    [
        ({"name": "rotating_drum"}, "angle_of_repose_deg", "dynamic_angle_deg, slope_deg, slope_core_deg"),
        ({"name": "funnel"}, "dynamic_angle_deg", "angle_of_repose_deg"),
        ({"name": "rotating_drum", "speed_rpm": "fast"}, "dynamic_angle_deg", r"rig\.speed_rpm"),
        ({"name": "compression"}, "dynamic_angle_deg", "'compression' is a bench test"),
    ],
)
def test_what_a_rig_does_not_give_is_refused(rig, observable, says):
    with pytest.raises((ParameterError, StudyFileError), match=says):
        study_in(rig, observable)


def test_a_drum_that_ran_for_its_time_is_a_valid_run():
    run = Run("row", 0, 0, 1, "measured", "", {}, 1.0, "key")
    assert run.valid
    assert dataclasses.replace(run, outcome="at_rest").valid
    assert not dataclasses.replace(run, outcome="jammed").valid


def test_runs_in_different_rigs_have_different_keys():
    lifted = study_in({"name": "lifting_cylinder"}, "angle_of_repose_deg").scene
    funnel = study_in({"name": "funnel"}, "angle_of_repose_deg").scene
    assert pour_key(lifted, 1) != pour_key(funnel, 1)
    faster = dataclasses.replace(lifted, rig=dataclasses.replace(lifted.rig, lift_speed=0.03))
    assert pour_key(lifted, 1) != pour_key(faster, 1)
