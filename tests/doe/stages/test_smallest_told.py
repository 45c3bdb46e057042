"""What stages say that they could have seen, and how well a step of a walk is known: by hand and by SciPy."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from doe.analysis.pilot import Noise
from doe.analysis.screening import analyse_screening
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import fit_surface
from doe.analysis.verification import verify
from doe.designs import plackett_burman
from doe.stages.ascent import _approach, _first_order, _walk
from doe.stages.surface import Estimate, OptimumResult, _smallest_main_effect
from doe.stages.verification import _smallest_difference, verification
from doe.studies.profile import Profile
from doe.target import Target
from tests.doe.formula_runner import FormulaRunner

NOISE = Noise(mean=20.0, sigma=1.5, low=1.0, high=2.5, runs=9)
PROFILE = Profile("test", ascent_replicates=4)
TARGET = Target("angle_of_repose_deg", 25.0, 1.2, 9)


def seen(effect, error, df):
    """Chance that a two-sided t test at 5 % sees an effect; the far tail is negligible."""
    return stats.nct.sf(stats.t.isf(0.025, df), df, effect / error)


def walk(*steps, target=TARGET):
    return _walk(np.array(steps, dtype=float), np.zeros(len(steps)), target, NOISE, PROFILE)


def test_a_step_is_known_by_the_pilot_s_scatter_of_its_valid_pours():
    found = walk([20.0, 22.0, 24.0, 22.0], [20.0, np.nan, 30.0, np.nan], [24.0, np.nan, np.nan, np.nan], [np.nan] * 4)
    assert found.means == pytest.approx([22.0, 25.0, 24.0, np.nan], nan_ok=True)
    assert found.sd == pytest.approx([math.sqrt(8 / 3), math.sqrt(50.0), np.nan, np.nan], nan_ok=True)
    assert found.standard_error[:3] == pytest.approx([1.5 / 2, 1.5 / math.sqrt(2), 1.5])
    assert found.relative_error_percent == pytest.approx([12.0, 0.0, 4.0, np.nan], nan_ok=True)


def test_the_centre_of_a_screening_is_known_by_all_of_its_runs():
    """Twelve rows of two pours: 1.5/√24, beside 1.2/√9 of the target; the effects are those of the target."""
    design, names = plackett_burman(12)[:, :5], tuple("ABCDE")
    values = 20 + design @ [2.0, 0, -1, 0, 0] + np.array([[0.1], [-0.1]])
    screened = SimpleNamespace(target_analysis=analyse_screening(design, names, values.T, ()), further_analyses={})
    model = _first_order(screened, [SimpleNamespace(name=name) for name in "CA"], [], TARGET, NOISE)
    assert (model.mean, model.goal, model.weight) == (pytest.approx(20.0), 25.0, 1.0)
    assert model.effects == pytest.approx([-2.0, 4.0])
    assert model.spread == pytest.approx(math.hypot(1.2 / 3, 1.5 / math.sqrt(24)))
    # A at 0.5 of its way up, and as uncertain as that.
    held = SimpleNamespace(name="A", reference=0.6, coded={0.6: 0.5}.get)
    model = _first_order(screened, [SimpleNamespace(name="C")], [held], TARGET, NOISE)
    assert model.mean == pytest.approx(20.0 + 0.5 * 2.0)
    assert model.spread == pytest.approx(math.hypot(1.2 / 3, 1.5 * math.sqrt((1.0 + 0.25) / 24)))


def test_two_steps_that_differ_so_much_are_told_apart_by_80_percent():
    """Two means of four pours each, their scatter known by the pilot's eight degrees of freedom."""
    found = walk([20.0] * 4, [21.0] * 4)
    assert seen(found.smallest_difference, 1.5 * math.sqrt(2 / 4), 8) == pytest.approx(0.8, abs=1e-3)


def test_a_target_of_zero_has_no_relative_error():
    found = walk([1.0] * 4, [-1.0] * 4, target=dataclasses.replace(TARGET, mean=0.0))
    assert np.isnan(found.relative_error_percent).all()


def test_a_walk_to_several_targets_counts_the_errors_of_both_sides():
    """√((1.5/2)² + (1.2/3)²) = 0.85 of the first, 1.5/2 of one that is exact."""
    exact = Target("apex_height_m", 24.0)
    found = _approach([walk([25.0] * 4, [26.7] * 4), walk([24.0] * 4, [22.5] * 4)], [TARGET, exact])
    assert found.standardised == pytest.approx(np.array([[0.0, 2.0], [0.0, -2.0]]))


@pytest.mark.parametrize("names", ["AB", "BA"])
def test_the_factor_that_the_surface_tells_worst_is_the_one_that_counts(names):
    """3² points of which B moves by half, three runs each: Var(b_B) = s²/(27 · 2/3 · 1/4), 21 degrees of freedom."""
    levels = (-1.0, 0.0, 1.0)
    design = np.array([(a, b / 2) for a in levels for b in levels])[:, [0, 1] if names == "AB" else [1, 0]]
    region = Region(tuple(names), np.zeros(2), np.ones(2), ())
    model = fit_surface(design, 20 + np.random.default_rng(2).normal(0, 1.3, (9, 3)), region)
    error = 2 * math.sqrt(model.mse / (27 * 2 / 3 / 4))
    assert seen(_smallest_main_effect(model), error, 27 - 6) == pytest.approx(0.8, abs=1e-3)


def test_the_verification_could_have_seen_what_welch_s_test_sees():
    runs, other = np.random.default_rng(1).normal(24.0, 2.0, 7), np.random.default_rng(2).normal(25.0, 1.0, 12)
    test = stats.ttest_ind(runs, other, equal_var=False)
    error = (runs.mean() - other.mean()) / test.statistic
    found = _smallest_difference(verify(runs, other.mean(), other.std(ddof=1), 12))
    assert seen(found, error, test.df) == pytest.approx(0.8, abs=1e-3)
    # A bare printed mean is exact: t with the six degrees of freedom of the runs.
    bare = _smallest_difference(verify(runs, 25.0, None, None))
    assert seen(bare, runs.std(ddof=1) / math.sqrt(7), 6) == pytest.approx(0.8, abs=1e-3)
    assert math.isnan(_smallest_difference(verify(runs[:1], 25.0, 1.0, 12)))


FACTORS = (SimpleNamespace(path="a"), SimpleNamespace(path="b"))
SINGLE = SimpleNamespace(
    identifies=lambda k: k == 0,
    point_low=[1.0, 2.0],
    point_high=[3.0, 4.0],
    solution_low=[0.0] * 2,
    solution_high=[9.0] * 2,
)


def test_a_factor_has_the_interval_of_its_point_or_the_range_that_gives_the_target():
    found = OptimumResult({"a": 2.0, "b": 3.0}, FACTORS, SINGLE, None).estimates
    assert found == {"a": Estimate(2.0, 1.0, 3.0, True), "b": Estimate(3.0, 0.0, 9.0, False)}


@pytest.mark.parametrize(("p", "known"), [(0.5, True), (0.011, True), (0.009, False)])
def test_targets_that_contradict_each_other_identify_nothing(p, known):
    joint = SimpleNamespace(low=[1.5, 0.0], high=[2.5, 9.0], identified=(True, False), p=p)
    found = OptimumResult({"a": 2.0, "b": 3.0}, FACTORS, SINGLE, SimpleNamespace(), joint).estimates
    assert found == {"a": Estimate(2.0, 1.5, 2.5, known), "b": Estimate(3.0, 0.0, 9.0, False)}


def test_every_target_is_verified_within_its_own_margin():
    targets = (dataclasses.replace(TARGET, margin=0.5), Target("bulk_density_kg_m3", 270.0, 2.0, 9, margin=7.0))
    study = SimpleNamespace(targets=targets, all_experiments=("",))
    found = verification(
        study, dataclasses.replace(PROFILE, verification_runs=5), FormulaRunner(lambda values: 24.0), {}
    )
    assert [test.equivalence.margin for test in found.tests] == [0.5, 7.0]
    assert len(found.runs) == 5
    assert [test.target.mean for test in found.tests] == [25.0, 270.0]
