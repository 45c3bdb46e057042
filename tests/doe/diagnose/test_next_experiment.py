"""Discrimination between models by hand-computed Gaussians."""

import math

import numpy as np
import pytest

from doe.diagnose.next_experiment import (
    MenuItem,
    Prediction,
    discrimination,
    gaussian_divergence,
    rank_experiments,
    replicates_for_odds,
)
from doe.errors import StatisticsError

WEIGHTS = {"a": 0.5, "b": 0.5}


def item(gap, own=0.0, name="x", d=1):
    zero, wide = np.zeros(d), own * np.eye(d)
    return MenuItem(name, {"a": Prediction(zero, wide), "b": Prediction(zero + gap, wide)}, np.eye(d))


def test_replicates_are_those_of_the_likelihood_ratio():
    """Known predictions: E ln odds = n gap^2/2, so n = 2 ln(20)/gap^2."""
    for gap in (0.5, 1.0, 2.0):
        assert replicates_for_odds(item(gap), ("a", "b")) == math.ceil(2 * math.log(20) / gap**2)


def test_no_number_of_replicates_beats_an_uncertain_prediction():
    """Own variance 1 on each side: E ln odds never exceeds gap^2/2 = 0.5 < ln 20."""
    assert replicates_for_odds(item(1.0, own=1.0), ("a", "b")) is None


def test_divergence_of_gaussians():
    """KL(N(0, 4) || N(1, 1)) = (4 - 1 + 1 - ln 4)/2."""
    one, four = np.eye(1), 4 * np.eye(1)
    assert gaussian_divergence(np.zeros(1), four, np.ones(1), one) == pytest.approx((4 - math.log(4)) / 2)


def test_score_by_hand():
    """One summary, gap 2, six pours: V = 1/6. Shares 0.45, 0.45, 0.1; outside: mean 1, variance 9 + 1."""
    v = 1 / 6
    pair = 0.45**2 * (4 / (2 * v) + 2 * v / (2 * v) - 1)
    rival = 2 * 0.45 * 0.1 * ((1 + 2 * v) / (2 * v + 10) - 1)
    assert discrimination(item(2.0), WEIGHTS, 6) == pytest.approx(pair + rival)


def test_the_menu_is_ranked_and_set_ups_that_say_nothing_come_last():
    menu = [item(0.0, name="same"), item(3.0, name="apart"), item(3.0, own=9.0, name="vague"), item(1.0, name="near")]
    found = rank_experiments(menu, WEIGHTS, replicates=6)
    assert [row.name for row in found] == ["apart", "near", "same", "vague"]
    assert found[0].replicates == 1
    assert found[0].separation == pytest.approx(3.0)
    # What no model can predict (own variance 9 against a gap of 3) is worse than repeating what all agree on.
    assert found[2].replicates is None
    assert found[2].score <= 0


def test_idle_summaries_do_not_raise_the_score():
    padded = MenuItem(
        "x",
        {"a": Prediction(np.zeros(5), np.zeros((5, 5))), "b": Prediction(np.eye(5)[0] * 2, np.zeros((5, 5)))},
        np.eye(5),
    )
    assert discrimination(padded, WEIGHTS, 6) <= discrimination(item(2.0), WEIGHTS, 6)


def test_bad_menus_are_refused():
    with pytest.raises(StatisticsError, match="at least 2"):
        rank_experiments([item(1.0)], {"a": 1.0}, 6)
    with pytest.raises(StatisticsError, match="no prediction by c"):
        rank_experiments([item(1.0)], {"a": 1.0, "c": 1.0}, 6)
