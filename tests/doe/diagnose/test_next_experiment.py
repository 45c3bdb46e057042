"""The chance of an answer against closed forms of Gaussians."""

import math

import numpy as np
import pytest
from scipy import stats

from doe.diagnose.next_experiment import (
    DRAWS,
    CandidateExperiment,
    Prediction,
    chance_of_an_answer,
    fewest_pours,
    rank_experiments,
)
from doe.diagnose.posterior import TEMPERATURE
from doe.diagnose.verdict import NOTHING_FROM
from doe.diagnose.verdict import THRESHOLD as SURE

WEIGHTS = {"a": 0.5, "b": 0.5}


def item(gap, own=0.0, name="x", d=1):
    zero, wide = np.zeros(d), own * np.eye(d)
    return CandidateExperiment(name, {"a": Prediction(zero, wide), "b": Prediction(zero + gap, wide)})


@pytest.mark.parametrize(("gap", "pours", "own"), [(0.5, 6, 0.0), (1.0, 6, 0.0), (1.0, 12, 0.0), (1.0, 6, 0.1)])
def test_the_chance_is_that_of_the_likelihood_ratio(gap, pours, own):
    """With s = gap/√(1/n + own) the log odds of the truth are T N(s²/2, s²): ≥ ln 9 with Φ(s/2 − ln 9/(T s))."""
    s = gap / math.sqrt(1.0 / pours + own)
    expected = stats.norm.cdf(0.5 * s - math.log(SURE / (1.0 - SURE)) / (TEMPERATURE * s))
    found = chance_of_an_answer(item(gap, own), WEIGHTS, pours)
    # Three standard errors of a share of 2 x DRAWS made-up data sets.
    assert found == pytest.approx(expected, abs=3.0 * math.sqrt(expected * (1.0 - expected) / (2 * DRAWS)))


def test_answers_of_one_mean_are_told_apart_by_how_sure_they_are():
    """Both at 0, deviations s and 30 s: the log odds of the narrow one are T (ln 30 − x² (1 − 1/900)/(2 s²))."""
    zero, narrow, wide = np.zeros(1), 1e-6 * np.eye(1), (900.0 / 6.0 - 1.0 / 6.0) * np.eye(1)
    one = CandidateExperiment("x", {"a": Prediction(zero, narrow), "b": Prediction(zero, wide)})
    sure, scale = math.log(SURE / (1.0 - SURE)) / TEMPERATURE, 0.5 * (1.0 - 1.0 / 900.0)
    below = stats.chi2.cdf((math.log(30.0) - sure) / scale, 1)
    above = stats.chi2.sf((math.log(30.0) + sure) / scale / 900.0, 1)
    # Three standard errors of shares of DRAWS made-up data sets each.
    found = chance_of_an_answer(one, WEIGHTS, 6)
    assert found == pytest.approx(0.5 * (below + above), abs=3.0 * 0.5 * math.sqrt(0.25 / DRAWS + 0.1 / DRAWS))
    assert 0.4 < below < 0.7 < above


def test_a_likely_answer_needs_less():
    near = chance_of_an_answer(item(1.0), {"a": 0.85, "b": 0.15}, 6)
    assert near > chance_of_an_answer(item(1.0), WEIGHTS, 6)


def test_an_answer_of_no_weight_at_all_leaves_the_chance_as_it_is():
    gone, hardly = (chance_of_an_answer(item(2.0), {"a": 0.9, "b": p}, 6) for p in (0.0, 1e-12))
    assert gone == hardly > 0.8
    assert fewest_pours([item(2.0)], {"a": 0.9, "b": 0.0})[1][0].chance > 0.8


def test_nothing_missing_is_an_answer_with_less():
    s = math.sqrt(6.0)
    named, nothing = (
        stats.norm.cdf(0.5 * s - math.log(sure / (1.0 - sure)) / (TEMPERATURE * s)) for sure in (SURE, NOTHING_FROM)
    )
    one = CandidateExperiment("x", {"base" if k == "b" else k: p for k, p in item(1.0).predictions.items()})
    found = chance_of_an_answer(one, {"a": 0.5, "base": 0.5}, 6)
    assert found == pytest.approx(0.5 * (named + nothing), abs=3.0 * math.sqrt(0.25 / (2 * DRAWS)))


def test_answers_that_nothing_was_poured_for_fare_as_the_wrong_ones_do():
    """Beside one half as probable as each of two, the wrong one counts twice: the odds have to reach 18, not 9."""
    s = math.sqrt(6.0)
    expected = 0.8 * stats.norm.cdf(0.5 * s - math.log(1.5 * SURE / (1.0 - SURE)) / (TEMPERATURE * s))
    found = chance_of_an_answer(item(1.0), {"a": 0.4, "b": 0.4}, 6)
    assert found == pytest.approx(expected, abs=3.0 * math.sqrt(0.25 / (2 * DRAWS)))


def test_the_candidates_are_ranked_and_set_ups_that_say_nothing_come_last():
    candidates = [
        item(0.0, name="same"),
        item(3.0, name="apart"),
        item(3.0, own=9.0, name="vague"),
        item(1.0, name="near"),
    ]
    found = rank_experiments(candidates, WEIGHTS, replicates=6)
    assert [row.name for row in found] == ["apart", "near", "vague", "same"]
    assert found[0].separation == pytest.approx(3.0)
    assert found[-1].chance == 0.0


@pytest.mark.parametrize(
    ("gap", "own", "pours"),
    [
        (4.0, 0.0, 6),  # six tell them apart; below, chances of 6, 12 and 24 pours by the formula above
        (1.5, 0.0, 12),  # 0.83, 0.98, 1.00
        (1.0, 0.0, 24),  # 0.48, 0.80, 0.97
        (3.0, 9.0, 6),  # what is not known of either answer keeps them together
    ],
)
def test_the_fewest_pours_that_do_nearly_as_well_are_asked_for(gap, own, pours):
    assert fewest_pours([item(gap, own), item(0.0, name="same")], WEIGHTS)[0] == pours


def test_an_effect_is_found_with_whatever_is_beside_it():
    """ "a" and "a+b" predict the same, "c" something far off: "a", the more probable, is named for both."""
    near, far, exact = np.zeros(1), np.full(1, 1e3), np.zeros((1, 1))
    one = CandidateExperiment(
        "x", {"a": Prediction(near, exact), "a+b": Prediction(near, exact), "c": Prediction(far, exact)}
    )
    assert chance_of_an_answer(one, {"a": 0.5, "a+b": 0.3, "c": 0.2}, 6) == pytest.approx(0.7)
    # Where the pair is the more probable, neither is: no other answer has both.
    assert chance_of_an_answer(one, {"a": 0.3, "a+b": 0.5, "c": 0.2}, 6) == pytest.approx(0.2)
    # Alone, it is a certain answer.
    both = CandidateExperiment("x", {"a": Prediction(near, exact), "a+b": Prediction(near, exact)})
    assert chance_of_an_answer(both, {"a": 0.5, "a+b": 0.3}, 6) == pytest.approx(0.5)
