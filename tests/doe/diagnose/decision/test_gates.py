"""Gates: levels under the null, the rule for the gap, and the bootstrap against a closed form."""

import numpy as np
import pytest
from scipy import stats

from doe.diagnose.decision.gates import Limits, adequate, bootstrap_p, criterion, detect, evidence_weights, unambiguous
from doe.diagnose.fitting.calibrate import calibrate, fit_with_covariance, gather_evidence
from doe.diagnose.fitting.pseudo_data import draw_pseudo_data
from tests.doe.diagnose.toy import known_emulator, make_toy

D, SETS = 8, 40


def detection(seed, shift, df=40, sets=500):
    toy = make_toy(D, seed)
    emulator = known_emulator(toy, np.random.default_rng(seed), df)
    evidence = gather_evidence(emulator, toy.measured(np.random.default_rng([seed, 1]), shift(toy)))
    base = calibrate(emulator, (), evidence)
    singles = {e: fit_with_covariance(emulator.predictor((e,)), (e,), evidence, base.sigma) for e in range(8)}
    return detect(emulator, evidence, base, singles, Limits(), sets, seed), base


def test_p_values_are_uniform_without_an_effect():
    """Both tests of gate 1, covariance on 40 df, SETS data sets with 200 pseudo-data sets each."""
    found = [detection(seed, lambda toy: np.zeros(D), sets=200)[0] for seed in range(SETS)]
    for values in ([d.overall.p for d in found], [d.directed.p for d in found], [d.drop_p[4] for d in found]):
        # Bounded effects often drop T^2 by nothing, and then p is 1 by definition: looked at up to one half, and the
        # share at one half may fall short of it for the same reason.
        assert np.mean(np.array(values) <= 0.5) - 0.5 < 4 * np.sqrt(0.25 / SETS)
        assert abs(np.mean(np.array(values) <= 0.1) - 0.1) < 4 * np.sqrt(0.09 / SETS)
    assert stats.kstest([d.overall.p for d in found], "uniform").pvalue > 0.001


def test_the_overall_p_is_that_of_hotelling():
    """T^2 (nu - m + 1)/(nu m) ~ F(m, nu - m + 1) with m = d - k residual dimensions and nu = 40 (Hotelling 1931)."""
    m = D - 3
    for seed, strength in ((0, 3.0), (1, 4.0), (2, 2.0)):
        found, base = detection(seed, lambda toy, s=strength: toy.listed(4, s), sets=4000)
        exact = stats.f.sf(base.t2 * (40 - m + 1) / (40 * m), m, 40 - m + 1)
        # Binomial error of 4000 sets, four of them, and the 1 % shrinkage of the correlations.
        assert found.overall.p == pytest.approx(exact, abs=4 * np.sqrt(exact * (1 - exact) / 4000) + 0.005)


def test_a_strong_effect_is_seen_and_its_own_drop_is_largest():
    found, base = detection(3, lambda toy: toy.listed(5, 10.0))
    assert found.passed
    assert max(found.drops, key=found.drops.get) == 5
    assert found.drop_p[5] == pytest.approx(1 / 501)
    assert found.drops[5] <= base.t2


def test_adequacy_accepts_the_true_model_at_its_level():
    """At 8 sigma, so at 0.4 of the range; the interval of the refits covers that amplitude."""
    kept, covered = 0, 0
    for seed in range(SETS):
        toy = make_toy(D, seed)
        emulator = known_emulator(toy, np.random.default_rng(seed))
        evidence = gather_evidence(emulator, toy.measured(np.random.default_rng([seed, 2]), toy.listed(4, 8.0)))
        fit = calibrate(emulator, (4,), evidence)
        found = adequate(emulator, evidence, fit, "e4", Limits(), 200, seed)
        low, high = np.percentile(found.refits[:, 3], [2.5, 97.5])
        kept, covered = kept + found.gate.passed, covered + (low <= 0.4 <= high)
    assert stats.binom.ppf(0.0005, SETS, 0.95) <= kept < SETS
    assert stats.binom.ppf(0.0005, SETS, 0.95) <= covered


def test_pseudo_data_repeat_the_mean_and_covariance_of_the_comparison():
    toy = make_toy(D, 0)
    emulator = known_emulator(toy, np.random.default_rng(0))
    evidence = gather_evidence(emulator, toy.measured(np.random.default_rng(1), np.zeros(D)))
    base = calibrate(emulator, (), evidence)
    drawn = draw_pseudo_data(emulator, evidence, base, 4000, 0)
    error = np.sqrt(np.diag(base.sigma[0]) / 4000)
    assert (np.abs(drawn.means[0].mean(axis=0) - base.predictor.mean(base.x)) < 4 * error).all()
    # The relative standard error of a variance of 4000 normal draws is 2.2 %.
    assert drawn.means[0].var(axis=0) == pytest.approx(np.diag(base.sigma[0]), rel=0.09)


def test_bootstrap_p_counts_the_data_itself():
    null = np.array([1.0, 2.0, 3.0, np.nan])
    assert bootstrap_p(2.0, null) == 3 / 4
    assert bootstrap_p(9.0, null) == 1 / 4


def test_gap_names_everything_that_comes_near():
    gate, near = unambiguous({"a": 10.0, "b": 13.9, "c": 14.0}, Limits())
    assert near == ("a", "b")
    assert (gate.statistic, gate.passed) == (pytest.approx(3.9), False)
    gate, near = unambiguous({"a": 10.0, "b": 14.0}, Limits())
    assert (near, gate.passed) == (("a",), True)
    assert unambiguous({"a": 10.0}, Limits())[0].passed


def test_the_criterion_charges_amplitudes_and_uncertainty():
    """Known model: Sigma is that of the base, so B = T^2 + ln d for one amplitude, T^2 for none."""
    toy = make_toy(D, 0)
    emulator = known_emulator(toy, np.random.default_rng(0))
    evidence = gather_evidence(emulator, toy.measured(np.random.default_rng(1), toy.listed(5, 6.0)))
    base, single, pair = (calibrate(emulator, members, evidence) for members in ((), (5,), (5, 6)))
    assert criterion(base, base, evidence) == pytest.approx(base.t2)
    assert criterion(single, base, evidence) == pytest.approx(single.t2 + np.log(D))
    assert criterion(pair, base, evidence) == pytest.approx(pair.t2 + 2 * np.log(D))


def test_weights_are_bayes_factors():
    assert evidence_weights([0.0, 2 * np.log(3)]) == pytest.approx([0.75, 0.25])
