"""The chain of stages on a formula with a known truth: what is planted has to be found, and nothing else."""

import dataclasses
import json

import numpy as np
import pytest

from doe.analysis.power import smallest_difference, smallest_effect, smallest_main_effect
from doe.designs import DESIGNS, ChosenDesign, DesignOptions
from doe.errors import StatisticsError, StudyStopped
from doe.stages import planned_runs
from doe.stages.pilot import pilot
from doe.studies.campaign import run_campaign
from doe.studies.profile import Profile
from doe.studies.study import load_study
from doe.studies.study_result import OWN_STAGES, RunCounts
from doe.target import Target
from tests.doe.formula_runner import FormulaRunner

FRICTION = "pair.seed.seed.static_friction"
MODULUS = "material.seed.shear_modulus"
BOUNCE = "pair.seed.seed.restitution"
BIAS = dict.fromkeys(load_study("sunflower_extract").estimators, ((0.0, 0.1),) * 3)


def chosen(name, **options):
    """A design of a stage."""
    return ChosenDesign(DESIGNS[name], DesignOptions(**options))


PROFILE = Profile("test", pilot_runs=10, change_runs=6, verification_runs=20, mass=0.03)


def planted(values):
    """Truth: the three factors of the study that can be calibrated act, the outlet height too, nothing else."""
    friction = (float(values.get(FRICTION, 0.57)) - 0.595) / 0.125
    modulus = (float(values.get(MODULUS, 56.3e6)) - 55.3e6) / 15.2e6
    bounce = (float(values.get(BOUNCE, 0.57)) - 0.59) / 0.09
    height = (float(values.get("rig.outlet_height", 0.065)) - 0.065) / 0.01
    return 24.0 + 4.0 * friction + 3.0 * modulus + 2.0 * bounce - 3.0 * height


@pytest.fixture(scope="module")
def study():
    return load_study("sunflower_extract")


@pytest.fixture(scope="module")
def campaign(study):
    lines = []
    runner = FormulaRunner(planted, sigma=0.8, jam=0.05)
    result = run_campaign(study, PROFILE, runner, BIAS, on_stage=lambda stage, line: lines.append((stage, line))).stages
    return result, lines, runner


def test_stages_come_in_order_and_make_the_planned_runs(study, campaign):
    result, lines, runner = campaign
    assert [stage for stage, _ in lines] == list(OWN_STAGES)
    planned = planned_runs(study, PROFILE)
    assert planned.pop("optimum") == 0
    valid = dict.fromkeys(planned, 0)
    for stage, run in result.all_runs():
        valid[stage] += run.valid
    assert valid == planned
    assert sum(runner.calls.values()) == RunCounts.of(result).total > sum(planned.values())
    assert RunCounts.of(result).by_outcome["jammed"] > 0


def test_the_pilot_tells_what_the_screening_s_own_design_resolves(study):
    profile = dataclasses.replace(PROFILE, change_runs=2)
    more = dataclasses.replace(study, screening_design=chosen("plackett-burman", runs=40))
    found = pilot(more, profile, FormulaRunner(planted, sigma=0.8), BIAS)
    sigma, factors = found.noise[study.targets[0].observable].sigma, len(study.factors)
    assert found.resolutions[1].main_effect == smallest_main_effect(sigma, 2, 40)
    assert found.resolutions[1].main_effect_bonferroni == smallest_main_effect(sigma, 2, 40, comparisons=factors)


def test_an_estimator_that_reads_no_pile_is_no_candidate_and_stops_nothing(study):
    unread = study.estimators[-1]
    found = pilot(study, PROFILE, FormulaRunner(planted, others={unread: lambda values: np.nan}), BIAS)
    assert unread not in found.noise
    assert found.choice.estimators == study.estimators[:-1]
    assert any(note.startswith(f"{unread} is no candidate") for note in found.notes)
    with pytest.raises(StatisticsError, match=r"^angle_of_repose_deg: values holds 0 valid run"):
        pilot(study, PROFILE, FormulaRunner(planted, others={"angle_of_repose_deg": lambda values: np.nan}), BIAS)


def test_screening_is_sized_by_the_noise_of_its_estimator_and_the_walk_by_that_of_the_target(study):
    """The cone of mass scatters twice as much, and sees six times as much of a change."""
    cone, target = "angle_of_repose_mass_cone_deg", study.targets[0].observable

    class Keen(FormulaRunner):
        def _once(self, stage, row, setting, replicate, attempt):
            run = super()._once(stage, row, setting, replicate, attempt)
            truth = planted(setting.values)
            seen = 24.0 + 6.0 * (truth - 24.0) + 2.0 * (run.observables[target] - truth)
            return dataclasses.replace(run, observables=run.observables | {cone: seen})

    profile = dataclasses.replace(PROFILE, resolution_deg=2.0, max_replicates=40)
    found = pilot(study, profile, Keen(planted, sigma=0.8), BIAS)
    assert found.estimator == cone
    assert found.noise[cone].sigma == pytest.approx(2.0 * found.noise[target].sigma)
    size = {one.stage: one for one in found.sizes}
    expected = smallest_main_effect(
        found.noise[cone].sigma, size["screening"].taken, 28, comparisons=len(study.factors)
    )
    assert size["screening"].resolved == pytest.approx(expected)
    assert size["ascent"].resolved == pytest.approx(
        smallest_difference(found.noise[target].sigma, size["ascent"].taken)
    )


def test_what_is_no_angle_is_no_estimator_for_one(study):
    density = "bulk_density_kg_m3"
    more = dataclasses.replace(study, estimators=(*study.estimators, density))
    found = pilot(more, PROFILE, FormulaRunner(planted, sigma=0.8), BIAS)
    assert density in found.noise
    assert found.choice.estimators == study.estimators


def test_planted_factors_are_found_and_the_others_are_not(campaign):
    result = campaign[0]
    assert set(result.screening.analysis.significant()) == {"X4", "X7", "X16"}
    assert [s.name for s in result.screening.selected] == ["X7", "X4", "X16"]
    assert {s.reason for s in result.screening.selected} == {"significant"}
    effects = {e.name: e.effect for e in result.screening.analysis.effects}
    # Standard error of an effect: 2 σ/√84 = 0.17; the tolerance is 3 of them.
    assert effects["X7"] == pytest.approx(8.0, abs=0.5)


def test_assumption_that_acts_is_found(campaign):
    result = campaign[0]
    assert result.assumptions.analysis.significant() == ("outlet_height",)
    assert result.scan.means[0] > result.scan.means[-1] + 5.0


def test_plate_factors_are_not_testable_and_named(campaign):
    names = {entry.factor for entry in campaign[0].screening.not_testable}
    assert names == {"X2", "X5", "X8", "X10", "X11", "X14", "X17", "X19", "X20", "X23"}
    assert all("3 bodies" in entry.statement for entry in campaign[0].screening.not_testable)


def test_optimum_hits_the_target_and_is_verified(campaign):
    result = campaign[0]
    # Bias of the model at the optimum: its standard error, 0.45 σ/√3 ≈ 0.2°, three of them.
    assert planted(result.optimum.values) == pytest.approx(24.68, abs=0.7)
    assert result.optimum.single.reached
    assert result.verification.tests[0].relative_error_percent < 5.0
    assert result.optimum.single.unidentified  # one number cannot fix three parameters


def test_result_is_plain_json(campaign):
    text = json.dumps(campaign[0].to_dict(), allow_nan=False)
    assert {"screening", "ascent", "surface", "optimum", "verification"} <= set(json.loads(text))


def test_without_an_effect_the_study_falls_back_and_says_so(study):
    on = dataclasses.replace(PROFILE, reach_runs=0)
    result = run_campaign(study, on, FormulaRunner(lambda values: 20.0, sigma=2.0), BIAS).stages
    assert result.screening.analysis.significant() == ()
    assert [s.name for s in result.screening.selected] == ["X4", "X7", "X16"]
    assert {s.reason for s in result.screening.selected} == {"fallback: not significant"}
    assert len(result.ascent.notes) == 3
    assert not result.surface.anova[0].better_than_noise
    assert result.verification.tests[0].verdict != "equivalent"


def test_target_out_of_reach_gives_the_nearest_value(study):
    def low(values):
        return planted(values) - 40.0

    on = dataclasses.replace(PROFILE, reach_runs=0)
    result = run_campaign(study, on, FormulaRunner(low, sigma=0.5), BIAS).stages
    assert not result.optimum.single.reached
    assert result.optimum.single.predicted == pytest.approx(result.optimum.single.reachable_high, abs=0.2)
    # Nearest means the high end of every factor that raises the angle.
    for factor in result.optimum.factors:
        assert result.optimum.values[factor.path] == pytest.approx(factor.high, rel=0.02)


@pytest.mark.parametrize("outcome", ["jammed", "no_heap", "obstructed"])
def test_rows_without_a_pile_are_missing_and_the_rest_is_analysed(study, outcome):
    class Jamming(FormulaRunner):
        def _once(self, stage, row, setting, replicate, attempt):
            run = super()._once(stage, row, setting, replicate, attempt)
            stuck = stage == "screening" and row in (3, 8, 11, 20)
            return dataclasses.replace(run, outcome=outcome) if stuck else run

    result = run_campaign(study, PROFILE, Jamming(planted, sigma=0.8), BIAS).stages
    assert result.screening.analysis.missing_rows == (3, 8, 11, 20)
    assert "given up" in result.screening.analysis.notes[-1]
    assert {"X4", "X7", "X16"} <= set(result.screening.analysis.significant())
    assert result.screening.no_pile_share[3] == 1.0


def test_a_study_of_flat_layers_ends_with_a_line_that_says_so(study):
    with pytest.raises(StudyStopped, match=r"stopped in the pilot stage: .*\(the last runs: \d+ no_heap\)"):
        run_campaign(study, PROFILE, FormulaRunner(planted, ended="no_heap"), BIAS)


def test_full_profile_is_sized_by_the_pilot(study):
    profile = Profile("full", pilot_runs=20, change_runs=4, resolution_deg=2.0, verification_runs=10, max_replicates=8)
    result = run_campaign(study, profile, FormulaRunner(planted, sigma=2.0), BIAS).stages
    taken = {size.stage: size.taken for size in result.pilot.sizes}
    for stage in ("screening", "assumptions", "scan", "ascent", "surface"):
        assert len({run.replicate for run in getattr(result, stage).runs[0]}) == taken[stage]
    short = [size.statement for size in result.pilot.sizes if size.taken < size.needed]
    assert short
    assert set(short) <= set(result.pilot.notes)


def test_the_ascent_follows_the_effects_on_the_target_and_not_those_on_the_estimator(study):
    """The cone of mass sees friction five times as strong and the modulus with the opposite sign."""
    cone = "angle_of_repose_mass_cone_deg"

    def seen_by_cone(values):
        friction = (float(values.get(FRICTION, 0.57)) - 0.595) / 0.125
        modulus = (float(values.get(MODULUS, 56.3e6)) - 55.3e6) / 15.2e6
        return planted(values) + 16.0 * friction - 8.0 * modulus

    result = run_campaign(study, PROFILE, FormulaRunner(planted, sigma=0.3, others={cone: seen_by_cone}), BIAS).stages
    assert result.screening.response == cone
    assert [s.name for s in result.screening.selected] == ["X7", "X4", "X16"]
    path = result.ascent.path
    # Truth in the target: 4 : 3 : 2. Standard error of an effect is 2 · 0.3/√84 = 0.07 of 8.
    assert path.direction == pytest.approx([1.0, 0.75, 0.5], abs=0.05)
    steps = [dict(zip((FRICTION, MODULUS, BOUNCE), step, strict=True)) for step in path.natural]
    assert path.predicted == pytest.approx([planted(step) for step in steps], abs=0.5)


def test_screening_line_tells_what_all_factors_at_once_could_show(campaign):
    screened = campaign[0].screening
    error = screened.analysis.pure_error
    assert error.smallest_detectable_effect_bonferroni > 1.2 * error.smallest_detectable_effect
    assert f"all factors at once, {error.smallest_detectable_effect_bonferroni:.1f}°;" in screened.line
    assert "°" not in dataclasses.replace(screened, response="bulk_density_kg_m3").line


def test_a_factor_or_assumption_on_few_bodies_is_named_in_the_line(campaign):
    result = campaign[0]
    assert [entry.factor for entry in result.assumptions.not_testable] == ["plate_thickness"]
    assert "not testable: plate_thickness" in result.assumptions.line
    assert "not testable: X2, X5" in result.screening.line


def test_the_scan_states_the_smallest_difference_it_could_see(campaign):
    scanned, noise = campaign[0].scan, campaign[0].pilot.noise["angle_of_repose_deg"]
    expected = smallest_effect(noise.sigma * (2 / PROFILE.scan_replicates) ** 0.5, noise.runs - 1)
    assert scanned.smallest_difference == pytest.approx(expected)
    assert f"smallest difference seen {expected:.1f}°" in dict(campaign[1])["scan"]


class NoPile(FormulaRunner):
    """Every run of one stage fails."""

    def __init__(self, stage):
        super().__init__(planted, sigma=0.8)
        self.stage = stage

    def _once(self, stage, row, setting, replicate, attempt):
        run = super()._once(stage, row, setting, replicate, attempt)
        return dataclasses.replace(run, outcome="lost_body") if stage == self.stage else run


@pytest.mark.parametrize("stage", ["pilot", "screening", "assumptions", "ascent", "surface", "verification"])
def test_a_stage_without_a_valid_run_is_a_named_end(study, stage):
    runner = NoPile(stage)
    with pytest.raises(StudyStopped, match=f"stopped in the {stage} stage: .*--resume continues") as stopped:
        run_campaign(study, PROFILE, runner, BIAS)
    assert stopped.value.stage == stage
    assert stopped.value.runs == sum(runner.calls.values()) > 0
    assert f"{stopped.value.runs} finished runs are in the store" in str(stopped.value)


def test_a_spread_that_differs_between_settings_is_found_and_noted(study):
    class Unequal(FormulaRunner):
        def _once(self, stage, row, setting, replicate, attempt):
            self.sigma = 6.0 if setting.label == "outlet 15 mm higher" else 0.5
            return super()._once(stage, row, setting, replicate, attempt)

    unequal = run_campaign(study, PROFILE, Unequal(planted), BIAS).stages.pilot
    assert unequal.equal_variance.p < 0.05
    assert {name for name, _ in unequal.equal_variance.sigmas} == {"reference", *study.changes}
    assert any("Brown–Forsythe" in note for note in unequal.notes)


def test_the_share_without_a_pile_counts_every_failure(study):
    result = run_campaign(study, PROFILE, NoPile("scan"), BIAS).stages
    assert result.scan.no_pile_share.tolist() == [1.0] * len(study.scan_values)


def test_two_targets_are_weighed_against_each_other(study):
    density = Target("bulk_density_kg_m3", mean=150.0 + 5.0 * 24.68, sd=2.0, n=10)
    names = (*study.estimators, density.observable)
    both = dataclasses.replace(study, targets=(*study.targets, density), estimators=names)
    result = run_campaign(both, PROFILE, FormulaRunner(planted, sigma=0.5), BIAS).stages
    compromise = result.optimum.compromise
    assert compromise.statement in result.optimum.line
    assert np.abs(compromise.standardised).max() < 1.0  # the two targets agree in the planted truth
    assert len(result.verification.tests) == 2
    assert compromise.desirability == pytest.approx([1.0, 1.0], abs=0.05)
    posterior = result.optimum.posterior
    assert posterior.p > 0.01
    assert posterior.predicted == pytest.approx([24.68, density.mean], abs=1.5)
    # The target's own error enters the optimum: 1.6/√10.
    assert result.optimum.single.target_standard_error == pytest.approx(0.506, abs=1e-3)
