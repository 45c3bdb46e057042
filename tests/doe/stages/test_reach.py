"""The gate that stops a study whose target no setting of the factors comes near, and no other one."""

import dataclasses
import re

import pytest

from doe.errors import StudyStopped
from doe.stages import planned_runs
from doe.stages.reach import reach
from doe.studies.campaign import run_campaign
from doe.studies.profile import Profile
from doe.studies.study import load_study
from doe.target import Target
from tests.doe.formula_runner import FormulaRunner

STUDY = dataclasses.replace(load_study("sunflower_extract"), scan_path=None, scan_values=(), assumptions=(), changes={})
PROFILE = Profile("test", pilot_runs=6)
SIGMA = 0.5
FRICTION, BOUNCE = "pair.seed.seed.static_friction", "pair.seed.seed.restitution"
LEVELS = {factor.path: factor for factor in STUDY.factors}
PETIOLE = "pair.petiole.petiole.static_friction"


def coded(values, path):
    factor = LEVELS[path]
    return (2.0 * float(values.get(path, factor.reference)) - factor.low - factor.high) / (factor.high - factor.low)


def pile(values, middle=12.0, reach=5.0):
    """``middle`` ± ``reach`` at the corners: friction up, restitution down."""
    return middle + 0.7 * reach * coded(values, FRICTION) - 0.3 * reach * coded(values, BOUNCE)


def study_of(mean, sd=1.5, n=9, observable="angle_of_repose_deg", study=STUDY):
    return dataclasses.replace(study, targets=(Target(observable, mean, sd, n),))


class Noise:
    """Of the pilot: all that the stage reads."""

    sigma = SIGMA


def found(mean, formula=pile, sigma=SIGMA, runner=None, profile=PROFILE, **keywords):
    return reach(study_of(mean, **keywords), profile, runner or FormulaRunner(formula, sigma), Noise)


def test_the_corners_are_the_ends_of_the_factors_of_known_direction():
    result = found(12.0, sigma=0.0)
    low, high = (setting.values for setting in result.settings)
    kinds = {name.rpartition(".")[2] for name in low}
    assert kinds == {"static_friction", "restitution"}
    for path in low:
        ends = (LEVELS[path].low, LEVELS[path].high)
        assert (low[path], high[path]) == (ends[::-1] if path.endswith("restitution") else ends)
    assert [corner.mean for corner in result.corners] == pytest.approx([7.0, 17.0])
    # 17 > 12 + 2·1.5/3, and 12 − 1 > 7: four degrees inside at the nearer end.
    assert result.beyond == pytest.approx(-6.0)
    assert result.line == f"7.0° … 17.0° between the corners of {len(low)} factors; target 12.0°, within"


@pytest.mark.parametrize(
    ("mean", "within"),
    [(17.5, True), (18.5, True), (27.9, True), (28.1, False), (60.0, False), (6.0, True), (-3.9, True), (-4.1, False)],
)
def test_the_whole_range_beyond_the_nearer_corner_is_the_limit(mean, within):
    """Corners at 7 and 17, target ± 1: the limits are 17 + 10 + 1 and 7 − 10 − 1."""
    if within:
        assert found(mean, sigma=0.0).within
    else:
        with pytest.raises(ValueError, match=r"out of reach: 7\.0° … 17\.0° over"):
            found(mean, sigma=0.0)


@pytest.mark.parametrize(("mean", "within"), [(13.0, True), (14.7, True), (15.1, False)])
def test_within_noise_nothing_is_out_of_reach(mean, within):
    """Without an effect the range is nothing; 3 standard errors of the pilot's σ = 2 are 3·2/√3 = 3.46."""

    class Wide(Noise):
        sigma = 2.0

    def ask():
        return reach(study_of(mean, sd=0.3), PROFILE, FormulaRunner(lambda values: 11.4, 0.0), Wide)

    # 11.4 + 2·0.3/3 + 3.46 = 15.06
    if within:
        assert ask().within
    else:
        with pytest.raises(ValueError, match="out of reach"):
            ask()


@pytest.mark.parametrize(("own", "pilot"), [(3.0, 0.5), (0.01, 0.5)])
def test_a_corner_is_known_by_the_larger_of_its_own_scatter_and_the_pilot_s(own, pilot):
    """Over √3 for three pours."""

    class Known(Noise):
        sigma = pilot

    result = reach(study_of(12.0), PROFILE, FormulaRunner(pile, own), Known)
    for corner, error in zip(result.corners, result.standard_errors, strict=True):
        assert (corner.sd > pilot) == (own > pilot)
        assert error == pytest.approx(max(corner.sd, pilot) / 3**0.5)


def test_a_hopeless_study_stops_in_a_line_that_says_what_is_missing_and_how_to_go_on():
    runner = FormulaRunner(pile, SIGMA)
    with pytest.raises(StudyStopped, match="stopped in the reach stage: out of reach: ") as told:
        run_campaign(study_of(40.0), PROFILE, runner, dict.fromkeys(STUDY.estimators, ((0.0, 0.1),) * 3))
    said = str(told.value)
    assert re.search(r"[67]\.\d° … 1[67]\.\d° over .* against 40\.0° ± 1\.0°; likely a missing effect", said)
    assert "add [effect.rolling_resistance] rolling_friction = 0.1" in said
    assert "--beyond-reach" in said
    assert "reach_runs = 0" in said
    assert "\n" not in said
    assert runner.calls == {"pilot": PROFILE.pilot_runs, "reach": 2 * PROFILE.reach_runs}
    with pytest.raises(ValueError, match="likely a parameter that no factor varies, the rig"):
        found(-40.0)


def test_a_near_one_passes_and_its_result_is_kept():
    runner = FormulaRunner(lambda values: pile(values, middle=20.0), SIGMA)
    bias = dict.fromkeys(STUDY.estimators, ((0.0, 0.1),) * 3)
    result = run_campaign(study_of(24.0), PROFILE, runner, bias).stages
    assert result.reach.within
    assert result.reach.line.endswith("; target 24.0°, within")
    assert type(result).from_dict(result.to_dict()).reach.to_dict() == result.reach.to_dict()
    assert [stage for stage, run in result.all_runs() if run.label == "greatest angle"] == ["reach"] * 3


def test_a_wrong_direction_cannot_stop_a_study_whose_range_is_wide():
    """Corners at 14 and 10; the truth reaches 17 with restitution the other way round."""

    def against(values):
        return 12.0 + 3.5 * coded(values, FRICTION) + 1.5 * coded(values, BOUNCE)

    assert found(17.0, against, sigma=0.0).within
    # Friction itself the wrong way round: the corner called lowest is the greatest.
    turned = found(16.0, lambda values: 24.0 - pile(values), sigma=0.0)
    assert turned.within
    assert turned.beyond < 0.0


@pytest.mark.parametrize("outcome", ["jammed", "no_heap"])
def test_corners_without_a_valid_pour_stop_nothing(outcome):
    result = found(60.0, runner=FormulaRunner(pile, SIGMA, ended=outcome))
    assert result.within
    assert "no valid pour" in result.line


def test_it_is_for_angles_of_repose_and_factors_of_known_direction_alone():
    none = dataclasses.replace(PROFILE, reach_runs=0)
    assert found(60.0, profile=none) is None
    assert found(60.0, observable="bulk_density_kg_m3") is None
    others = dataclasses.replace(STUDY, factors=tuple(f for f in STUDY.factors if "modulus" in f.path))
    assert found(60.0, study=others) is None
    assert planned_runs(STUDY, PROFILE)["reach"] == 6
    assert planned_runs(STUDY, none)["reach"] == planned_runs(others, PROFILE)["reach"] == 0


def test_one_corner_without_a_valid_pour_stops_nothing():
    class OneFlat(FormulaRunner):
        def _once(self, stage, row, setting, replicate, attempt):
            run = super()._once(stage, row, setting, replicate, attempt)
            return dataclasses.replace(run, outcome="no_heap") if setting.label == "greatest angle" else run

    result = found(60.0, runner=OneFlat(pile, SIGMA))
    assert result.within
    assert "no valid pour" in result.line


@pytest.mark.parametrize("mean", [14.6, 19.6, 23.7])
def test_the_shipped_study_is_not_stopped_by_corners_near_its_reference(mean):
    """Its pilot gives 19.6 ± 5.3° (docs/paper_material.md), its target 24.68 ± 1.0: 23.67 − 3·5.3/√3 = 14.5."""

    class Pilot(Noise):
        sigma = 5.3

    shipped = load_study("sunflower_extract")
    assert reach(shipped, PROFILE, FormulaRunner(lambda values: mean, 0.0), Pilot).within
