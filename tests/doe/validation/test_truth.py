"""Truths of given strengths: the amplitudes that the reference pours ask for, and nothing beyond the literature."""

import math

import numpy as np
import pytest

from doe.declared.model import CalibratedParameter, CandidateEffect, Declared, DeclaredCondition
from doe.validation.limit import DataKind, Reached, Strength
from doe.validation.truth import Case, strengths_of, truth_of

DECLARED = Declared(
    (CalibratedParameter("friction", 0.4, 0.7, 0.5, 0.05), CalibratedParameter("restitution", 0.2, 0.8)),
    (
        CandidateEffect("push", (0.0,), (2.0,)),
        CandidateEffect("density", (-0.3,), (0.3,)),
        CandidateEffect("tilt", (-5.0, -5.0), (5.0, 5.0)),
        CandidateEffect("hidden", (0.0,), (1.0,)),
    ),
    (DeclaredCondition("low", ("height",)),),
)


def reached(effect, name, amplitude, ruler, weak=None):
    kind = DataKind(effect, name, len(amplitude) == 2)
    return Reached(kind, amplitude, Strength(ruler, 0.3), None if weak is None else Strength(weak, 0.3), {})


REACHED = (
    reached("push", "push", (1.0,), 12.0, 6.0),
    reached("density", "density +", (0.3,), 8.0, 2.0),
    reached("density", "density -", (-0.3,), 8.0),
    reached("tilt", "tilt x", (5.0, 0.0), 10.0, 5.0),
    reached("tilt", "tilt y", (0.0, 5.0), 10.0),
    reached("hidden", "hidden", (1.0,), 0.2, 0.0),
)
STRENGTHS = strengths_of(REACHED, DECLARED, {frozenset(("push", "density")): 0.95})


def case(number, kind="effect", label="", strength=6.0):
    return Case(9, number, kind, label, strength)


def test_the_amplitude_follows_the_strength():
    """Proportional where half the amplitude was half the strength, as its root where it was a quarter."""
    ((_, (push,)),) = truth_of(case(0, label="push"), STRENGTHS).effects
    assert push == pytest.approx(6.0 / 12.0)
    ((_, (density,)),) = truth_of(case(0, label="density"), STRENGTHS).effects
    assert abs(density) == pytest.approx(0.3 * math.sqrt(6.0 / 8.0))


def test_a_direction_that_the_ruler_does_not_see_says_nothing_of_the_power():
    unseen = reached("density", "density +", (0.3,), 0.0, 1.0), reached("density", "density -", (-0.3,), 12.0)
    ((_, (density,)),) = truth_of(case(0, label="density"), strengths_of(unseen, DECLARED, {})).effects
    assert density == pytest.approx(-0.3 * 6.0 / 12.0)


def test_directions_are_drawn():
    signs = {np.sign(truth_of(case(k, label="density"), STRENGTHS).effects[0][1][0]) for k in range(20)}
    assert signs == {-1.0, 1.0}
    tilts = np.array([truth_of(case(k, label="tilt"), STRENGTHS).effects[0][1] for k in range(40)])
    assert np.linalg.norm(tilts, axis=1) == pytest.approx(3.0)
    assert np.abs(tilts.mean(axis=0)).max() < 1.0
    assert len(np.unique(np.round(np.arctan2(tilts[:, 1], tilts[:, 0]), 3))) == 40


def test_what_the_literature_does_not_support_is_missing_and_says_so():
    assert truth_of(case(0, label="density", strength=10.0), STRENGTHS).missing == "bounds"
    assert truth_of(case(0, label="hidden", strength=6.0), STRENGTHS).missing == "bounds"
    assert truth_of(case(0, label="push", strength=23.0), STRENGTHS).effects[0][1][0] <= 2.0
    assert truth_of(case(0, label="push", strength=25.0), STRENGTHS).missing == "bounds"


def test_another_effect_is_drawn_where_one_does_not_reach():
    drawn = {truth_of(case(k, strength=20.0), STRENGTHS).effects[0][0] for k in range(20)}
    assert drawn == {"push"}


def test_a_truth_follows_from_root_and_number_alone():
    one, again, other = (truth_of(case(n), STRENGTHS) for n in (7, 7, 8))
    assert one == again
    assert one.theta != other.theta
    assert truth_of(Case(10, 7, "effect", "", 6.0), STRENGTHS).theta != one.theta


def test_pairs_look_different():
    """Push and density are alike, so a pair has the tilt in it."""
    for number in range(20):
        names = {name for name, _ in truth_of(case(number, "pair", strength=7.0), STRENGTHS).effects}
        assert len(names) == 2
        assert "tilt" in names


def test_parameters_are_drawn_from_their_measurement():
    theta = np.array([truth_of(case(k, "null", strength=math.nan), STRENGTHS).theta for k in range(400)])
    assert theta[:, 0].mean() == pytest.approx(0.5, abs=0.01)
    assert theta[:, 0].std() == pytest.approx(0.05, rel=0.15)
    assert theta[:, 1].min() > 0.2
    assert theta[:, 1].std() == pytest.approx(0.6 / math.sqrt(12.0), rel=0.15)
