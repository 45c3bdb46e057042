"""One study over several rigs: its file, and two targets that identify together what one leaves open."""

import copy
import dataclasses
import json

import numpy as np
import pytest

from doe.analysis.steepest_ascent import AscentFactor, ascent_path, bracket, region_around
from doe.errors import StudyFileError
from doe.stages import planned_runs
from doe.studies.campaign import run_campaign
from doe.studies.profile import Profile
from doe.studies.study import study_from, with_profile
from doe.studies.study_result import AllStages
from doe.target import Target
from solver import ParameterError, parameters, value
from tests.doe.formula_runner import FormulaRunner
from tests.doe.studies.test_study import PATH, TABLE

FRICTION = "pair.seed.seed.static_friction"
MODULUS = "material.seed.shear_modulus"
BOUNCE = "pair.seed.seed.restitution"
CENTRES = {FRICTION: (0.595, 0.125), MODULUS: (55.3e6, 15.2e6), BOUNCE: (0.59, 0.09)}
REFERENCES = {FRICTION: 0.57, MODULUS: 56.3e6, BOUNCE: 0.57}
DRUM = {"name": "drum", "rig": {"name": "rotating_drum", "speed_rpm": 30, "filled_volume": "600mL"}}
TRUTH = {FRICTION: 0.635, MODULUS: 52e6}
PROFILE = Profile("test", pilot_runs=6, change_runs=3, verification_runs=8, surface_replicates=4)


def table_with(*experiments, reads=("drum/dynamic_angle_deg",)):
    table = copy.deepcopy(TABLE)
    table["experiment"] = copy.deepcopy(list(experiments))
    table["target"] += [{"observable": name, "mean": 40.0, "sd": 1.0, "n": 9} for name in reads]
    return table


def study(**keywords):
    return study_from(table_with(DRUM, **keywords), PATH)


def coded(values, path):
    centre, half = CENTRES[path]
    return (float(values.get(path, REFERENCES[path])) - centre) / half


def repose(values):
    """Rises with both: one angle fixes only their sum."""
    return 24.0 + 4.0 * coded(values, FRICTION) + 4.0 * coded(values, MODULUS)


def drum(values):
    """Rises with one and falls with the other."""
    return 40.0 + 3.0 * coded(values, FRICTION) - 4.0 * coded(values, MODULUS)


def of_truth(both=True, off=0.0):
    """The study with the targets that the truth gives, the drum's ``off`` by so much."""
    first = Target("angle_of_repose_deg", repose(TRUTH), 0.6, 9, margin=1.0)
    second = Target("drum/dynamic_angle_deg", drum(TRUTH) + off, 0.6, 9, margin=1.0)
    made = dataclasses.replace(study(), targets=(first, second), scan_path=None, scan_values=(), assumptions=())
    if not both:
        made = dataclasses.replace(made, targets=(first,), experiments={})
    return made


def campaign(one, **keywords):
    runner = FormulaRunner(repose, sigma=0.5, experiments={"drum": {"dynamic_angle_deg": drum}}, **keywords)
    bias = dict.fromkeys(one.estimators, ((0.0, 0.1),) * 3)
    return run_campaign(one, PROFILE, runner, bias).stages


@pytest.fixture(scope="module")
def both():
    return campaign(of_truth())


def test_an_experiment_is_the_same_material_in_a_rig_of_its_own():
    made = study()
    other = made.experiments["drum"]
    assert made.all_experiments == ("", "drum")
    assert (other.rig.name, value(other, "rig.speed_rpm")) == ("rotating_drum", 30.0)
    assert made.scene.rig.name == "funnel"
    for path in parameters(made.scene):
        if path.startswith(("material.", "pair.", "body.", "contact.", "effect.")) and path in parameters(other):
            assert value(other, path) == value(made.scene, path), path
    assert with_profile(made, "quick")[0].experiments["drum"].bodies[0].spheres == "coarse"


@pytest.mark.parametrize(
    ("experiments", "reads", "says"),
    [
        (
            [DRUM],
            ["drum/angle_of_repose_deg"],
            r"target\.observable.*'drum/angle_of_repose_deg'.*drum/dynamic_angle_deg",
        ),
        ([DRUM], ["dram/dynamic_angle_deg"], r"target\.observable.*'dram/dynamic_angle_deg'"),
        ([DRUM], [], r"experiment\.name: no target reads drum"),
        ([DRUM], ["drum/dynamic_angle_deg"] * 2, r"target\.observable: 'drum/dynamic_angle_deg' appears twice"),
        ([DRUM, DRUM], ["drum/dynamic_angle_deg"], r"experiment\.name: 'drum' appears twice"),
        ([DRUM | {"name": "a/b"}], ["drum/dynamic_angle_deg"], r"experiment\.name: 'a/b' is no name"),
        ([DRUM | {"rig": {"name": "dram"}}], ["drum/dynamic_angle_deg"], r"experiment drum: .*rig\.name.*'dram'"),
        ([DRUM | {"colour": 1}], ["drum/dynamic_angle_deg"], r"experiment\.colour: unknown key"),
    ],
)
def test_a_wrong_experiment_is_refused_in_a_line(experiments, reads, says):
    with pytest.raises((ParameterError, StudyFileError), match=says) as told:
        study_from(table_with(*experiments, reads=reads), PATH)
    assert "\n" not in str(told.value)


def test_a_factor_of_the_own_rig_alone_is_refused():
    table = table_with(DRUM)
    table["assumption"] = [entry for entry in table["assumption"] if entry["path"] != "rig.outlet_height"]
    table["factor"][1] = {"name": "X2", "path": "rig.outlet_height", "low": 0.06, "high": 0.07, "reference": 0.065}
    with pytest.raises(StudyFileError, match=r"factor\.path: rig\.outlet_height of X2 is no parameter of .* drum"):
        study_from(table, PATH)


def test_the_first_target_has_to_be_of_the_own_rig():
    table = table_with(DRUM)
    table["target"].reverse()
    with pytest.raises(StudyFileError, match=r"target\.observable: the first target, drum/dynamic_angle_deg"):
        study_from(table, PATH)


def test_every_stage_makes_its_planned_runs_in_every_experiment(both):
    counts = {(stage, name): 0 for stage in both.stage_names() for name in ("", "drum")}
    for stage, run in both.all_runs():
        counts[stage, run.experiment] += run.valid
    for stage in ("screening", "surface", "verification"):
        assert counts[stage, ""] == counts[stage, "drum"] > 0
    assert counts["pilot", "drum"] == PROFILE.pilot_runs
    assert counts["ascent", "drum"] == counts["ascent", ""] > 0
    assert counts["scan", "drum"] == 0
    planned = planned_runs(of_truth(), PROFILE)
    assert {stage: counts[stage, ""] + counts[stage, "drum"] for stage in planned} == planned


def test_two_targets_identify_what_one_leaves_open(both):
    alone = campaign(of_truth(both=False)).optimum
    names = {factor.path: k for k, factor in enumerate(both.optimum.factors)}
    assert {FRICTION, MODULUS} <= set(names)
    posterior = both.optimum.posterior
    assert posterior.p > 0.01
    for path, true in TRUTH.items():
        k = names[path]
        assert posterior.low[k] < true < posterior.high[k]
        assert posterior.identified[k]
    open_ones = [k for k, factor in enumerate(alone.factors) if factor.path in TRUTH]
    assert not any(alone.posterior.identified[k] for k in open_ones)
    assert posterior.predicted == pytest.approx([repose(TRUTH), drum(TRUTH)], abs=0.5)
    # The chosen point hits both, in fresh pours as well.
    assert np.abs(both.optimum.compromise.standardised).max() < 1.0
    assert both.optimum.compromise.desirability == pytest.approx([1.0, 1.0], abs=0.3)
    assert [test.simulated.mean for test in both.verification.tests] == pytest.approx(
        [repose(TRUTH), drum(TRUTH)], abs=0.8
    )


def test_the_walk_leads_to_where_all_targets_are_met(both):
    walk = both.ascent
    names = [factor.path for factor in walk.factors]
    # The first target alone asks for more of both factors in equal parts. The drum's angle falls by that, and has to
    # rise.
    centre, along = ({path: CENTRES[path][0] + share * CENTRES[path][1] for path in TRUTH} for share in (0.0, 0.5))
    assert drum(along) < drum(centre) < drum(TRUTH)
    direction = dict(zip(names, walk.path.direction.tolist(), strict=True))
    assert direction[FRICTION] == pytest.approx(1.0)
    assert direction[MODULUS] == pytest.approx(coded(TRUTH, MODULUS) / coded(TRUTH, FRICTION), abs=0.15)
    assert (walk.approach.reached, walk.approach.resolved) == (True, True)
    assert [one.observable for one in walk.walks] == ["angle_of_repose_deg", "drum/dynamic_angle_deg"]
    place = np.array([np.interp(walk.approach.position, range(len(walk.means)), one) for one in walk.path.natural.T])
    for path, at in zip(names, place.tolist(), strict=True):
        if path in TRUTH:
            assert coded({path: at}, path) == pytest.approx(coded(TRUTH, path), abs=0.15)
    assert walk.line.startswith("All 2 targets together are missed least at step ")
    # The surface stands around that place, and no longer over the whole of the ranges.
    region = both.surface.region
    for factor, centre, half in zip(both.surface.factors, region.centre, region.half_width, strict=True):
        assert half < 0.3 * (factor.high - factor.low)
        if factor.path in TRUTH:
            assert centre - half < TRUTH[factor.path] < centre + half
    assert walk.path.predicted == pytest.approx(
        [repose(dict(zip(names, one, strict=True))) for one in walk.path.natural.tolist()], abs=0.5
    )
    assert walk.others[0].predicted == pytest.approx(
        [drum(dict(zip(names, one, strict=True))) for one in walk.path.natural.tolist()], abs=0.5
    )


def test_a_walk_that_meets_not_all_targets_leaves_the_whole_of_the_ranges():
    found = campaign(of_truth(off=15.0))
    assert not found.ascent.approach.reached
    assert "does not meet all of them" in found.ascent.line
    region = found.surface.region
    for factor, centre, half in zip(found.surface.factors, region.centre, region.half_width, strict=True):
        assert (centre - half, centre + half) == pytest.approx((factor.low, factor.high))


def test_one_target_is_walked_to_along_its_own_effects():
    found = campaign(of_truth(both=False))
    walk, own = found.ascent, found.screening.target_analysis
    effects = {effect.name: effect.effect for effect in own.effects}
    factors = [AscentFactor(f.name, float(f.low), float(f.high), effects[f.name]) for f in walk.factors]
    held = [f for f in found.screening.factors if f not in walk.factors]
    mean = own.mean + sum(effects[f.name] / 2.0 * f.coded(f.reference) for f in held)
    path = ascent_path(factors, mean, steps=PROFILE.ascent_steps)
    target = of_truth().targets[0]
    met = bracket(walk.means, target.mean, standard_errors=walk.standard_error)
    assert walk.path.predicted == pytest.approx(path.predicted)
    # To the last bit.
    path = dataclasses.replace(path, predicted=walk.path.predicted)
    assert walk.path.to_dict() == path.to_dict()
    assert walk.bracket.to_dict() == met.to_dict()
    assert walk.region.to_dict() == region_around(path, met).to_dict()
    assert (walk.others, walk.approach) == ((), None)


def test_targets_that_contradict_each_other_are_told():
    found = campaign(of_truth(off=15.0)).optimum
    assert found.posterior.p < 1e-6
    assert "contradict" in found.compromise.statement
    assert not (found.compromise.desirability > 0).all()


def test_a_factor_that_acts_on_the_second_target_alone_is_selected(both):
    def only_there(values):
        return drum(values) + 5.0 * coded(values, BOUNCE)

    one = of_truth()
    runner = FormulaRunner(repose, sigma=0.5, experiments={"drum": {"dynamic_angle_deg": only_there}})
    found = run_campaign(one, PROFILE, runner, dict.fromkeys(one.estimators, ((0.0, 0.1),) * 3)).stages
    reasons = {chosen.name: chosen.reason for chosen in found.screening.selected}
    assert reasons["X16"] == "significant in drum/dynamic_angle_deg"
    # The walk heeds that target, so that its direction is none of noise.
    assert not any("X16" in note for note in found.ascent.notes)
    assert any("X16" in note for note in both.ascent.notes)
    # Where it acts nowhere it comes from the fallback list.
    assert {chosen.name: chosen.reason for chosen in both.screening.selected}["X16"] == "fallback: not significant"


def test_the_result_is_read_back_from_its_text(both):
    again = AllStages.from_dict(json.loads(json.dumps(both.to_dict(), allow_nan=False)))
    assert again.optimum.posterior.to_dict() == both.optimum.posterior.to_dict()
    assert {run.experiment for _, run in again.all_runs()} == {"", "drum"}
    assert all(not run.experiment for run in again.own_runs_of("verification"))
    assert len(again.own_runs_of("verification")) == PROFILE.verification_runs
