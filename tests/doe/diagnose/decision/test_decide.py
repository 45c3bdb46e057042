"""Verdicts in the linear toy world, where the truth is known; rates against published ones within Wilson intervals."""

import json
from dataclasses import replace

import numpy as np
import pytest

from doe.diagnose.decision.decide import diagnose, judge
from doe.diagnose.decision.gates import Limits
from doe.diagnose.follow_up.confirm import fitted
from doe.diagnose.runs import Condition, Effect, Observed
from doe.errors import StatisticsError
from tests.doe.diagnose.toy import (
    FULL,
    SIGMA,
    known_emulator,
    make_toy,
    simulated_runs,
)


def verdict_of(shift, seed=0, summaries=12, **options):
    toy = make_toy(summaries, seed)
    emulator = known_emulator(toy, np.random.default_rng([seed, 1]), df=200)
    return judge(emulator, toy.measured(np.random.default_rng([seed, 2]), shift(toy)), bootstrap=500, **options)


def test_a_strong_effect_is_named_with_its_amplitude():
    verdict = verdict_of(lambda toy: toy.listed(5, 10.0))
    assert (verdict.kind, verdict.names) == ("effect:e5", ("e5",))
    (amplitude,) = verdict.amplitudes
    # One set: four standard errors of 1/20.
    assert amplitude.value == pytest.approx(0.5, abs=4 / FULL)
    assert amplitude.low < amplitude.value < amplitude.high
    assert amplitude.standard_error == pytest.approx(1 / FULL, rel=0.25)
    # The bootstrap interval is that of the standard error in a linear world, and a little wider for the estimated
    # covariance.
    assert (amplitude.high - amplitude.low) / (2 * 1.96 * amplitude.standard_error) == pytest.approx(1.05, abs=0.15)
    assert verdict.models[0].label == "e5"
    assert {model.label for model in verdict.models} == {"base", *(f"e{i}" for i in range(8))}
    winner = verdict.effects[5]
    assert (winner.delta, winner.cosine) == (0.0, pytest.approx(1.0))
    assert winner.weight > 0.8
    assert all(gate.passed for gate in verdict.gates)
    assert verdict.signatures.residual_cosine[5] > 0.8
    assert max(abs(r.z_after) for r in verdict.residuals) < max(abs(r.z_before) for r in verdict.residuals)
    json.dumps(verdict.to_dict(), allow_nan=False)


def test_nothing_is_found_in_noise():
    verdict = verdict_of(lambda toy: np.zeros(12))
    assert (verdict.kind, verdict.names, verdict.amplitudes) == ("no_missing_effect", (), ())
    assert verdict.t2_after == verdict.t2_before


def test_an_effect_outside_the_list_stays_unexplained():
    verdict = verdict_of(lambda toy: toy.outside(np.random.default_rng(9), 12.0))
    assert verdict.kind == "unexplained"
    assert verdict.where[0].startswith("one: T2")


def between_twins(**options):
    """Halfway between two signatures at cosine 0.9, at 6 sigma, with replicates whose mean is exact."""
    toy = make_toy(12, 0)
    data = toy.measured(np.random.default_rng(0), np.zeros(12)).blocks[0]
    exact = data - data.mean(axis=0) + (toy.listed(0, 6.0) + toy.listed(1, 6.0)) / 2
    emulator = known_emulator(toy, np.random.default_rng([0, 1]), df=200)
    return judge(emulator, Observed((exact,), (np.zeros(12),)), bootstrap=500, **options)


def test_twins_are_not_told_apart():
    verdict = between_twins()
    assert verdict.kind.startswith("ambiguous:")
    assert set(verdict.names) == {"e0", "e1"}
    # Each rival goes into the next experiment as it fits the data by itself, not with the parameters of the other.
    one, other = (fitted(verdict, name) for name in verdict.names)
    assert [name for name, _ in (*one.effects, *other.effects)] == list(verdict.names)
    assert np.abs(np.subtract(one.theta, other.theta)).max() > 1e-3
    assert one.theta == tuple(p.after for p in verdict.parameters)


def test_a_twin_that_is_ruled_out_leaves_the_answer_to_the_other():
    both = between_twins()
    best, other = both.names
    verdict = between_twins(ruled_out=(best,))
    assert (verdict.kind, verdict.names, verdict.ruled_out) == (f"effect:{other}", (other,), (best,))
    # Everything that the verdict says of its final model is said of the one that is left.
    left = fitted(both, other)
    assert [a.effect for a in verdict.amplitudes] == [other]
    assert left.theta == tuple(p.after for p in verdict.parameters)
    assert left.effects[0][1] == tuple(a.value for a in verdict.amplitudes)
    assert verdict.t2_after == next(m.t2 for m in both.models if m.label == other)
    assert verdict.residuals != both.residuals
    # What the fitted data say of the race stays, and the one that is left is asked whether it fits.
    assert [(m.label, m.criterion) for m in verdict.models] == [(m.label, m.criterion) for m in both.models]
    assert [(g.name, g.passed) for g in verdict.gates if g.name.startswith("adequate")] == [
        (f"adequate: {best}", True),
        (f"adequate: {other}", True),
    ]
    assert between_twins(ruled_out=(other,)).names == (best,)
    assert between_twins(ruled_out=both.names).kind == both.kind


def test_what_is_left_must_fit_by_itself():
    best, other = between_twins().names
    p = {g.name: g.p for g in between_twins(ruled_out=(best,)).gates if g.name.startswith("adequate")}
    # The limit between the p values of the two: the best one fits, the other does not.
    between = (p[f"adequate: {best}"] + p[f"adequate: {other}"]) / 2
    assert p[f"adequate: {other}"] < between < p[f"adequate: {best}"]
    verdict = between_twins(ruled_out=(best,), limits=Limits(adequate=between))
    assert (set(verdict.names), verdict.ruled_out) == ({best, other}, ())
    assert [a.effect for a in verdict.amplitudes] == [best]


def test_two_strong_effects_are_named_as_a_pair():
    verdict = verdict_of(lambda toy: toy.listed(5, 12.0) + toy.listed(7, 12.0))
    assert verdict.kind == "effects:e5+e7"
    assert {a.effect for a in verdict.amplitudes} == {"e5", "e7"}


def test_a_verdict_repeats_with_its_seed():
    first, second = (verdict_of(lambda toy: toy.listed(5, 5.0)).to_dict() for _ in range(2))
    assert first == second


def test_an_effect_that_cannot_reach_three_sigma_is_not_raced():
    toy = make_toy(12, 0)
    emulator = known_emulator(toy, np.random.default_rng([0, 1]), df=200)
    weak = replace(emulator, high=tuple(np.full(1, 0.1 if e == 5 else 1.0) for e in range(8)))
    verdict = judge(weak, toy.measured(np.random.default_rng([0, 2]), toy.listed(5, 10.0)), bootstrap=500)
    assert verdict.effects[5].status == "not identifiable here"
    assert verdict.effects[5].reach == pytest.approx(2.0, rel=0.3)
    assert "e5" not in verdict.names


def test_an_effect_without_runs_is_listed_as_not_simulated():
    toy = make_toy(12, 0)
    effects = (*toy.declared.effects, Effect("later", (0.0,), (1.0,)), Effect("faint", (0.0,), (1.0,), unseen=1.5))
    runs = simulated_runs(toy, np.random.default_rng(0), base=60, per_effect=16)
    data = toy.measured(np.random.default_rng(1), toy.listed(5, 10.0))
    verdict = diagnose(replace(toy.declared, effects=effects), runs, data, bootstrap=500)
    assert verdict.effects[8].status == "not simulated"
    assert (verdict.effects[9].status, verdict.effects[9].reach) == ("not identifiable here", 1.5)


def test_two_conditions_count_as_one_vector():
    """The 12 summaries in two conditions of six: same T^2 where the pours of a condition are uncorrelated."""
    toy = make_toy(12, 4)
    runs = simulated_runs(toy, np.random.default_rng(0), base=200, per_effect=40)
    data = toy.measured(np.random.default_rng(1), toy.listed(5, 10.0))
    names = toy.declared.conditions[0].summaries
    split = replace(toy.declared, conditions=(Condition("one", names[:6]), Condition("two", names[6:])))
    halves = [replace(runs, blocks=(runs.blocks[0][:, :6], runs.blocks[0][:, 6:]))]
    parts = Observed((data.blocks[0][:, :6], data.blocks[0][:, 6:]), (np.zeros(6), np.zeros(6)))
    whole = diagnose(toy.declared, runs, data, bootstrap=500)
    two = diagnose(split, halves[0], parts, bootstrap=500)
    assert whole.kind == two.kind == "effect:e5"
    # The estimated correlations between the halves, 150 df, are the only difference.
    assert two.t2_before == pytest.approx(whole.t2_before, rel=0.25)
    assert two.amplitudes[0].value == pytest.approx(0.5, abs=4 / FULL)


def test_units_do_not_matter():
    toy = make_toy(12, 4)
    runs = simulated_runs(toy, np.random.default_rng(0), base=80, per_effect=16)
    data = toy.measured(np.random.default_rng(1), toy.listed(5, 7.0))
    unit = np.geomspace(1e-6, 1e6, 12)
    scaled = replace(runs, blocks=(runs.blocks[0] * unit,))
    one = diagnose(toy.declared, runs, data, bootstrap=500)
    two = diagnose(toy.declared, scaled, Observed((data.blocks[0] * unit,), data.instrument), bootstrap=500)
    assert one.kind == two.kind
    assert two.t2_before == pytest.approx(one.t2_before, rel=1e-5)


def test_a_summary_that_only_an_effect_moves_is_noise_free_in_neither():
    """s11 is zero in the base runs and follows effect 6 alone; data without an effect are zero too."""
    toy = make_toy(12, 4)
    runs = simulated_runs(toy, np.random.default_rng(0), base=80, per_effect=16)
    block = runs.blocks[0].copy()
    own = runs.effect == 6
    block[:, 11] = np.where(own, runs.amplitude[:, 0] * (5 + np.random.default_rng(1).standard_normal(len(own))), 0.0)
    data = toy.measured(np.random.default_rng(2), np.zeros(12)).blocks[0]
    data[:, 11] = 0.0
    null = diagnose(toy.declared, replace(runs, blocks=(block,)), Observed((data,), (np.zeros(12),)), bootstrap=500)
    assert null.kind == "no_missing_effect"
    data[:, :11] += toy.listed(6, 12.0)[:11]
    data[:, 11] = 3.0
    found = diagnose(toy.declared, replace(runs, blocks=(block,)), Observed((data,), (np.zeros(12),)), bootstrap=500)
    assert found.kind == "effect:e6"


def test_a_small_bootstrap_is_refused():
    toy = make_toy(8, 0)
    with pytest.raises(StatisticsError, match="at least 500"):
        judge(known_emulator(toy, np.random.default_rng(0)), toy.measured(np.random.default_rng(1), np.zeros(8)), 100)


def test_detected_shift_is_in_sigma_of_the_mean():
    toy = make_toy(12, 0)
    assert np.linalg.norm(toy.listed(5, 6.0) @ toy.complement) == pytest.approx(6 * SIGMA)
