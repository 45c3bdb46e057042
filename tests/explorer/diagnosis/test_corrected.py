"""The study that a diagnosis writes beside the corrected material: it can be read, and says what came before."""

from dataclasses import replace

import pytest

from doe.studies.study import load_study, with_profile
from explorer.diagnosis.corrected import corrected_toml, study_toml
from solver import EFFECTS, value
from tests.explorer.diagnosed import CASES, diagnosed


@pytest.mark.parametrize("case", ["effect", "two amplitudes", "pair"])
def test_its_factors_are_the_parameters_and_the_amplitudes_of_what_is_named(case, tmp_path):
    measurement, found = diagnosed(**CASES[case])
    (tmp_path / "corrected.toml").write_text(corrected_toml(measurement, found), encoding="utf-8")
    path = tmp_path / "corrected_study.toml"
    path.write_text(study_toml(measurement, found, "corrected.toml"), encoding="utf-8")
    study, profile = with_profile(load_study(str(path)), "quick")
    amplitudes = [
        f"effect.{name}.{field}" for name, _ in found.after.model.effects for field in EFFECTS[name].amplitudes
    ]
    assert [factor.path for factor in study.factors] == [*(p.path for p in measurement.parameters), *amplitudes]
    assert all(factor.low < factor.reference < factor.high for factor in study.factors)
    # What the diagnosis added is calibrated whatever the screening finds.
    assert set(amplitudes) <= {factor.path for factor in study.factors if factor.name in study.fallback}
    assert profile.mass == pytest.approx(float(value(measurement.fit[0].scene, "rig.mass")))


def test_its_targets_are_measured_and_hold_what_the_declared_model_gave(tmp_path):
    measurement, found = diagnosed(**CASES["effect"])
    (tmp_path / "corrected.toml").write_text(corrected_toml(measurement, found), encoding="utf-8")
    path = tmp_path / "corrected_study.toml"
    path.write_text(study_toml(measurement, found, "corrected.toml"), encoding="utf-8")
    study = load_study(str(path))
    assert 1 <= len(study.targets) <= 2
    condition = measurement.fit[0]
    for target in study.targets:
        values = condition.offered[target.observable].values
        assert target.mean == pytest.approx(values.mean())
        assert target.before_mean is not None
        assert abs(target.before_mean - target.mean) > 0.0
        assert target.before_n == len(found.before.blocks[0])


def test_a_number_that_no_study_takes_is_no_target(tmp_path):
    measurement, found = diagnosed(**CASES["effect"])
    (tmp_path / "corrected.toml").write_text(corrected_toml(measurement, found), encoding="utf-8")
    path = tmp_path / "corrected_study.toml"
    path.write_text(study_toml(measurement, found, "corrected.toml"), encoding="utf-8")
    first = load_study(str(path)).targets[0]
    assert first.observable == "angle_of_repose_deg"
    turned = tuple(
        replace(one, values=-one.values) if one.observable == first.observable else one
        for one in measurement.fit[0].observations
    )
    conditions = (replace(measurement.fit[0], observations=turned), *measurement.conditions[1:])
    path.write_text(study_toml(replace(measurement, conditions=conditions), found, "corrected.toml"), encoding="utf-8")
    assert first.observable not in [target.observable for target in load_study(str(path)).targets]


def test_the_targets_of_a_single_curve_have_the_uncertainty_that_is_stated(tmp_path):
    measurement, found = diagnosed(**CASES["effect"])
    single = []
    for condition in measurement.conditions:
        first = [
            replace(one, values=one.values[:1], uncertainty=0.03 * float(abs(one.values[0]).max()))
            for one in condition.observations
        ]
        single.append(replace(condition, observations=tuple(first), replicates=1, surfaces={}))
    (tmp_path / "corrected.toml").write_text(corrected_toml(measurement, found), encoding="utf-8")
    path = tmp_path / "corrected_study.toml"
    path.write_text(study_toml(replace(measurement, conditions=tuple(single)), found, "corrected.toml"), "utf-8")
    study = load_study(str(path))
    assert study.targets
    for target in study.targets:
        one = single[0].offered[target.observable]
        assert (target.mean, target.n, target.sd_source) == (pytest.approx(one.values[0].item()), None, "stated")
        assert target.sd == pytest.approx(one.uncertainty)


@pytest.mark.parametrize("case", ["nothing", "ambiguous", "unexplained", "not carried over"])
def test_nothing_named_is_no_study(case):
    measurement, found = diagnosed(**CASES[case])
    assert study_toml(measurement, found, "corrected.toml") == ""
