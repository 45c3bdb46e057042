"""A calibration against an earlier one: equal bits are the same, what differs beyond chance has moved."""

import dataclasses
import math

import pytest
from scipy import stats

from doe.analysis.pilot import Noise
from doe.analysis.t_tests import Sample
from doe.stages.surface import Estimate, OptimumResult
from doe.studies import baseline
from doe.studies.baseline import BaselineError, compare, moved
from doe.studies.study_result import study_from
from tests.explorer.reported_studies import result_of_case


@pytest.fixture(scope="module")
def planted():
    return study_from(result_of_case("planted"))


def by_name(compared):
    return {(one.kind, one.name): one for one in compared}


def test_a_result_has_not_moved_against_itself(planted):
    compared = compare(planted, planted)
    assert {one.answer for one in compared} == {"same"}
    names = {one.name for one in compared if one.kind == "parameter"}
    assert names == set(planted.optimum.values)
    assert {one.name for one in compared if one.kind == "SD between seeds"} == set(planted.pilot.noise)


@pytest.mark.parametrize(
    ("shift", "sd", "n", "answer"),
    [(0.1, 1.0, 40, "same"), (3.0, 1.0, 40, "moved"), (1.8, 2.0, 6, "cannot tell"), (1.9, 0.1, 40, "same")],
)
def test_means_by_welch_and_two_one_sided_tests(shift, sd, n, answer):
    """Balanced: SE = sd √(2/n), df = 2 (n − 1), by hand; the margin is 2."""
    old, new = Sample(24.0, sd, n), Sample(24.0 + shift, sd, n)
    error, df = sd * math.sqrt(2.0 / n), 2 * (n - 1)
    within = abs(shift) + stats.t.ppf(0.95, df) * error < 2.0
    differs = abs(shift) > stats.t.ppf(0.975, df) * error
    assert (within, differs and not within) == (answer == "same", answer == "moved")
    assert baseline._means(old, new, 2.0)[0] == answer


@pytest.mark.parametrize(
    ("ratio", "runs", "answer"), [(1.05, 200, "same"), (2.0, 50, "moved"), (1.2, 10, "cannot tell")]
)
def test_noise_by_the_f_distribution(ratio, runs, answer):
    old, new = (Noise(20.0, sigma, 0.0, 0.0, runs) for sigma in (1.0, ratio))
    assert baseline._spreads(old, new)[0] == answer
    assert (stats.f.sf(ratio**2, runs - 1, runs - 1) < 0.025) == (answer == "moved")
    assert baseline._spreads(new, old)[0] == answer


def test_the_ratio_of_two_spreads_has_the_interval_of_their_own_degrees_of_freedom():
    """(s₂/s₁)²/F, F the 95 % and the 5 % point of 39 and 4 degrees of freedom."""
    old, new = Noise(20.0, 1.0, 0.0, 0.0, 5), Noise(20.0, 2.0, 0.0, 0.0, 40)
    low, high = (2.0 / math.sqrt(stats.f.ppf(share, 39, 4)) for share in (0.95, 0.05))
    answer, why = baseline._spreads(old, new)
    assert f"ratio {low:.3g} … {high:.3g} (90 %)" in why
    assert answer == "cannot tell"
    assert stats.f.sf(4.0, 39, 4) > 0.025


def test_another_verdict_mean_noise_and_parameter_are_named(planted):
    (test,), name = planted.verification.tests, planted.verification.targets[0].observable
    away = dataclasses.replace(test.simulated, mean=test.simulated.mean + 9.0)
    other = dataclasses.replace(test, simulated=away, verdict="different")
    noise = {key: dataclasses.replace(one, sigma=3.0 * one.sigma) for key, one in planted.pilot.noise.items()}
    dropped, *_ = planted.optimum.values
    factors = tuple(one for one in planted.optimum.factors if one.path != dropped)
    now = dataclasses.replace(
        planted,
        verification=dataclasses.replace(planted.verification, tests=(other,)),
        pilot=dataclasses.replace(planted.pilot, noise=noise),
        optimum=dataclasses.replace(planted.optimum, factors=factors),
    )
    compared = by_name(compare(planted, now))
    assert compared["verdict", name].answer == "moved"
    assert compared["mean at the optimum", name].answer == "moved"
    assert compared["SD between seeds", name].answer == "moved"
    assert compared["parameter", dropped].now == "no factor"
    assert compared["parameter", dropped] in moved(tuple(compared.values()))


@pytest.mark.parametrize(
    ("old", "new", "shift", "answer"),
    [
        ("equivalent", "different", 0.05, "moved"),
        ("cannot tell", "equivalent", 0.05, "cannot tell"),
        ("different", "cannot tell", 0.05, "cannot tell"),
        ("cannot tell", "different", 9.0, "moved"),
        ("cannot tell", "cannot tell", 9.0, "same"),
    ],
)
def test_a_verdict_has_moved_from_one_side_to_the_other_or_with_the_means(planted, old, new, shift, answer):
    def told(verdict, mean):
        (test,) = planted.verification.tests
        of = dataclasses.replace(test, simulated=Sample(mean, 2.0, 20), verdict=verdict)
        return dataclasses.replace(planted, verification=dataclasses.replace(planted.verification, tests=(of,)))

    compared = by_name(compare(told(old, 24.0), told(new, 24.0 + shift)))
    assert next(one.answer for (kind, _), one in compared.items() if kind == "verdict") == answer


def test_parameters_by_their_intervals(planted, monkeypatch):
    path, *_ = planted.optimum.values
    factor = next(one for one in planted.optimum.factors if one.path == path)
    width = factor.high - factor.low
    middle = 0.5 * (factor.high + factor.low)

    def answer(shift, half, identified):
        """Of a value with ± ``half``, against one ``shift`` away; both in widths of the declared range."""
        estimates = [{path: estimate(middle + move * width, half * width, identified)} for move in (0.0, shift)]
        seen = iter(estimates)
        monkeypatch.setattr(OptimumResult, "estimates", property(lambda self: next(seen)))
        (one,) = (found for found in compare(planted, planted) if found.kind == "parameter")
        return one.answer

    assert answer(0.01, 0.02, True) == "same"
    assert answer(0.3, 0.1, True) == "moved"
    assert answer(0.12, 0.1, True) == "cannot tell"
    # 95 % of both are ± 0.1: of the difference ± 0.1 √2. Of ± 0.02: 90 % are ± 0.02 √2 · 1.645/1.96 = 0.0237.
    assert (answer(0.14, 0.1, True), answer(0.143, 0.1, True)) == ("cannot tell", "moved")
    assert (answer(0.076, 0.02, True), answer(0.0765, 0.02, True)) == ("same", "moved")
    assert answer(0.1, 0.3, False) == "cannot tell"
    assert answer(0.7, 0.3, False) == "moved"
    # A target out of reach leaves no interval, twice alike.
    assert answer(0.0, math.nan, False) == "same"


def estimate(value, half, identified):

    return Estimate(value, value - half, value + half, identified)


def test_a_result_of_another_target_is_refused(planted):
    target = dataclasses.replace(planted.verification.targets[0], mean=30.0)
    other = dataclasses.replace(planted, verification=dataclasses.replace(planted.verification, targets=(target,)))
    with pytest.raises(BaselineError, match=r"has other targets \(.* = 30.*\) than this study \(.* = 24.*\); allowed"):
        compare(other, planted)
