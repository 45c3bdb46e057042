"""Strengths against the linear toy world, where amplitude s/20 shifts by s standard errors in closed form."""

import numpy as np
import pytest

from doe.validation.schedule import Case
from doe.validation.truth import REPLICATES, Ruler, drawn_theta, truth_of
from tests.doe.diagnose.toy import FULL, known_emulator, make_toy

SUMMARIES = 12
COVARIANCE = 0.05
"""Error of lengths by the toy emulator's covariance of 10 000 degrees of freedom, its correlations shrunk by 1 %."""


@pytest.fixture(scope="module")
def toy():
    return make_toy(SUMMARIES, seed=3)


@pytest.fixture(scope="module")
def measure(toy):
    emulator = known_emulator(toy, np.random.default_rng(0), df=10_000)
    return Ruler(emulator, toy.declared, toy.declared.effects)


@pytest.mark.parametrize("strength", [4.0, 6.0, 10.0])
def test_the_amplitude_gives_the_strength_asked_for(measure, strength):
    for number, effect in enumerate(measure.declared.effects):
        truth = truth_of(Case(number, "effect", effect.name, strength), measure)
        ((name, (amplitude,)),) = truth.effects
        assert name == effect.name
        assert amplitude == pytest.approx(strength / FULL, rel=COVARIANCE)


def test_a_strength_beyond_the_range_is_missing_and_says_whose_fault_it_is(toy, measure):
    case = Case(0, "effect", "e1", 1.5 * FULL)
    assert truth_of(case, measure).missing == "bounds"
    wider = tuple(type(e)(e.name, e.low, tuple(2 * x for x in e.high)) for e in toy.declared.effects)
    assert truth_of(case, Ruler(measure.emulator, toy.declared, wider)).missing == "range"


def test_a_truth_follows_from_its_number_alone(measure):
    one, again, other = (truth_of(Case(n, "effect", "e2", 6.0), measure) for n in (7, 7, 8))
    assert one == again
    assert one.theta != other.theta


def test_pairs_look_different(toy, measure):
    """Effects 0, 1 and 2, 3 of the toy have signatures at cosine 0.9, where chance decides on which side."""
    for number in range(20):
        (one, a), (other, b) = truth_of(Case(number, "pair", "", 6.0), measure).effects
        ends = [toy.off[int(name[1:])] for name in (one, other)]
        assert abs(ends[0] @ ends[1]) <= 0.9 * (1 + COVARIANCE)
        assert [*a, *b] == pytest.approx([6.0 / FULL] * 2, rel=COVARIANCE)


def test_what_is_seen_of_a_shift_is_its_strength(toy, measure):
    """Noise adds 12 - 3 to the square of the shift, and is taken off: none without a shift, 10 with one of 10."""
    generator = np.random.default_rng(5)
    theta = drawn_theta(measure.declared, generator)
    coded = measure.coded(theta)
    seen = []
    for _ in range(200):
        noise = generator.standard_normal(SUMMARIES) / np.sqrt(REPLICATES)
        seen.append(measure.seen(theta, toy.jacobian @ coded + toy.listed(0, 10.0) + noise) ** 2)
    # One shift's square has a standard deviation of 2 x 10.
    assert np.mean(seen) == pytest.approx(100.0, abs=2 * COVARIANCE * 100 + 3 * 20 / np.sqrt(200))
    assert measure.seen(theta, toy.jacobian @ coded) == 0.0
