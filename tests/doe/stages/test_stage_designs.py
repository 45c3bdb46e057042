"""Stages take their designs from the study file: what is planted is found by each, and what cannot do is refused."""

import copy
import dataclasses
import json
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from doe.analysis.pilot import Noise
from doe.analysis.power import main_effect_efficiency, smallest_main_effect
from doe.errors import StudyFileError
from doe.stages import planned_runs
from doe.stages.ascent import AscentResult
from doe.stages.pilot import PilotResult
from doe.stages.scan import ScanResult
from doe.studies.campaign import run_campaign
from doe.studies.profile import Profile
from doe.studies.study import load_study, study_from, with_profile
from solver import ParameterError, asset_path
from tests.doe.formula_runner import FormulaRunner

PATH = asset_path("studies", "sunflower_extract")
TABLE = tomllib.loads(PATH.read_text())
BIAS = dict.fromkeys(load_study("sunflower_extract").estimators, ((0.0, 0.1),) * 3)
PROFILE = Profile("test", pilot_runs=10, change_runs=2, verification_runs=6, mass=0.03)
FRICTION, MODULUS = "pair.seed.seed.static_friction", "material.seed.shear_modulus"


def planted(values):
    """Two factors of the study act, the friction with a curvature, nothing else."""
    friction = (float(values.get(FRICTION, 0.57)) - 0.595) / 0.125
    modulus = (float(values.get(MODULUS, 56.3e6)) - 55.3e6) / 15.2e6
    return 24.0 + 4.0 * friction + 3.0 * modulus - 0.5 * friction**2


def study_with(**tables):
    """The shipped study with more tables."""
    return study_from(copy.deepcopy(TABLE) | tables, PATH)


@pytest.mark.parametrize(
    ("screening", "rows"),
    [
        ({"design": "plackett-burman", "runs": 32}, 32),
        ({"fold": True}, 56),
        ({"design": "definitive-screening"}, 49),
        ({"design": "lhs", "runs": 80, "seed": 5}, 80),
        ({"design": "sobol", "runs": 64}, 64),
    ],
)
def test_each_screening_finds_what_is_planted(screening, rows):
    study = study_with(screening=screening)
    runner = FormulaRunner(planted, sigma=0.3)
    found = run_campaign(study, PROFILE, runner, BIAS).stages
    # Holm's level leaves one false find in twenty studies, and a square leaks where columns are not orthogonal to it.
    significant = found.screening.analysis.significant()
    assert {"X4", "X7"} <= set(significant)
    assert len(significant) <= 3
    effects = {effect.name: effect.effect for effect in found.screening.analysis.effects}
    # Four standard errors, 8 σ/√(efficiency × rows × 3); the curvature is clear of the effects or below them.
    coded = study.screening_design.points(len(study.factors)).coded
    error = 2 * 0.3 / np.sqrt(main_effect_efficiency(coded) * rows * PROFILE.screening_replicates)
    assert effects["X7"] == pytest.approx(8.0, abs=4 * error + 0.1)
    assert effects["X4"] == pytest.approx(6.0, abs=4 * error + 0.1)
    assert len(found.screening.runs) == rows
    assert runner.calls["screening"] == planned_runs(study, PROFILE)["screening"] == rows * PROFILE.screening_replicates


@pytest.mark.parametrize(
    ("surface", "points"),
    [
        ({"centre": 3}, 15),
        ({"design": "central-composite"}, 19),
        ({"design": "central-composite", "alpha": "inscribed", "centre": 2}, 16),
        ({"design": "factorial", "centre": 3}, 0),
        ({"design": "sobol", "runs": 16}, 16),
    ],
)
def test_each_surface_that_bears_a_second_order_model_reaches_the_target(surface, points):
    if points == 0:
        with pytest.raises(StudyFileError, match=r"surface\.design: the 11 rows of factorial cannot tell apart the 10"):
            study_with(surface=surface)
        return
    study = study_with(surface=surface)
    found = run_campaign(study, PROFILE, FormulaRunner(planted, sigma=0.2), BIAS).stages
    assert len(found.surface.design) == points
    assert planned_runs(study, PROFILE)["surface"] == points * PROFILE.surface_replicates
    assert planted(found.optimum.values) == pytest.approx(24.68, abs=0.4)


def test_the_result_says_which_designs_were_run():
    from doe.studies.study_result import StudyDescription

    study = study_with(screening={"design": "definitive-screening"}, surface={"design": "central-composite"})
    said = StudyDescription.of(study, PROFILE)
    assert said.designs == {
        "screening": "definitive screening",
        "assumptions": "Plackett–Burman",
        "surface": "central composite",
    }
    # A result from before there was a choice has no such key.
    data = json.loads(json.dumps(said.to_dict()))
    del data["designs"]
    assert StudyDescription.from_dict(data).designs["surface"] == "Box–Behnken"


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"screening": {"design": "taguchi"}}, r"screening\.design: 'taguchi' is not one of plackett-burman, def"),
        ({"screening": {"runs": 24}}, r"24 in the plackett-burman design of \[screening\]: runs = 24: has 23 columns"),
        ({"screening": {"runs": "28"}}, r"screening\.runs: '28' is not a whole number"),
        ({"screening": {"fold": 1}}, r"screening\.fold: 1; allowed: true or false"),
        ({"screening": {"design": "lhs", "fold": True}}, r"screening\.fold: unknown key; allowed: design, runs, seed"),
        ({"screening": {"design": "lhs", "runs": 20}}, "lhs cannot tell the main effects of 24 factors apart"),
        ({"assumptions": {"runs": 8}}, "6 assumptions with 3 dummies; allowed: up to 4 in a 8-run"),
        (
            {"assumptions": {"design": "box-behnken"}},
            "box-behnken has levels between low and high, which sphere_resolution has",
        ),
        ({"surface": {"design": "central-composite", "alpha": "rotatable"}}, "points 1.68 times as far out"),
        ({"surface": {"design": "definitive-screening"}}, r"the 9 rows of definitive-screening cannot tell apart"),
        (
            {"surface": {"design": "factorial", "generators": "C=AB"}},
            r"surface\.generators: .*; allowed: a list of names",
        ),
    ],
)
def test_a_design_that_cannot_do_is_refused_with_its_key(tables, message):
    with pytest.raises((ParameterError, StudyFileError), match=message):
        study_with(**tables)


def test_a_surface_without_a_run_for_the_error_is_refused_before_anything_is_poured():
    study = study_with(surface={"design": "sobol", "runs": 10})
    one = dataclasses.replace(study, profiles={"one": Profile("one", surface_replicates=1)})
    with pytest.raises(
        ParameterError, match=r"surface_replicates: 1 of 10 points leave no error for the 10 terms .* 2$"
    ):
        with_profile(one, "one")
    two = dataclasses.replace(study, profiles={"two": Profile("two", surface_replicates=2)})
    assert with_profile(two, "two")[1].surface_replicates == 2


def test_with_a_resolution_the_most_replicates_decide_whether_a_surface_has_an_error():
    study = study_with(surface={"design": "sobol", "runs": 10})
    sized = Profile("sized", surface_replicates=1, resolution_deg=1.0, max_replicates=12)
    assert with_profile(dataclasses.replace(study, profiles={"sized": sized}), "sized")
    with pytest.raises(ParameterError, match=r"profile\.sized\.max_replicates: 1 is not a whole number of at least 2"):
        study_with(profile={"sized": {"resolution_deg": 1.0, "max_replicates": 1}})


def test_levels_that_are_impossible_together_are_refused_before_anything_is_poured():
    table = copy.deepcopy(TABLE)
    ends = {"rig.outlet_diameter": (0.03, 0.11, 0.03), "rig.inlet_diameter": (0.1, 0.2, 0.114)}
    table["assumption"] = [
        {"name": path, "path": path, "low": low, "high": high, "reference": reference}
        for path, (low, high, reference) in ends.items()
    ]
    with pytest.raises(StudyFileError, match=r"assumptions: row \d+ of the design is impossible: rig\..*diameter"):
        study_from(table, PATH)


def test_efficiency_is_one_for_orthogonal_two_level_designs_and_the_share_of_moved_rows_otherwise():
    factors = len(TABLE["factor"])
    of = {
        name: main_effect_efficiency(study_with(screening=table).screening_design.points(factors).coded)
        for name, table in (
            ("table", {}),
            ("folded", {"fold": True}),
            ("definitive", {"design": "definitive-screening"}),
        )
    }
    # In 2 m + 1 rows of a definitive screening design each factor is moved in 2 (m − 1).
    assert of == {"table": 1.0, "folded": 1.0, "definitive": pytest.approx(46 / 49)}
    assert smallest_main_effect(1.0, 3, 49, efficiency=46 / 49) > smallest_main_effect(1.0, 3, 49)


def test_the_line_of_a_stage_has_digits_for_an_observable_of_any_size():
    """A share of 0.05 is not 0.1."""
    noise = Noise(runs=6, mean=0.0512, sigma=0.0021, low=0.0013, high=0.0051)
    share = SimpleNamespace(noise={"share": noise}, estimator="share")
    assert PilotResult.line.fget(share).startswith("share 0.0512 ± 0.0021 over 6 seeds (σ 95 % 0.0013 … 0.0051)")
    angle = SimpleNamespace(noise={"angle_deg": dataclasses.replace(noise, mean=24.68)}, estimator="angle_deg")
    assert PilotResult.line.fget(angle).startswith("angle_deg 24.7° ± 0.0° over 6 seeds")
    means = np.array([0.0512, 0.0731])
    walk = SimpleNamespace(
        approach=None, observable="share", means=means, bracket=SimpleNamespace(statement="Between.")
    )
    assert AscentResult.line.fget(walk) == "0.0512, 0.0731. Between."
    scanned = SimpleNamespace(path="h", values=(1, 2), observable="share", means=means, smallest_difference=0.02)
    assert ScanResult.line.fget(scanned) == "h: 1 → 0.0512, 2 → 0.0731; smallest difference seen 0.02"


def test_a_walk_is_predicted_from_where_the_other_factors_stay():
    """Factors that are not walked stay at their references, off the middles of their ranges; without noise."""
    study = study_with()
    by_name = {one.name: one for one in study.factors}
    by_name["X1"] = dataclasses.replace(by_name["X1"], reference=by_name["X1"].level(0.5))
    study = dataclasses.replace(study, factors=tuple(by_name.values()))
    slopes = {"X7": 4.0, "X4": 3.0, "X16": 2.0, "X1": 1.0}

    def formula(values):
        levels = {name: by_name[name].coded(values.get(by_name[name].path, by_name[name].reference)) for name in slopes}
        return 24.0 + sum(slope * levels[name] for name, slope in slopes.items())

    walked = run_campaign(study, PROFILE, FormulaRunner(formula, sigma=1e-6), BIAS).stages.ascent
    assert "X1" not in [factor.name for factor in walked.factors]
    assert walked.path.predicted == pytest.approx(walked.means, abs=1e-4)
